"""Derivatives that an FMU gives against differences of the FMU itself."""

from __future__ import annotations

from collections.abc import Sequence

STEP = 1e-4
"""Of the differences, relative to the known; the error of central ones of smooth functions is about 1e-8."""
_BAR = 1e-3
"""Differences and derivative must agree to this, relative to the greater one and the size of the unknown."""

Sides = tuple[float, float]
"""Differences to above and to below."""


def to_sides(here: Sequence[float], above: Sequence[float], below: Sequence[float], step: float) -> list[Sides]:
    """The differences of several unknowns whose values are known at a point and a step above and below it."""
    return [((a - c) / step, (c - b) / step) for a, b, c in zip(above, below, here, strict=True)]


def wanted(own: float, size: float, fine: Sides, coarse: Sides) -> float | None:
    """What differences give instead of the derivative ``own``; None where it may be right.

    ``size`` is that of the unknown, ``fine`` and ``coarse`` are differences by two steps. Central ones say nothing if
    they do not agree with one another. At a kink the derivative may be the one to either side: a moved start may be in
    another mode of an FMU that has events.
    """
    central, other = sum(fine) / 2, sum(coarse) / 2
    bar = _BAR * (max(abs(central), abs(own)) + 1e-3 * abs(size) + 1e-6)
    if not abs(central - other) < bar / 10:  # also where they are no numbers
        return None
    return None if any(abs(own - x) <= bar for x in (central, *fine)) else central
