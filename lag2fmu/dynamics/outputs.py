"""The outputs of a mechanism on the graph: expressions, and quantities of places, frames and bodies."""

from __future__ import annotations

from lag2fmu.description.outputs import QUANTITIES, TURNING, Output
from lag2fmu.description.places import AXES, WORLD
from lag2fmu.dynamics.energies import Composer
from lag2fmu.dynamics.frames import Rate
from lag2fmu.dynamics.momenta import Momenta
from lag2fmu.graph.autodiff import Forward
from lag2fmu.graph.vectors import Vector, cross, minus, plus


def composed_output(composer: Composer, output: Output) -> Vector:
    """The nodes of ``output``, one for each of its names, in SI units."""
    if output.quantity is None:
        return (composer.put(output.expression),)
    accelerating = Forward(composer.g, composer.variables.direction(composer.g, accelerating=True))
    if output.bodies is not None:
        return Momenta(composer, output, accelerating).entries()
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
    if str(output.quantity).endswith("_axis"):
        return frames.axes(name)[AXES.index(str(output.quantity)[0])]
    own = _along_axes(composer, name, str(output.quantity), accelerating)
    return own if output.axes != WORLD else frames.to_world(name, own)


def _along_axes(composer: Composer, name: str, quantity: str, accelerating: Rate) -> Vector:
    """A quantity of the frame ``name`` in its own axes.

    Velocities in these are derived as the acceleration of the origin, v_dot + omega x v. Source: R. Featherstone, Rigid
    Body Dynamics Algorithms, section 2.11.
    """
    g, moving = composer.g, composer.velocities[name]
    if quantity == "angular_velocity":
        return moving.angular
    if quantity == "angular_acceleration":
        return tuple(accelerating(moving.angular))
    if quantity == "origin_velocity":
        return moving.linear
    own = plus(g, tuple(accelerating(moving.linear)), cross(g, moving.angular, moving.linear))
    return minus(g, own, composer.frames.to_frame(name, composer.gravity()))
