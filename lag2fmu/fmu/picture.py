"""The picture of a mechanism at its start, as a scene and as the SVG element of a notebook."""

from __future__ import annotations

from lag2fmu.analysis.evaluation import attempted
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.errors import Lag2FmuError
from lag2fmu.fmu.sketch import sketch
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.drawing import draw
from lag2fmu.picture.layout import drawable, layout_of
from lag2fmu.picture.scene import Scene


def scene_at_start(equations: EquationsOfMotion) -> Scene | None:
    """The mechanism at its start as a picture; None where there is nothing that can be drawn."""
    if not drawable(equations.mechanism):
        return None
    return attempted(lambda: draw(layout_of(equations.mechanism)), None)


def picture_of(mechanism: Mechanism) -> str:
    """``mechanism`` at its start as an SVG element; "" where nothing can be drawn."""
    if not drawable(mechanism):
        return ""
    try:
        return sketch(draw(layout_of(derive(mechanism).mechanism)))
    except Lag2FmuError:
        return ""
