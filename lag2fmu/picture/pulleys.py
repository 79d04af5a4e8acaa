"""Masses that hang on ropes over pulleys, recognised by how they move.

The ends x1, x2 of a rope over a pulley at p move by dx1 + dx2 = 2 dp. The uppermost pulley is fixed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from lag2fmu.graph.batches import Floats
from lag2fmu.picture import glyphs
from lag2fmu.picture.scene import Canvas

_MOST = 5
"""The most masses that are tried in all orders."""
_CLEAR = 3.0
"""The distance between a pulley and a mass or pulley that hangs on it, in units of the picture."""


@dataclass(frozen=True)
class Pulley:
    """A pulley with the two ``ends`` of its rope: the spot of a mass, or a pulley that hangs there."""

    ends: tuple[int | Pulley, int | Pulley]

    def masses(self) -> list[int]:
        """The spots of the masses on it, from left to right."""
        return [i for end in self.ends for i in (end.masses() if isinstance(end, Pulley) else [end])]


def hung(slopes: Mapping[int, Floats]) -> Pulley | None:
    """The fixed pulley on which all spots hang, None if they do not move as if they hung on ropes.

    ``slopes`` {spot: (n,)} are the derivatives of their heights by q.
    """
    if not 1 < len(slopes) <= _MOST:
        return None
    return _joined([(spot, slope) for spot, slope in slopes.items()])


def _joined(loose: list[tuple[int | Pulley, Floats]]) -> Pulley | None:
    for (i, (one, a)), (j, (other, b)) in combinations(enumerate(loose), 2):
        pulley, slope = Pulley((one, other)), (a + b) / 2
        rest = [item for k, item in enumerate(loose) if k not in (i, j)]
        if not rest:
            return pulley if np.abs(slope).max() <= 1e-9 * np.abs(a).max() else None
        found = _joined([*rest[:i], (pulley, slope), *rest[i:]])
        if found is not None:
            return found
    return None


def draw_pulley(canvas: Canvas, pulley: Pulley, flat: Floats, height: float) -> None:
    """The fixed ``pulley`` below a ceiling, with all that hangs on it; masses reach ``height`` above their spots.

    ``flat`` (spots, 2) has all spots in the picture, in its units, as ``height`` is.
    """
    center, radius = _draw(canvas, pulley, flat, height)
    ceiling = center + np.array([0.0, radius + _CLEAR])
    canvas.stroke("pulleys", "link", [np.array([center, ceiling])])
    reach = np.array([radius, 0.0])
    canvas.stroke("pulleys", "ground", glyphs.hatched(ceiling + reach, ceiling - reach))


def _draw(canvas: Canvas, pulley: Pulley, flat: Floats, height: float) -> tuple[Floats, float]:
    """Draws ``pulley`` and all that hangs on it; returns its centre (2,) and radius."""
    tops = []
    for end in pulley.ends:
        if isinstance(end, Pulley):
            below, radius = _draw(canvas, end, flat, height)
            tops.append((below, radius))
        else:
            tops.append((flat[end] + np.array([0.0, height]), 0.0))
    (left, _), (right, _) = tops
    radius = float(right[0] - left[0]) / 2
    center = np.array([(left[0] + right[0]) / 2, max(top[1] + r for top, r in tops) + radius + _CLEAR])
    canvas.disc("pulleys", "shape", center, radius)
    for (top, _), side in zip(tops, (-radius, radius), strict=True):
        canvas.stroke("pulleys", "rope", [np.array([top, center + np.array([side, 0.0])])])
    canvas.disc("pulleys", "joint", center, 0.8)
    return center, radius
