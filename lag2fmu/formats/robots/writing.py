"""How numbers, axes and turns of a robot are written in a mechanism."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import sympy as sp

from lag2fmu.description.places import AXES
from lag2fmu.formats.robots.poses import QUARTER, Floats, JointPose
from lag2fmu.language.writer import without_dust

Turn = tuple["str | tuple[sp.Expr, ...]", sp.Expr]
"""An axis and an angle."""


def number(x: float) -> sp.Expr:
    """The decimal by which ``x`` is shown, as an exact number."""
    return sp.Rational(repr(float(x))) if x else sp.S.Zero


def numbers(vector: Iterable[float]) -> tuple[sp.Expr, ...]:
    """The entries of ``vector``; those that are rounding errors relative to the greatest one become 0."""
    entries = [float(x) for x in vector]
    size = max(map(abs, entries), default=0.0)
    return tuple(number(without_dust(x, size)) for x in entries)


def turns_of(pose: JointPose) -> list[Turn]:
    """The turns of ``pose``, quarter turns exact."""
    return [(axis, _angle(angle)) for axis, angle in pose.turns]


def _angle(x: float) -> sp.Expr:
    """``x`` rad, quarter turns exact."""
    quarters = round(x / (np.pi / 2))
    return quarters * sp.pi / 2 if abs(x - quarters * np.pi / 2) < QUARTER else number(x)


def axis_of(axis: Floats) -> str | tuple[sp.Expr, ...]:
    """The letter of an ``axis``, a unit vector (3,), along x, y or z, else its entries."""
    along = [k for k in range(3) if axis[k] == 1.0]
    return AXES[along[0]] if along else numbers(axis)


def turn(axis: Floats, angle: sp.Expr) -> Turn:
    """The turn by ``angle`` (rad) about ``axis``, a unit vector (3,); about -x, -y, -z by the opposite angle."""
    against = [k for k in range(3) if axis[k] == -1.0]
    return (AXES[against[0]], -angle) if against else (axis_of(axis), angle)
