"""Attachments to joints and links: actuators, tendons, joints that close loops, couplings."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial, reduce
from itertools import pairwise, product

import sympy as sp

from lag2fmu.description.joints import JOINTS
from lag2fmu.description.joints import Joint as Closing
from lag2fmu.description.names import of_constraint
from lag2fmu.description.parts import Constraint, Damper, Load, Spring
from lag2fmu.description.places import AXES, WORLD, Frame, Point
from lag2fmu.description.symbols import signal
from lag2fmu.formats.identifiers import identifier, identifiers
from lag2fmu.formats.robots.parts import DAMPINGS, STIFFNESSES, Parts
from lag2fmu.formats.robots.tree import (
    Actuator,
    Closure,
    Coupling,
    JointPose,
    Robot,
    Span,
    Sum,
    Tendon,
    Transmission,
    Turning,
    Wrench,
)
from lag2fmu.formats.robots.turning import angular_velocity, velocity
from lag2fmu.formats.robots.writing import number, numbers, turns_of
from lag2fmu.language.vocabulary import symbol


def attach(robot: Robot, parts: Parts) -> None:
    """Add the attachments of ``robot`` to ``parts``, which has all links already.

    Numbers of actuators, tendons and couplings become parameters without a unit, because files give none: their use
    determines it.
    """
    for actuator in robot.actuators:
        _drive(actuator, parts)
    for tendon in robot.tendons:
        _stretch(tendon, parts)
    names = [*(c.name for c in robot.closures), *(c.name for c in robot.couplings)]
    closures = identifiers(names, "equalities")
    for closure in robot.closures:
        brings = partial(_of_joint, closure.kind)
        _close(closure, parts.names.entry("constraints", closures[closure.name], brings), parts)
    for coupling in robot.couplings:
        _couple(coupling, parts.names.entry("constraints", closures[coupling.name], of_constraint), parts)


def _of_joint(kind: str, name: str) -> list[str]:
    """The names that a joint of a ``kind`` brings, which becomes constraints."""
    suffixes = [
        f"{turn}{axis}" for turn, axis in product(("", "turn_") if "turn" in JOINTS[kind].equations else ("",), AXES)
    ]
    return [x for suffix in suffixes for x in (f"constraints.{name}_{suffix}", *of_constraint(f"{name}_{suffix}"))]


def _sum(length: Sum, name: str, parts: Parts) -> tuple[sp.Expr, sp.Expr]:
    """A length and its rate as expressions."""
    factors = [factor for _, factor in length]
    gears = _gears(name, factors, parts)
    joints = [parts.joints[joint] for joint, _ in length]
    at, rate = (sp.Add(*(x * symbol(f"{q}{dot}") for q, x in zip(joints, gears, strict=True))) for dot in ("", "_dot"))
    return at, rate


def _gears(name: str, factors: Sequence[float], parts: Parts) -> list[sp.Expr]:
    """Factors as parameters, none where a single one is 1: of several one takes lengths and another one angles."""
    if len(factors) == 1:
        return [_gear(name, factors[0], parts)]
    return [_ratio(f"gear_{name}_{k}", x, parts) if x else sp.S.Zero for k, x in enumerate(factors, 1)]


def _gear(name: str, factor: float, parts: Parts) -> sp.Expr:
    """A factor as a parameter, nothing where it is 1."""
    return sp.S.One if factor == 1.0 else _ratio(f"gear_{name}", factor, parts)


def _ratio(name: str, factor: float, parts: Parts) -> sp.Expr:
    """A parameter that is a number without a dimension, unless another one is so and the two together have one."""
    made = parts.parameter(name, factor)
    parts.plain.append(str(made))
    return made


def _turning(along: Turning, name: str, parts: Parts) -> tuple[sp.Expr, sp.Expr]:
    """A rate as an expression, behind the length 0 that stands for one that is not used."""
    joint = parts.joints[along.joint]
    turns = angular_velocity(joint, in_parent=along.in_parent)
    rates = turns if len(along.gear) == len(turns) else [*velocity(joint), *turns]
    gears = _gears(name, along.gear, parts)
    return sp.S.Zero, sp.Add(*(gear * rate for gear, rate in zip(gears, rates, strict=True)))


_GAINS, _BIASES = ("gain", "length_gain", "velocity_gain"), ("offset_gain", "position_gain", "rate_gain")


def _factors(labels: Sequence[str], values: Sequence[float], name: str, parts: Parts) -> list[sp.Expr]:
    """The factors of 1, a length and its rate as parameters, none where they are 0, or a gain of 1 alone."""
    if labels == _GAINS and tuple(values) == (1.0, 0.0, 0.0):
        return [sp.S.One, sp.S.Zero, sp.S.Zero]
    named = zip(labels, values, strict=True)
    return [parts.parameter(f"{label}_{name}", x) if x else sp.S.Zero for label, x in named]


def _servo(actuator: Actuator, gain: sp.Expr, alone: Sequence[sp.Expr]) -> list[sp.Expr]:
    """The sum of two gains that have one unit, where u is what the actuator holds, a length or a rate; else nothing."""
    held = [back for back, own in zip(alone[1:], actuator.bias[1:], strict=True) if own == -actuator.gain[0]]
    return [] if gain.is_number or not held else [gain + held[0]]


def _drive(actuator: Actuator, parts: Parts) -> None:
    """An input, and the forces that follow from it."""
    along, idle = actuator.along, _idle(actuator.along, parts)
    if idle:
        parts.ignored.append(f"the actuator {actuator.name}: {idle}")
        return
    name = parts.names.variable(f"u_{identifier(actuator.name)}")
    u = signal(name, minimum=actuator.lower, maximum=actuator.upper, doc=f"control of the actuator {actuator.name}")
    parts.inputs.append(u)
    gain, alone = _factors(_GAINS, actuator.gain, name, parts), _factors(_BIASES, actuator.bias, name, parts)
    force, by_length, by_rate = (x * u + y for x, y in zip(gain, alone, strict=True))
    parts.alike += _servo(actuator, gain[0], alone)
    if isinstance(along, Wrench):
        _push(along, name, force, parts)
    elif isinstance(along, Span):
        gear, spots = _gear(name, along.gear, parts), _spots(along, name, parts)
        force = gear * (force + by_rate * gear * symbol("rate"))
        for k, ends in enumerate(pairwise(spots), 1):
            suffix = name if len(spots) == 2 else f"{name}_{k}"
            damper = parts.names.entry("dampers", f"actuator_{suffix}")
            parts.dampers.append(Damper(damper, force=-force, between=ends))
        if by_length:  # a force that grows with the length is that of a spring of negative stiffness
            spring = parts.names.entry("springs", f"position_{name}")
            parts.springs.append(Spring(spring, -by_length * gear**2, between=spots, length=0))
    else:
        at, rate = _turning(along, name, parts) if isinstance(along, Turning) else _sum(along, name, parts)
        force += by_length * at + by_rate * rate
        for q in sorted(str(q) for q in parts.coordinates if q.dot in rate.free_symbols):
            factor = rate.diff(symbol(f"{q}_dot"))
            parts.forces[q] = parts.forces.get(q, sp.S.Zero) + factor * force


def _idle(along: Transmission, parts: Parts) -> str:
    """Why a force ``along`` something moves nothing, '' where it may."""
    if isinstance(along, Wrench) and parts.carriers[along.link][0] == WORLD:
        return "it acts on the world, which does not move"
    if isinstance(along, Span) and len({parts.carriers[link][0] for link, _ in along.spots}) == 1:
        return "its ends do not move to each other"
    return ""


def _push(along: Wrench, name: str, size: sp.Expr, parts: Parts) -> None:
    """A force and a torque at a place of a link, in its axes, times ``size``."""
    place = _spot(along.link, along.place, f"place_of_{name}", parts)
    _, matrix, _ = parts.carriers[along.link]
    arm = parts.parameter(f"arm_{name}", 1.0, "m") if any(along.force) and any(along.torque) else sp.S.One
    force = tuple(x * size for x in numbers(matrix @ along.force))
    torque = tuple(x * arm * size for x in numbers(matrix @ along.torque))
    if any(force):
        parts.loads.append(Load(parts.names.entry("loads", f"force_of_{name}"), point=place, force=force, axes="frame"))
    if any(torque):
        parts.loads.append(
            Load(parts.names.entry("loads", f"torque_of_{name}"), body=place, torque=torque, axes="frame")
        )


def _spots(along: Span, name: str, parts: Parts) -> list[str]:
    """The names of its points."""
    return [_spot(link, place, f"{name}_site_{k}", parts) for k, (link, place) in enumerate(along.spots, 1)]


def _spot(link: str, place: Sequence[float], name: str, parts: Parts) -> str:
    """The name of a new point at a ``place`` of a ``link``."""
    carrier, matrix, pose = parts.carriers[link]
    name = parts.names.entry("places", name)
    parts.points.append(Point(name, numbers(pose.origin + matrix @ place), carrier))
    return name


def _stretch(tendon: Tendon, parts: Parts) -> None:
    """A spring and a damper along a length."""
    name, along, between = identifier(tendon.name), tendon.length, None
    if isinstance(along, Span) and (idle := _idle(along, parts)):
        parts.ignored.append(f"the tendon {tendon.name}: {idle}")
        return
    at = rate = length = None
    units: tuple[str | None, ...] = (None, None, None)
    if isinstance(along, Span):
        between, units = _spots(along, name, parts), (STIFFNESSES["m"], "m", DAMPINGS["m"])
    else:
        at, rate = _sum(along, name, parts)
    of = f"of the tendon {tendon.name}"
    if tendon.stiffness:
        k, length = (
            parts.parameter(f"{what}_{name}", value, unit, f"{what} {of}")
            for what, value, unit in zip(("stiffness", "length"), (tendon.stiffness, tendon.rest), units, strict=False)
        )
        if at is not None:
            at, length = at - length, None
        spring = parts.names.entry("springs", name)
        parts.springs.append(Spring(spring, k, elongation=at, between=between, length=length))
    if tendon.damping:
        c = parts.parameter(f"damping_{name}", tendon.damping, units[2], f"damping {of}")
        parts.dampers.append(Damper(parts.names.entry("dampers", name), c, rate=rate, between=between))


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
    """A holonomic constraint of one or two coordinates."""
    first, zero = coupling.first
    numbers_of = [number(c) for c in coupling.coefficients]
    x = symbol(parts.joints[first]) - _reference(f"{name}_zero_1", zero, parts)
    value = sp.S.Zero if not numbers_of else numbers_of[0]
    if coupling.second is not None:
        joint, origin = coupling.second
        y = symbol(parts.joints[joint]) - _reference(f"{name}_zero_2", origin, parts)
        named = [parts.parameter(f"{name}_c{k}", c) for k, c in enumerate(coupling.coefficients)]
        value = reduce(lambda total, c: total * y + c, reversed(named), sp.S.Zero)
    elif value:
        value = parts.parameter(f"{name}_c0", coupling.coefficients[0])
    parts.constraints.append(Constraint(name, sp.expand(x - value)))


def _reference(name: str, value: float, parts: Parts) -> sp.Expr:
    """A zero of a coordinate as a parameter, nothing where it is 0."""
    return parts.parameter(name, value) if value else sp.S.Zero
