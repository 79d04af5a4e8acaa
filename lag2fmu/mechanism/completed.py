"""Records of what follows from a description."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.parts import Constraint
from lag2fmu.language.units import Unit


class Unilateral(NamedTuple):
    """A gap >= 0 with its laws of impact and friction; all are expressions in SI, which may contain definitions.

    ``gap`` depends on t, q, motions and parameters, and has the ``unit`` (None: unknown). ``slips`` are affine in the
    velocities, in the gap's unit per s; there is none without friction, one in the plane, two in space.
    ``restitution`` is Newton's coefficient, ``friction`` and ``static_friction`` are Coulomb's. ``where`` is the place
    of the contact or stop in the mechanism.
    """

    name: str
    gap: sp.Expr
    slips: tuple[sp.Expr, ...]
    restitution: sp.Expr
    friction: sp.Expr
    static_friction: sp.Expr
    unit: Unit | None
    where: str


class Completed(NamedTuple):
    """What follows from a description: the description with everything written out, ``expanded``, and further results.

    ``latches`` are the constraints that hold only while an expression is positive; all others are in ``expanded``. The
    other fields are explained in ``Mechanism``.
    """

    expanded: Description
    origins: Mapping[str, str]
    warnings: tuple[str, ...]
    unilaterals: tuple[Unilateral, ...]
    latches: tuple[Constraint, ...]
    fixed_parameters: frozenset[str]
    hidden_inputs: frozenset[str]
