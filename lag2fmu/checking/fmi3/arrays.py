"""Rules on arrays and structural parameters (FMI 3.0.2, section 2.4.7.2)."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.description import whole
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.description import Description3, Variable3
from lag2fmu.xml_tree import XmlElement


def array_findings(description: Description3, variable: Variable3) -> Iterator[Finding]:
    """The broken rules on the dimensions of a variable and on the number of its start values.

    Source: FMI 3.0.2 specification, section 2.4.7.2 (array variables and structural parameters).
    """
    for dimension in variable.dimensions:
        place = f"{DESCRIPTION}:{dimension.line} '{variable.name}' <Dimension>"
        yield from _dimension(description, dimension, place)
    if variable.causality == "structuralParameter" and variable.dimensions:
        problem = "a structural parameter with dimensions"
        yield Finding("structural-parameter", variable.place, problem, "structural parameters are scalars")
    if variable.size and len(variable.starts) not in (0, 1, variable.size):
        problem = f"{len(variable.starts)} start values for {variable.size} elements"
        yield Finding("start-count", variable.place, problem, "give one for each element, or one for all")


def _dimension(description: Description3, dimension: XmlElement, place: str) -> Iterator[Finding]:
    start, reference = (dimension.attributes.get(name) for name in ("start", "valueReference"))
    if (start is None) == (reference is None):
        problem = "has both start and valueReference" if start is not None else "has neither start nor valueReference"
        yield Finding("dimension", place, problem, "give a fixed size or the parameter that holds it")
    elif start is not None:
        if whole(start, 1) == 0:
            yield Finding("dimension", place, "start='0'", "sizes are positive at the beginning")
    else:
        yield from _sizing(description.by_reference.get(whole(reference or "", -1)), reference or "", place)


def _sizing(parameter: Variable3 | None, reference: str, place: str) -> Iterator[Finding]:
    """The variable that holds the size of a dimension."""
    if parameter is None:
        problem = f"valueReference='{reference}' is that of no variable"
        yield Finding("dimension-parameter", place, problem, "name a structural parameter or a constant")
        return
    if parameter.type != "UInt64":
        problem = f"'{parameter.name}', which holds the size, is {parameter.type}"
        yield Finding("dimension-parameter", place, problem, "make it a UInt64")
    if parameter.causality != "structuralParameter" and parameter.variability != "constant":
        problem = f"'{parameter.name}', which holds the size, is a {parameter.variability} {parameter.causality}"
        yield Finding("dimension-parameter", place, problem, "make it a structural parameter or a constant")
    if parameter.start is not None and whole(parameter.start, 1) == 0:
        problem = f"'{parameter.name}', which holds the size, starts at 0"
        yield Finding("dimension-parameter", place, problem, "sizes are positive at the beginning")
