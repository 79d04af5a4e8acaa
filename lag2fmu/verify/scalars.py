"""The numbers in the variables of an FMU by name; an array of FMI 3.0 has several.

An FMU of lag2fmu tells the names of the elements of its arrays. Those of other tools are called NAME[1], NAME[2], by
the structured naming convention.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from lag2fmu.errors import Lag2FmuError
from lag2fmu.fmu.contents import read_mechanism
from lag2fmu.fmu.ports import array_elements
from lag2fmu.verify.run import Scalar, size_of


def scalars_of(description: Any, path: Path) -> dict[str, Scalar]:
    """The numbers in the variables of the FMU ``path`` by name, Booleans among them; clocks and texts are left out."""
    elements = _elements(description, path)
    found = (s for v in description.modelVariables if _is_number(v) for s in _scalars(v, elements))
    return {scalar.name: scalar for scalar in found}


def _is_number(variable: Any) -> bool:
    numbers = ("Real", "Integer", "Enumeration", "Boolean")
    return variable.type in numbers or variable.type.startswith(("Float", "Int", "UInt"))


def _scalars(variable: Any, elements: Mapping[str, Sequence[str]]) -> Iterator[Scalar]:
    starts = str(variable.start).split() if variable.start is not None else []
    if not getattr(variable, "shape", ()):
        yield Scalar(variable.name, variable, 0, _number(starts[0]) if starts else None)
        return
    size = size_of(variable)
    named = elements.get(variable.name) or [f"{variable.name}[{i + 1}]" for i in range(size)]
    for i, name in enumerate(named[:size]):
        yield Scalar(name, variable, i, _number(starts[i]) if i < len(starts) else None)


def _number(text: str) -> float:
    return float(text == "true") if text in ("true", "false") else float(text)


def _elements(description: Any, path: Path) -> Mapping[str, Sequence[str]]:
    """{array: its elements} of an FMU of lag2fmu, which carries its mechanism."""
    if not any(getattr(v, "shape", ()) for v in description.modelVariables):
        return {}
    try:
        return array_elements(read_mechanism(path))
    except Lag2FmuError:
        return {}
