"""Actuators: an input each, and the force that follows from it or from a state that it drives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import sympy as sp

from lag2fmu.description.events import State
from lag2fmu.description.parts import Damper, Load
from lag2fmu.description.symbols import signal
from lag2fmu.formats.identifiers import identifier
from lag2fmu.formats.robots.lengths import gear_of, gears_of, idle, length_of, spot_of, spots_of
from lag2fmu.formats.robots.muscles import activation_rate, muscle_force
from lag2fmu.formats.robots.parts import Parts
from lag2fmu.formats.robots.tree import Activation, Actuator, Limits, Muscle, Robot, RobotJoint, Span, Turning, Wrench
from lag2fmu.formats.robots.turning import angular_velocity, velocity
from lag2fmu.formats.robots.writing import numbers
from lag2fmu.language.rebuilding import call
from lag2fmu.language.vocabulary import Choice, Smooth, symbol


def _turning(along: Turning, name: str, parts: Parts) -> tuple[sp.Expr, sp.Expr]:
    """A rate as an expression, behind the length 0 that stands for one that is not used."""
    joint = parts.joints[along.joint]
    turns = angular_velocity(joint, in_parent=along.in_parent)
    rates = turns if len(along.gear) == len(turns) else [*velocity(joint), *turns]
    gears = gears_of(name, along.gear, parts)
    return sp.S.Zero, sp.Add(*(gear * rate for gear, rate in zip(gears, rates, strict=True)))


_ENDS = 2
"""The places between which a damper knows its own rate."""
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


def drive(actuator: Actuator, parts: Parts) -> None:
    """An input, and the forces that follow from it."""
    along, reason = actuator.along, idle(actuator.along, parts)
    if reason:
        parts.ignored.append(f"the actuator {actuator.name}: {reason}")
        return
    name = parts.names.variable(f"u_{identifier(actuator.name)}")
    saturating = ", saturating" if actuator.control_limits else ""
    control = signal(name, doc=f"control of the actuator {actuator.name}{saturating}")
    parts.inputs.append(control)
    u = saturated(control, actuator.control_limits, name, parts)
    if actuator.muscle is not None:
        return _contract(actuator, actuator.muscle, u, name, parts)
    if actuator.state is not None:
        u = _activated(actuator, actuator.state, u, parts)
    gain, alone = _factors(_GAINS, actuator.gain, name, parts), _factors(_BIASES, actuator.bias, name, parts)
    force, by_length, by_rate = (x * u + y for x, y in zip(gain, alone, strict=True))
    limits = partial(saturated, limits=actuator.force_limits, name=f"force_{name}", parts=parts)
    parts.alike += _servo(actuator, gain[0], alone)
    if isinstance(along, Wrench):
        _push(along, name, limits(force), parts)
    elif isinstance(along, Span) and not by_length and (not by_rate or len(along.spots) == _ENDS):
        gear = gear_of(name, along.gear, parts)
        force = gear * limits(force + by_rate * gear * symbol("rate"))
        _pull(spots_of(along, name, parts), name, force, parts)
    else:
        at, rate = _turning(along, name, parts) if isinstance(along, Turning) else length_of(along, name, parts)
        force = limits(force + by_length * at + by_rate * rate)
        if not isinstance(along, Turning):
            parts.driven[actuator.name] = at, rate, force
        _act(force, rate, parts)


def _act(force: sp.Expr, rate: sp.Expr, parts: Parts) -> None:
    """A ``force`` along the length that has this ``rate``."""
    for q in sorted(str(q) for q in parts.coordinates if q.dot in rate.free_symbols):
        parts.forces[q] = parts.forces.get(q, sp.S.Zero) + rate.diff(symbol(f"{q}_dot")) * force


def _contract(actuator: Actuator, muscle: Muscle, u: sp.Expr, name: str, parts: Parts) -> None:
    """The force of a ``muscle`` along joints, whose activation follows the control ``u``."""
    activation = parts.names.variable(f"act_{identifier(actuator.name)}")
    z = symbol(activation)
    rate = activation_rate(muscle, u, z, activation, parts)
    parts.alike.append(z + u)
    parts.states.append(State(activation, None, 0.0, rate, doc=f"activation of the muscle {actuator.name}"))
    at, speed = length_of(actuator.along, name, parts)  # type: ignore[arg-type]  # other muscles are not read
    active, passive = muscle_force(muscle, at, speed, name, parts)
    force = saturated(active * z + passive, actuator.force_limits, f"force_{name}", parts)
    parts.driven[actuator.name] = at, speed, force
    _act(force, speed, parts)


def saturated(x: sp.Expr, limits: Limits | None, name: str, parts: Parts) -> sp.Expr:
    """``x`` within its ``limits``, which are parameters called after ``name``; a solver may pass the kinks."""
    if limits is None:
        return x
    low, high = (
        parts.parameter(f"{what}_{name}", limit) for what, limit in zip(("least", "most"), limits, strict=True)
    )
    return Smooth(call(sp.Max, low, call(sp.Min, high, x)))


def _activated(actuator: Actuator, state: Activation, u: sp.Expr, parts: Parts) -> sp.Expr:
    """The state of an ``actuator`` whose control is ``u``: what takes the place of the control in its force.

    At its limits the state stays, as MuJoCo holds it there after each step, until it is driven back.
    """
    name = parts.names.variable(f"act_{identifier(actuator.name)}")
    z = symbol(name)
    if state.kind == "integrator":
        rate, same = u, u * symbol("t")
    else:
        T = parts.parameter(f"time_constant_{name}", state.time_constant, "s")
        rate, same = (u - z) / T, u
    parts.alike.append(z + same)
    within, start = z, 0.0
    if state.limits is not None:
        within, start = saturated(z, state.limits, name, parts), min(max(0.0, state.limits[0]), state.limits[1])
        low, high = (symbol(parts.parameters[k].name) for k in (-2, -1))
        beyond = Choice(z - high, sp.Max(rate, 0), 0) + Choice(low - z, sp.Min(rate, 0), 0)
        rate = rate - Smooth(beyond)
    parts.states.append(State(name, None, start, rate, doc=f"activation of the actuator {actuator.name}"))
    return within


def limit_force(joint: RobotJoint, robot: Robot, parts: Parts) -> None:
    """Let the sum of the actuators' forces along a ``joint`` saturate at its limits."""
    name = parts.joints[joint.name]
    if joint.force_limits is None or not robot.actuators:
        return
    if any(isinstance(actuator.along, (Wrench, Span)) for actuator in robot.actuators):
        parts.ignored.append(f"limits of the actuators' force on the joint {joint.name}, as some act between sites")
    elif name in parts.forces:
        parts.forces[name] = saturated(parts.forces[name], joint.force_limits, f"force_{name}", parts)


def _pull(spots: Sequence[str], name: str, force: sp.Expr, parts: Parts) -> None:
    """A ``force`` from each of the ``spots`` to the next."""
    for k, ends in enumerate(pairwise(spots), 1):
        suffix = name if len(spots) == _ENDS else f"{name}_{k}"
        damper = parts.names.entry("dampers", f"actuator_{suffix}")
        parts.dampers.append(Damper(damper, force=-force, between=ends))


def _push(along: Wrench, name: str, size: sp.Expr, parts: Parts) -> None:
    """A force and a torque at a place of a link, in its axes, times ``size``."""
    place = spot_of(along.link, along.place, f"place_of_{name}", parts)
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
