"""Attachments to joints and links: actuators, tendons, joints that close loops, couplings, compensated weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial, reduce
from itertools import product

import sympy as sp

from lag2fmu.description.events import Friction
from lag2fmu.description.joints import JOINTS
from lag2fmu.description.joints import Joint as Closing
from lag2fmu.description.names import of_constraint, of_friction
from lag2fmu.description.parts import Constraint, Damper, Load, Spring
from lag2fmu.description.places import AXES, WORLD, Frame, Point
from lag2fmu.formats.identifiers import identifier, identifiers
from lag2fmu.formats.robots.driving import drive, limit_force
from lag2fmu.formats.robots.lengths import idle, length_of, spots_of
from lag2fmu.formats.robots.parts import DAMPINGS, INERTIAS, STIFFNESSES, Parts
from lag2fmu.formats.robots.poses import JointPose
from lag2fmu.formats.robots.tree import Closure, Coupling, Robot, Span, Tendon
from lag2fmu.formats.robots.writing import number, numbers, turns_of
from lag2fmu.language.rebuilding import call

_ENDS = 2
"""The places between which springs and dampers act by themselves."""


def attach(robot: Robot, parts: Parts, *, stops: bool) -> None:
    """Add the attachments of ``robot`` to ``parts``, which has all links already; with ``stops`` tendons' limits too.

    Numbers of actuators, tendons and couplings become parameters without a unit, because files give none: their use
    determines it.
    """
    for actuator in robot.actuators:
        drive(actuator, parts)
    for joint in robot.joints:
        limit_force(joint, robot, parts)
    for tendon in robot.tendons:
        if acting := _acting(tendon, parts, stops=stops):
            _stretch(acting, parts)
    names = [*(c.name for c in robot.closures), *(c.name for c in robot.couplings)]
    closures = identifiers(names, "equalities")
    for closure in robot.closures:
        brings = partial(_of_joint, closure.kind)
        _close(closure, parts.names.entry("constraints", closures[closure.name], brings), parts)
    for coupling in robot.couplings:
        _couple(coupling, parts.names.entry("constraints", closures[coupling.name], of_constraint), parts)


def lift(robot: Robot, parts: Parts, up: Sequence[sp.Expr]) -> None:
    """Add forces that compensate weights of ``robot`` to ``parts``; ``up`` (3,), in m/s2, is against gravity."""
    names = identifiers(robot.lifted, "bodies")
    for link, mass in robot.lifted.items():
        (frame, matrix, pose), inertia = parts.carriers[link], robot.links[link]
        if frame == WORLD or inertia is None or not mass:
            continue
        name = names[link]
        lifted = parts.parameter(f"lifted_{name}", mass, "kg", f"mass of {name} whose weight is compensated")
        centre = parts.names.entry("places", f"{name}_centre")
        parts.points.append(Point(centre, numbers(inertia.moved(matrix, pose.origin).center), frame))
        force = [lifted * x for x in up]
        parts.loads.append(Load(parts.names.entry("loads", f"lift_of_{name}"), point=centre, force=force))


def _of_joint(kind: str, name: str) -> list[str]:
    """The names that a joint of a ``kind`` brings, which becomes constraints."""
    suffixes = [
        f"{turn}{axis}" for turn, axis in product(("", "turn_") if "turn" in JOINTS[kind].equations else ("",), AXES)
    ]
    return [x for suffix in suffixes for x in (f"constraints.{name}_{suffix}", *of_constraint(f"{name}_{suffix}"))]


def _acting(tendon: Tendon, parts: Parts, *, stops: bool) -> Tendon | None:
    """What acts of a ``tendon``, None if nothing does; the rest is told. Limits act with ``stops`` alone."""
    if isinstance(tendon.length, Span) and (reason := idle(tendon.length, parts)):
        parts.ignored.append(f"the tendon {tendon.name}: {reason}")
        return None
    if tendon.limits and not stops:
        parts.ignored.append(f"limits of the tendon {tendon.name} (stops take them)")
        tendon = replace(tendon, limits=None)
    return tendon if tendon.acts else None


def _stretch(tendon: Tendon, parts: Parts) -> None:
    """A spring, a damper and an inertia along a length, its dry friction and its limits."""
    name, along, between = identifier(tendon.name), tendon.length, None
    at = rate = elongation = length = None
    units: tuple[str | None, ...] = (None, None, None, None, None)
    if isinstance(along, Span):
        units = (STIFFNESSES["m"], "m", DAMPINGS["m"], INERTIAS["m"], "N")
    (low, high), of = tendon.rest, f"of the tendon {tendon.name}"
    if isinstance(along, Span) and len(along.spots) == _ENDS and low == high and not tendon.has_more:
        between = spots_of(along, name, parts)
    else:
        at, rate = length_of(along, name, parts)
    if tendon.stiffness:
        k = parts.parameter(f"stiffness_{name}", tendon.stiffness, units[0], f"stiffness {of}")
        length = parts.parameter(f"length_{name}", high, units[1], f"length {of}")
        if at is not None:
            elongation, length = at - _free_length(tendon, at, length, name, parts), None
        spring = parts.names.entry("springs", name)
        parts.springs.append(Spring(spring, k, elongation=elongation, between=between, length=length))
    if tendon.armature:
        inertia = parts.parameter(f"armature_{name}", tendon.armature, units[3], f"armature {of}")
        parts.armatures.append(inertia * sp.S(rate) ** 2 / 2)
    if tendon.damping:
        c = parts.parameter(f"damping_{name}", tendon.damping, units[2], f"damping {of}")
        parts.dampers.append(Damper(parts.names.entry("dampers", name), c, rate=rate, between=between))
    if tendon.friction:
        force = parts.parameter(f"friction_{name}", tendon.friction, units[4], f"dry friction {of}")
        friction = parts.names.entry("frictions", f"friction_of_{name}", of_friction)
        parts.frictions.append(Friction(friction, on=rate, force=force))
    if tendon.limits:
        parts.limit(f"stop_of_{name}", at, tendon.limits)


def _free_length(tendon: Tendon, at: sp.Expr, longest: sp.Expr, name: str, parts: Parts) -> sp.Expr:
    """The length at which a spring that is ``at`` a length would be free: that length, where it is slack."""
    low, high = tendon.rest
    if low == high:
        return longest
    if not low and isinstance(tendon.length, Span):  # no way is shorter than 0
        return call(sp.Min, longest, at)
    unit = "m" if isinstance(tendon.length, Span) else None
    doc = f"shortest free length of the tendon {tendon.name}"
    return call(sp.Max, parts.parameter(f"shortest_{name}", low, unit, doc), call(sp.Min, longest, at))


def _close(closure: Closure, name: str, parts: Parts) -> None:
    """Two frames and the joint between them."""
    ends = []
    for end, (link, pose) in zip("ab", (closure.first, closure.second), strict=True):
        carrier, matrix, place = parts.carriers[link]
        whole = JointPose.of(place.origin + matrix @ pose.origin, matrix @ pose.matrix)
        ends.append(parts.names.entry("places", f"{name}_{end}"))
        parts.frames.append(Frame(ends[-1], carrier, numbers(whole.origin), turns_of(whole)))
    parts.closures.append(Closing(name, closure.kind, between=ends))


def _couple(coupling: Coupling, name: str, parts: Parts) -> None:
    """A holonomic constraint of one or two lengths."""
    first, zero = coupling.first
    numbers_of = [number(c) for c in coupling.coefficients]
    x = length_of(first, f"{name}_1", parts)[0] - _reference(f"{name}_zero_1", zero, parts)
    value = sp.S.Zero if not numbers_of else numbers_of[0]
    if coupling.second is not None:
        second, origin = coupling.second
        y = length_of(second, f"{name}_2", parts)[0] - _reference(f"{name}_zero_2", origin, parts)
        named = [parts.parameter(f"{name}_c{k}", c) for k, c in enumerate(coupling.coefficients)]
        value = reduce(lambda total, c: total * y + c, reversed(named), sp.S.Zero)
    elif value:
        value = parts.parameter(f"{name}_c0", coupling.coefficients[0])
    parts.constraints.append(Constraint(name, sp.expand(x - value)))


def _reference(name: str, value: float, parts: Parts) -> sp.Expr:
    """A zero of a coordinate as a parameter, nothing where it is 0."""
    return parts.parameter(name, value) if value else sp.S.Zero
