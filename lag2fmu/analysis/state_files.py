"""Files of matrices with names: JSON, MATLAB 5 and NumPy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.errors import ExportError
from lag2fmu.writing import replacing

FORMATS = (".json", ".mat", ".npz")
"""The endings of files that a state space is written to."""


def write_matrices(path: str | Path, content: dict[str, Any]) -> None:
    """Write ``content`` {name: text, number, list of texts or array of any shape} to ``path``.

    Raises ExportError for an ending that is not among FORMATS, and for a file that cannot be written.
    """
    path = Path(path)
    if path.suffix not in FORMATS:
        raise ExportError(f"'{path}': its ending must be one of {', '.join(FORMATS)}")
    try:
        with replacing(path) as new:
            _WRITERS[path.suffix](new, content)
    except OSError as error:
        raise ExportError(f"cannot write '{path}': {error.strerror or error}; choose another place") from error


def _json(path: Path, content: dict[str, Any]) -> None:
    plain = {x: value.tolist() if isinstance(value, np.ndarray) else value for x, value in content.items()}
    lines = (f" {json.dumps(x)}: {json.dumps(value)}" for x, value in plain.items())
    path.write_text("{\n" + ",\n".join(lines) + "\n}\n", "utf-8")


def _mat(path: Path, content: dict[str, Any]) -> None:
    from scipy.io import savemat

    cells = {x: np.array(value, dtype=object) if isinstance(value, list) else value for x, value in content.items()}
    savemat(path, cells, oned_as="column")


def _npz(path: Path, content: dict[str, Any]) -> None:
    arrays: dict[str, Any] = {x: np.array(value) for x, value in content.items()}
    np.savez(path, **arrays)


_WRITERS = {".json": _json, ".mat": _mat, ".npz": _npz}
