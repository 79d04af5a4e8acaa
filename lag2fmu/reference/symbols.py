"""The symbols of a mechanism, group by group."""

from __future__ import annotations

from dataclasses import dataclass, field

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.names import acceleration, generalized_force, velocity
from lag2fmu.language.vocabulary import symbol


@dataclass(frozen=True)
class Symbols:
    """The symbols of a mechanism with n coordinates, k motions, m plain inputs and p parameters, in its order.

    ``filtered``: the filtered motions, which are the last of the k motions. ``further``: the f further states of first
    order, without those of filtered motions.
    """

    q: tuple[sp.Symbol, ...]
    qd: tuple[sp.Symbol, ...]
    motion: tuple[sp.Symbol, ...]
    motion_dot: tuple[sp.Symbol, ...]
    motion_ddot: tuple[sp.Symbol, ...]
    plain: tuple[sp.Symbol, ...]
    external: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    further: tuple[sp.Symbol, ...] = ()
    filtered: int = field(default=0, kw_only=True)

    @property
    def signals(self) -> tuple[sp.Symbol, ...]:
        """Everything that comes from outside: y, y_dot, y_ddot without filtered ones, plain inputs, Q_<coordinate>."""
        k = len(self.motion) - self.filtered
        return (*self.motion[:k], *self.motion_dot[:k], *self.motion_ddot[:k], *self.plain, *self.external)

    @property
    def inputs(self) -> tuple[sp.Symbol, ...]:
        """What forces may contain beside t, q, qd and parameters: (3 k + m + n + f,), the motions first."""
        motions = (*self.motion, *self.motion_dot, *self.motion_ddot)
        return (*motions, *self.plain, *self.external, *self.further)


def symbols_of(mechanism: Description) -> Symbols:
    """The symbols of ``mechanism``."""
    q = [c.name for c in mechanism.coordinates]
    y = mechanism.driven
    groups = (
        q,
        [velocity(name) for name in q],
        y,
        [velocity(name) for name in y],
        [acceleration(name) for name in y],
        [u.name for u in mechanism.plain_inputs],
        [generalized_force(name) for name in q],
        [p.name for p in mechanism.parameters],
        [z.name for z in mechanism.states if not z.moves],
    )
    filtered = len(y) - len(mechanism.motions)
    return Symbols(*(tuple(symbol(name) for name in group) for group in groups), filtered=filtered)
