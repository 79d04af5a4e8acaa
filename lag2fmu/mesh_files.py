"""Triangles in files: STL by NumPy and Collada by pycollada, which is optional."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_HEAD, _TRIANGLE = 84, 50
"""Bytes of a binary STL file before its triangles, and of each of them: a normal, three corners, and two more."""


@dataclass(frozen=True, eq=False)
class FileMesh:
    """The ``corners`` (m, 3, 3) of m triangles of one ``color``: #rrggbb, "" where the file has none."""

    corners: NDArray[np.float32]
    color: str = ""


def stl_count(path: Path) -> int:
    """How many triangles the file at ``path`` has as a binary STL file, 0 if it is none. Raises OSError."""
    with path.open("rb") as file:
        count = int.from_bytes(file.read(_HEAD)[_HEAD - 4 :], "little")
    return count if path.stat().st_size == _HEAD + _TRIANGLE * count else 0


def stl_mesh(path: Path) -> FileMesh:
    """The triangles of a binary STL file, in its own unit. Raises OSError."""
    rows = np.fromfile(path, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")], offset=_HEAD)
    return FileMesh(np.ascontiguousarray(rows["corners"]))


def collada_meshes(path: Path) -> Iterator[FileMesh]:
    """The meshes of a DAE file, where its scene puts them.

    Raises ImportError without pycollada, and what pycollada raises for a file that is damaged.
    """
    import collada

    document = collada.Collada(str(path), ignore=[collada.common.DaeError])  # such as a picture that is not there
    for shape in document.scene.objects("geometry") if document.scene else ():
        mirrors = np.linalg.det(shape.matrix[:3, :3]) < 0.0
        for part in shape.primitives():
            found = part.triangleset() if isinstance(part, collada.polylist.BoundPolylist) else part
            if isinstance(found, collada.triangleset.BoundTriangleSet) and found.vertex_index is not None:
                corners = found.vertex[found.vertex_index].astype(np.float32)
                yield FileMesh(corners[:, ::-1] if mirrors else corners, _color(part.material))


def _color(material: Any) -> str:
    """The color of what has a ``material`` of pycollada; a picture is white."""
    effect = getattr(material, "effect", None)
    if effect is None:
        return ""
    shares = effect.diffuse if isinstance(effect.diffuse, tuple) else (1.0, 1.0, 1.0)
    return "#" + "".join(f"{round(255 * min(max(x, 0.0), 1.0)):02x}" for x in shares[:3])
