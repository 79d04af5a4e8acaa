"""What acts between joints and links that are there: actuators, tendons, joints that close loops, couplings."""

from __future__ import annotations

from functools import reduce

import sympy as sp

from lag2fmu.description.joints import Joint as Closing
from lag2fmu.description.parts import Constraint, Damper, Spring
from lag2fmu.description.places import Frame
from lag2fmu.description.symbols import signal
from lag2fmu.formats.identifiers import identifier, identifiers
from lag2fmu.formats.robots.parts import Parts
from lag2fmu.formats.robots.tree import Actuator, Closure, Coupling, Pose, Robot, Sum, Tendon
from lag2fmu.formats.robots.writing import number, numbers, turns_of
from lag2fmu.language.vocabulary import symbol


def attach(robot: Robot, parts: Parts) -> None:
    """Add to ``parts``, in which all links are, what ``robot`` has between them.

    Numbers of actuators and couplings become parameters without a unit: their files have none.
    """
    for actuator in robot.actuators:
        _drive(actuator, parts)
    for tendon in robot.tendons:
        _stretch(tendon, parts)
    names = [*(c.name for c in robot.closures), *(c.name for c in robot.couplings)]
    closures = identifiers(names, "equalities")
    for closure in robot.closures:
        _close(closure, closures[closure.name], parts)
    for coupling in robot.couplings:
        _couple(coupling, closures[coupling.name], parts)


def _sum(length: Sum, name: str, parts: Parts) -> tuple[sp.Expr, sp.Expr, list[tuple[str, sp.Expr]]]:
    """A length and its rate as expressions, and the factor of each coordinate."""
    factors = []
    for k, (joint, factor) in enumerate(length, 1):
        suffix = name if len(length) == 1 else f"{name}_{k}"
        plain = factor == 1.0
        factors.append((parts.joints[joint], sp.S.One if plain else parts.parameter(f"gear_{suffix}", factor, None)))
    at, rate = (sp.Add(*(f * symbol(f"{q}{dot}") for q, f in factors)) for dot in ("", "_dot"))
    return at, rate, factors


def _drive(actuator: Actuator, parts: Parts) -> None:
    """An input, and the forces that follow from it."""
    name = f"u_{identifier(actuator.name)}"
    u = signal(name, minimum=actuator.lower, maximum=actuator.upper, doc=f"control of the actuator {actuator.name}")
    parts.inputs.append(u)
    at, rate, factors = _sum(actuator.length, name, parts)
    force = u if actuator.gain == 1.0 else parts.parameter(f"gain_{name}", actuator.gain, None) * u
    for label, value, of in zip(("offset", "position", "rate"), actuator.bias, (1, at, rate), strict=True):
        if value:
            force += parts.parameter(f"{label}_gain_{name}", value, None) * of
    for q, factor in factors:
        parts.forces[q] = parts.forces.get(q, sp.S.Zero) + factor * force


def _stretch(tendon: Tendon, parts: Parts) -> None:
    """A spring and a damper along a length."""
    name = identifier(tendon.name)
    at, rate, _ = _sum(tendon.length, name, parts)
    if tendon.stiffness:
        k = parts.parameter(f"stiffness_{name}", tendon.stiffness, None)
        parts.springs.append(Spring(name, k, elongation=at - parts.parameter(f"length_{name}", tendon.rest, None)))
    if tendon.damping:
        parts.dampers.append(Damper(name, parts.parameter(f"damping_{name}", tendon.damping, None), rate=rate))


def _close(closure: Closure, name: str, parts: Parts) -> None:
    """Two frames and the joint between them."""
    ends = []
    for end, (link, pose) in zip("ab", (closure.first, closure.second), strict=True):
        carrier, matrix, place = parts.carriers[link]
        whole = Pose.of(place.origin + matrix @ pose.origin, matrix @ pose.matrix)
        ends.append(f"{name}_{end}")
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
        named = [parts.parameter(f"{name}_c{k}", c, None) for k, c in enumerate(coupling.coefficients)]
        value = reduce(lambda total, c: total * y + c, reversed(named), sp.S.Zero)
    elif value:
        value = parts.parameter(f"{name}_c0", coupling.coefficients[0], None)
    parts.constraints.append(Constraint(name, sp.expand(x - value)))


def _reference(name: str, value: float, parts: Parts) -> sp.Expr:
    """A zero of a coordinate as a parameter, nothing where it is 0."""
    return parts.parameter(name, value, None) if value else sp.S.Zero
