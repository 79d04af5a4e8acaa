"""Muscles by MuJoCo's curves: active and passive forces over length and velocity, and how fast activation follows.

The curves are pieces of parabolas with continuous slopes, so that a solver may pass their joins. Source:
https://mujoco.readthedocs.io/en/stable/modeling.html#muscles, and the functions mju_muscle* that it names.
"""

from __future__ import annotations

import sympy as sp

from lag2fmu.formats.robots.parts import Parts
from lag2fmu.formats.robots.tree import Muscle
from lag2fmu.formats.robots.writing import number
from lag2fmu.language.vocabulary import Choice, Smooth


def muscle_force(muscle: Muscle, at: sp.Expr, rate: sp.Expr, name: str, parts: Parts) -> tuple[sp.Expr, sp.Expr]:
    """(what the activation multiplies, what is passive) in the force of a ``muscle`` of the length ``at``; it pulls."""
    peak, optimal, unit = (
        parts.parameter(f"{label}_{name}", getattr(muscle, label)) for label in ("peak", "optimal", "unit")
    )
    length, speed = 1 + (at - optimal) / unit, rate / (unit * parts.parameter(f"vmax_{name}", muscle.vmax, "1/s"))
    parts.alike += [at + optimal, at + unit]
    return -peak * _by_length(muscle, length) * _by_speed(muscle, speed), -peak * _passive(muscle, length)


def _by_length(muscle: Muscle, length: sp.Expr) -> sp.Expr:
    """The active force by length: 1 at the optimal one, 0 from ``lmin`` down and from ``lmax`` up."""
    low, high = number(muscle.lmin), number(muscle.lmax)
    a, b = (low + 1) / 2, (high + 1) / 2
    rising, falling = (length - low) / (a - low), (high - length) / (high - b)
    left = Choice(a - length, rising**2 / 2, 1 - ((1 - length) / (1 - a)) ** 2 / 2)
    right = Choice(b - length, 1 - ((length - 1) / (b - 1)) ** 2 / 2, falling**2 / 2)
    inside = Choice(1 - length, Choice(length - low, left, 0), Choice(high - length, right, 0))
    return Smooth(inside)


def _by_speed(muscle: Muscle, speed: sp.Expr) -> sp.Expr:
    """The active force by the speed of lengthening, in units of vmax: 1 at rest, ``fvmax`` from fvmax - 1 up."""
    most = number(muscle.fvmax)
    y = most - 1
    lengthening = Choice(y - speed, most - (y - speed) ** 2 / y, most) if y else most
    return Smooth(Choice(-speed, Choice(speed + 1, (speed + 1) ** 2, 0), lengthening))


def _passive(muscle: Muscle, length: sp.Expr) -> sp.Expr:
    """The passive force by length, 0 up to the optimal one."""
    b = (1 + number(muscle.lmax)) / 2
    x = (length - 1) / (b - 1)
    return number(muscle.fpmax) * Smooth(Choice(length - 1, Choice(length - b, x - sp.Rational(1, 2), x**2 / 2), 0))


def activation_rate(muscle: Muscle, control: sp.Expr, z: sp.Expr, name: str, parts: Parts) -> sp.Expr:
    """The rate at which the activation ``z`` follows a ``control``: faster up than down."""
    up, down = (parts.parameter(f"{label}_{name}", getattr(muscle, label), "s") for label in ("rise", "fall"))
    limited = [Smooth(sp.Max(0, sp.Min(1, x))) for x in (control, z)]
    factor = sp.Rational(1, 2) + sp.Rational(3, 2) * limited[1]
    rising, falling, away = up * factor, down / factor, limited[0] - z
    if not muscle.smoothing:
        return Smooth(away / Choice(away, rising, falling))
    x = Smooth(sp.Max(0, sp.Min(1, away / number(muscle.smoothing) + sp.Rational(1, 2))))
    return away / (falling + (rising - falling) * x**3 * (3 * x * (2 * x - 5) + 10))
