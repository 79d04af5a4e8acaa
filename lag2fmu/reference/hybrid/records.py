"""What is known at one state of a hybrid mechanism: its rows, its equations, and the accelerations and forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lag2fmu.reference.constraints import Values
from lag2fmu.reference.state import Floats, StateBatch
from lag2fmu.reference.terms import Terms

Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Rows:
    """The k rows at one state, in SI units.

    Gaps are (u,), velocities and gamma (k,), J (k, n), restitution, friction and static friction (u,). ``latched``
    (l,): the positions of latches, 0 for latches that hold velocities. ``slip_rows``: the rows of the slips of each
    contact; ``friction_rows``: those of dry frictions.
    """

    gaps: Floats
    latched: Floats
    velocities: Floats
    gamma: Floats
    jacobian: Floats
    restitution: Floats
    friction: Floats
    static: Floats
    slip_rows: Sequence[Indices]
    friction_rows: Indices


@dataclass(frozen=True)
class MotionPoint:
    """A single ``state`` with everything that does not depend on its unknown accelerations and forces.

    ``forcing`` (n,) without constraints and contacts; ``constraints``: values, velocities, gamma (m,), G (m, n);
    ``nominal``: the nominal values of the coordinates (n,).
    """

    state: StateBatch
    terms: Terms
    forcing: Floats
    constraints: Values
    rows: Rows
    nominal: Floats


@dataclass(frozen=True)
class Answer:
    """Accelerations (n,), multipliers (m,), forces along all rows (k,), and the largest holding forces (f,).

    ``bound``: the rows that are kept, in position or velocity. ``unique``: no other multipliers and forces have the
    same motion.
    """

    qdd: Floats
    multipliers: Floats
    forces: Floats
    holding: Floats
    bound: Sequence[int]
    unique: bool
