"""Choices that do not fit FMI 3.0, or fit nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from lag2fmu.errors import ExportError
from lag2fmu.fmu import export


@pytest.mark.parametrize(
    ("choices", "said"),
    [
        ({"arrays": True}, "--arrays: FMI 2.0 has no arrays; add --fmi 3.0, or leave --arrays out"),
        ({"fmi": "1.0"}, "unknown version of FMI '1.0'; known are 2.0, 3.0"),
        ({"fmi": "3.0", "backend": "python"}, "--fmi 3.0: the python backend writes FMI 2.0 only"),
    ],
    ids=["arrays", "version", "backend"],
)
def test_what_cannot_be_is_refused(choices: dict[str, object], said: str, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=said.replace("(", r"\(")):
        export("pendulum", tmp_path / "x.fmu", **choices)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())
