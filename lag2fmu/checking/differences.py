"""The comparison of derivatives that an FMU gives with differences of the FMU itself."""

from __future__ import annotations

from collections.abc import Sequence

STEP = 1e-4
"""The steps of differences, relative to the known; central differences of smooth functions err by about 1e-8."""
_BAR = 1e-3
"""Differences and derivative must agree to this, relative to the greater one and the size of the unknown."""

Sides = tuple[float, float]
"""Differences to above and to below."""


def to_sides(here: Sequence[float], above: Sequence[float], below: Sequence[float], step: float) -> list[Sides]:
    """The differences of several unknowns whose values are known at a point and a step above and below it."""
    return [((a - c) / step, (c - b) / step) for a, b, c in zip(above, below, here, strict=True)]


def wanted(own: float, size: float, fine: Sides, coarse: Sides) -> float | None:
    """The derivative by differences that contradicts the derivative ``own``; None if ``own`` may be right.

    ``size`` is that of the unknown; ``fine`` and ``coarse`` are differences by two steps. Central differences that do
    not agree with one another say nothing. At a kink the derivative may be that to either side, because an FMU with
    events may be in another mode at a moved start.
    """
    central, other = sum(fine) / 2, sum(coarse) / 2
    bar = _BAR * (max(abs(central), abs(own)) + 1e-3 * abs(size) + 1e-6)
    if not abs(central - other) < bar / 10:  # this is so for NaN, too
        return None
    return None if any(abs(own - x) <= bar for x in (central, *fine)) else central
