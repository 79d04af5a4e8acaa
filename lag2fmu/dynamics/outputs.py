"""The outputs of a mechanism on the graph: expressions, and quantities of places and frames."""

from __future__ import annotations

from lag2fmu.description.outputs import QUANTITIES, TURNING, Output
from lag2fmu.description.places import WORLD
from lag2fmu.dynamics.energies import Composer
from lag2fmu.dynamics.frames import Rate
from lag2fmu.graph.autodiff import Forward
from lag2fmu.graph.vectors import Vector


def composed_output(composer: Composer, output: Output) -> Vector:
    """The nodes of ``output``, one for each of its names, in SI units."""
    if output.quantity is None:
        return (composer.put(output.expression),)
    accelerating = Forward(composer.g, composer.variables.direction(composer.g, accelerating=True))
    if output.point is None:
        return _of_frame(composer, output, accelerating)
    point = str(output.point)
    found: Vector = (composer.angle(point),) if output.turning else composer.place(point)
    order = tuple(TURNING if output.turning else QUANTITIES).index(output.quantity)
    for rate in (composer.rate, accelerating)[:order]:
        found = tuple(rate(found))
    return found


def _of_frame(composer: Composer, output: Output, accelerating: Rate) -> Vector:
    frames, name = composer.frames, str(output.frame)
    if output.quantity == "quaternion":
        return frames.quaternion(name)
    if output.quantity == "angles":
        return frames.angles(name)
    if output.quantity == "rotation":
        return tuple(entry for row in zip(*frames.axes(name), strict=True) for entry in row)
    own = composer.velocities[name].angular
    own = tuple(accelerating(own)) if output.quantity == "angular_acceleration" else own
    return own if output.axes != WORLD else frames.to_world(name, own)
