"""The comparison of derivatives that an FMU gives with differences of the FMU itself."""

from __future__ import annotations

from collections.abc import Sequence

from lag2fmu.checking.description import Variable
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.session import Model

STEP = 1e-4
"""The steps of differences, relative to the known; central differences of smooth functions err by about 1e-8."""
_BAR = 1e-3
"""Differences and derivative must agree to this, relative to the greater one and the size of the unknown."""

_ROUNDING = 1e-12
"""Of the greatest derivative: what may remain where all of it cancels."""

Sides = tuple[float, float]
"""Differences to above and to below."""


def to_sides(here: Sequence[float], above: Sequence[float], below: Sequence[float], step: float) -> list[Sides]:
    """The differences of several unknowns whose values are known at a point and a step above and below it."""
    return [((a - c) / step, (c - b) / step) for a, b, c in zip(above, below, here, strict=True)]


def wanted(own: float, size: float, fine: Sides, coarse: Sides, greatest: float = 0.0) -> float | None:
    """The derivative by differences that contradicts the derivative ``own``; None if ``own`` may be right.

    ``size`` is that of the unknown; ``fine`` and ``coarse`` are differences by two steps; ``greatest`` is the greatest
    derivative of all by this known, of which rounding remains in those that cancel. Central differences that do
    not agree with one another say nothing. At a kink the derivative may be that to either side, because an FMU with
    events may be in another mode at a moved start.
    """
    central, other = sum(fine) / 2, sum(coarse) / 2
    bar = _BAR * (max(abs(central), abs(own)) + 1e-3 * abs(size) + 1e-6) + _ROUNDING * greatest
    if not abs(central - other) < bar / 10:  # this is so for NaN, too
        return None
    return None if any(abs(own - x) <= bar for x in (central, *fine)) else central


def not_listed(unknown: Variable, known: Variable, mode: str) -> Finding:
    """A known that is not among the dependencies of an unknown that varies with it."""
    problem = f"'{unknown.name}' varies with '{known.name}' in {mode}, which is not among its dependencies"
    return Finding("dependency-missing", unknown.place, problem, "list it")


def contradicted(model: Model, mode: str, names: tuple[str, str], own: float, other: float) -> Finding:
    """The derivative of one by the other of ``names`` that is ``own`` for the FMU and ``other`` by differences."""
    problem = f"in {mode}, d {names[0]} / d {names[1]} = {own:.6g}, but differences give {other:.6g}"
    return Finding("directional", model.kind, problem, "check the derivative and the dependencies")
