"""Pictures of mechanisms as data: where everything is in the plane, without a drawing library."""

from lag2fmu.picture.drawing import draw, posture
from lag2fmu.picture.labels import Label, pretty
from lag2fmu.picture.layout import Layout, drawable, layout_of
from lag2fmu.picture.scene import STYLES, Disc, Scene, Stroke

__all__ = ["STYLES", "Disc", "Label", "Layout", "Scene", "Stroke", "draw", "drawable", "layout_of", "posture", "pretty"]
