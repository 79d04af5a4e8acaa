"""The strokes and discs of a scene, drawn by matplotlib."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from lag2fmu.picture.scene import STYLES, Disc, Stroke

Marks = Iterable[Stroke | Disc]


def draw_marks(axes: Axes, marks: Marks, scale: float, alpha: float = 1.0) -> None:
    """Strokes and discs, back to front; ``scale``: points for a unit of width."""
    for order, mark in enumerate(marks):
        style = STYLES[mark.style]
        common: dict[str, Any] = {"alpha": alpha, "zorder": 2 + 0.001 * order, "linewidth": scale * style.width}
        if isinstance(mark, Disc):
            axes.add_patch(
                Circle(mark.center, mark.radius, facecolor=style.fill or "none", edgecolor=style.color, **common)
            )
        elif mark.closed and style.fill:
            axes.add_patch(
                Polygon(mark.points, facecolor=style.fill, edgecolor=style.color, joinstyle="round", **common)
            )
        else:
            dashes = (0, (2.5, 2.5)) if style.dashed else "solid"
            axes.plot(*np.array(mark.points).T, color=style.color, linestyle=dashes, solid_capstyle="round", **common)
