"""Pictures of mechanisms as data: where everything is in the plane, without a drawing library."""

from lag2fmu.dynamics.picture.labels import Label, pretty
from lag2fmu.dynamics.picture.scene import STYLES, Disc, Drawing, Scene, Stroke, drawable, scene_of

__all__ = ["STYLES", "Disc", "Drawing", "Label", "Scene", "Stroke", "drawable", "pretty", "scene_of"]
