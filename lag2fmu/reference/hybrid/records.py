"""What is known at one state of a hybrid mechanism: its rows, its equations, and the accelerations and forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

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
    contact; ``friction_rows``: those of dry frictions; ``changing`` (u,): whether coefficients of friction change.
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
    changing: Sequence[bool]


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
class Responses:
    """What forces r along all k ``rows`` make where constraints stay met, and so do the l latches of the rows ``held``.

    ``moved`` (n, 2 + k): accelerations without r, the jump of qd that meets constraints and latches, and what a unit of
    each r adds to either, a force to the one or an impulse to the other. ``loads`` (m + l, 2 + k): what the constraints
    and these latches bear for that.
    """

    rows: Rows
    held: Sequence[int]
    moved: Floats
    loads: Floats

    @cached_property
    def D(self) -> Floats:
        """The accelerations along rows by a unit of force along each row, (k, k)."""
        return np.asarray(self.rows.jacobian @ self.moved[:, 2:])

    @property
    def c(self) -> Floats:
        """The accelerations along rows without forces along them, (k,)."""
        return np.asarray(self.rows.jacobian @ self.moved[:, 0] + self.rows.gamma)

    @property
    def caught(self) -> Floats:
        """The velocities of rows, (k,), behind the jump that meets constraints and latches."""
        return np.asarray(self.rows.velocities + self.rows.jacobian @ self.moved[:, 1])

    def borne(self, forces: Floats, *, jump: bool = False) -> tuple[Floats, Floats]:
        """Multipliers (m,), and forces along all rows (k,), where ``forces`` (k,) are those of all but the latches.

        Of a ``jump`` they are impulses.
        """
        found, whole = self.loads[:, int(jump)] + self.loads[:, 2:] @ forces, forces.copy()
        m = len(found) - len(self.held)
        whole[self.held] = found[m:]
        return found[:m], whole


@dataclass(frozen=True)
class Answer:
    """Accelerations (n,), multipliers (m,), forces along all rows (k,), and the largest holding forces (f,).

    ``bound``: the rows that are kept, in position or velocity. ``free`` (r, d): multipliers and forces of bound rows
    that may be added without another motion, an orthonormal basis in ``units`` (r,); ``bears`` (f, r) is what each of
    them adds to ``holding`` where there are any.
    """

    qdd: Floats
    multipliers: Floats
    forces: Floats
    holding: Floats
    bound: Sequence[int]
    units: Floats
    free: Floats
    bears: Floats
