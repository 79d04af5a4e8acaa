"""Kinks frozen on one side, so that the equations are smooth between two switches.

Each kink whose margin moves gets a side s, +1 or -1, and a formula that is smooth while the side lasts:

    sign(m) = s,  |m| = s m,  heaviside(m) = (1 + s)/2,  max(a, b) = (a + b + s (a - b))/2 with m = a - b.

A gap or constraint that follows a table of straight pieces has a kink at each of its points, with m = x - x_k, and one
at each end of a smooth table that is held there; so it has along each argument of a table of two. What is closed or
bound is struck there. Forces may pass the points of their tables, because steps notice what those change.

Where the margin comes to zero the side changes. A broken power of a frozen kink, such as max(0, d)**1.5, is continued
beyond this place by |d|**1.5, because trial steps may go there. Kinks of constants, and kinks within ``smooth``, are
not frozen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import compress
from typing import Any, cast

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from lag2fmu.description.description import Entry
from lag2fmu.language.definitions import Defined, calls, define
from lag2fmu.language.vocabulary import TIME, Choice, Smooth
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.composition import Composition, composition_of
from lag2fmu.reference.symbols import Symbols
from lag2fmu.reference.tables import Tabulated, straight_pieces, without_ends

KINKS = (sp.sign, sp.Abs, sp.Heaviside, Choice)
BENT = ("contacts", "stops", "constraints")
"""Where the points of a table are kinks."""
MOST_BENDS, MOST_PIECES = 64, 256
"""The points of a table with more of them, or with more pieces, are no kinks: it is a curve or surface of samples."""


class Kinks:
    """The kinks that were met: ``margins``, and for each the symbol of its side.

    ``moving`` are the symbols that change during a run. Nothing is frozen until they are known, and nothing more once
    the list is ``closed``. Margins m and -m share one side.
    """

    def __init__(self) -> None:
        self.moving: frozenset[sp.Symbol] = frozenset()
        self._parameters: frozenset[sp.Symbol] = frozenset()
        self.margins: list[sp.Expr] = []
        self.sides: list[sp.Symbol] = []
        self.bending = False  # whether tables are frozen, too; those that have been stay so
        self.closed = False
        self._known: dict[sp.Expr, sp.Expr] = {}
        self._calls: dict[Defined, sp.Expr] = {}

    def frozen(self, expression: sp.Expr) -> sp.Expr:
        """``expression`` with the sides in place of its kinks."""
        for call in calls([expression]):
            if call not in self._calls:
                frozen, whole = self._frozen(call.meaning), call.meaning
                self._calls[call] = call if frozen == whole else define(call.definition, frozen, call.by)
        return self._frozen(expression)

    def _frozen(self, expression: sp.Expr) -> sp.Expr:
        """``expression`` with the sides in place of its kinks; the definitions that it calls are frozen already."""
        if isinstance(expression, Defined):
            return self._calls[expression]
        if isinstance(expression, Smooth):
            return self._frozen(expression.args[0]) if self.bending else expression.args[0]
        if not expression.args or not expression.free_symbols & self.moving:
            return expression
        arguments = tuple(self._frozen(a) for a in expression.args)
        found = self._on_a_side(expression, arguments)
        if found is not None:
            return found
        return expression if arguments == expression.args else _rebuilt(expression, arguments)

    def _on_a_side(self, expression: sp.Expr, arguments: tuple[sp.Expr, ...]) -> sp.Expr | None:
        """What a function with kinks is on the sides of its ``arguments``; None for a function without."""
        if isinstance(expression, (sp.Min, sp.Max)):
            return self._extreme(arguments, 1 if isinstance(expression, sp.Max) else -1) or expression
        if isinstance(expression, Tabulated):
            straight = self._straight(expression, arguments)
            return self._held(expression, arguments) if straight is None else straight
        if isinstance(expression, KINKS):
            side = self._side(arguments[0])
            return expression.func(*arguments) if side is None else self._formula(expression.func, side, arguments)
        return None

    def _formula(self, function: type[sp.Expr], side: sp.Expr, arguments: tuple[sp.Expr, ...]) -> sp.Expr:
        if function is sp.sign:
            return side
        if function is sp.Abs:
            return side * arguments[0]
        if function is sp.Heaviside:
            return (1 + side) / 2
        return function(side, *arguments[1:])  # by the side itself, for the other value may be undefined

    def _extreme(self, arguments: tuple[sp.Expr, ...], sense: int) -> sp.Expr | None:
        found, *others = arguments
        for other in others:
            side = self._side(found - other)
            if side is None:
                return None
            found = (found + other + sense * side * (found - other)) / 2
        return found

    def _straight(self, table: Tabulated, arguments: Sequence[sp.Expr]) -> sp.Expr | None:
        """The straight pieces of a ``table``, by the sides of its points; None where these are no kinks."""
        factors, axes = straight_pieces(table), table.data[0]
        if factors is None:
            return None
        others = [tuple(i for i in range(len(axes)) if i != k) for k in range(len(axes))]
        bent = [np.atleast_1d(factors.any(axis=other))[2:].tolist() for other in others]
        ramps = self._ramps(arguments, [list(compress(axis, bends)) for axis, bends in zip(axes, bent, strict=True)])
        if ramps is None:
            return None
        found: NDArray[Any] = factors
        for x, axis, bends, up in zip(arguments, axes, bent, ramps, strict=True):
            found = np.compress([True, True, *bends], found, axis=0)
            found = np.tensordot(np.array([sp.S.One, x - axis[0], *up]), found, axes=1)
        return cast(sp.Expr, found.item())

    def _held(self, table: Tabulated, arguments: Sequence[sp.Expr]) -> sp.Expr | None:
        """A smooth ``table`` that is held beyond its ends, by the sides of the ends; None for another one."""
        inside = without_ends(table)
        ends = [(axis[0], axis[-1]) for axis in table.data[0]]
        ramps = None if inside is None else self._ramps(arguments, ends)
        if inside is None or ramps is None:
            return None
        return inside(*(first + above - beyond for (first, _), (above, beyond) in zip(ends, ramps, strict=True)))

    def _ramps(self, arguments: Sequence[sp.Expr], points: Sequence[Sequence[float]]) -> list[list[sp.Expr]] | None:
        """max(0, x - x_k) for each of the ``arguments`` x and its ``points`` x_k, by their sides.

        None where none of the points is a kink. Those of an argument that does not move are none.
        """
        margins = [[x - point for point in axis] for x, axis in zip(arguments, points, strict=True)]
        few = math.prod(len(along) + 1 for along in margins) <= MOST_PIECES
        moving = [margin for along in margins for margin in along if few and margin.free_symbols & self.moving]
        sides = self._sides(moving)
        if not sides:
            return None
        return [[m * (1 + sides[m]) / 2 if m in sides else sp.Max(0, m) for m in along] for along in margins]

    def _sides(self, margins: Sequence[sp.Expr]) -> dict[sp.Expr, sp.Expr]:
        """The side of each of the ``margins`` of a table; none where these are no kinks."""
        if len(margins) > MOST_BENDS or not (self.bending or self._known.keys() >= set(margins)):
            return {}
        sides = {margin: side for margin in margins if (side := self._side(margin)) is not None}
        return sides if sides.keys() >= set(margins) else {}

    def _side(self, margin: sp.Expr) -> sp.Expr | None:
        """The side of ``margin``: a symbol, or its negative; None for one that does not move."""
        free = margin.free_symbols - set(self.sides)
        if margin in self._known:
            return self._known[margin]
        if self.closed or not free & self.moving or not free <= self.moving | self._parameters:
            return None
        side = sp.Symbol(f"side {len(self.sides)}", real=True)  # a name that no user can give
        self.margins.append(margin)
        self.sides.append(side)
        self._known[margin], self._known[-margin] = side, -side
        return side

    def open_for(self, symbols: Symbols) -> None:
        """Take ``symbols`` as those of the mechanism: coordinates, velocities, inputs and time move."""
        self.moving = frozenset((TIME, *symbols.q, *symbols.qd, *symbols.inputs))
        self._parameters = frozenset(symbols.parameters)


def _rebuilt(expression: sp.Expr, arguments: tuple[sp.Expr, ...]) -> sp.Expr:
    """``expression`` with other arguments, a broken power continued to where its frozen base is negative."""
    if isinstance(expression, sp.Pow) and not arguments[1].is_integer:
        return sp.Abs(arguments[0]) ** arguments[1]
    return expression.func(*arguments)


@dataclass(frozen=True, eq=False)
class FrozenComposition(Composition):
    """The composition of a mechanism with all kinks that move frozen; their sides are its last parameters."""

    kinks: Kinks = field(default_factory=Kinks)

    def __post_init__(self) -> None:
        """Meet every kink, then close the list."""
        super().__post_init__()
        for entry in _bent_first(self.mechanism):
            self.kinks.bending = entry.table in BENT
            self.written(entry.expression)
        self.kinks.bending = True
        for unilateral in self.mechanism.unilaterals:
            for expression in (unilateral.gap, *unilateral.slips):
                self.written(expression)
        for latch in self.mechanism.latches:
            self.written(latch.expression)
            self.written(latch.while_)
        self.kinks.closed = True
        s = self.symbols
        self._set(symbols=replace(s, parameters=(*s.parameters, *self.kinks.sides)))

    def damper_power(self) -> sp.Expr:
        """The power (W) that dampers with a law of force dissipate, without the dampers on frames."""
        rates = ((damper, self._damper_rate(damper)) for damper in self._fixed_dampers() if damper.force is not None)
        return sp.Add(*(self.written(damper.force_at(rate)) * rate for damper, rate in rates))

    def written(self, expression: sp.Expr | int | float | None) -> sp.Expr:
        """``expression`` with definitions written out and kinks frozen; None becomes 0."""
        if not self.kinks.moving:
            self.kinks.open_for(self.symbols)
        return self.kinks.frozen(self.bent(expression))

    def bent(self, expression: sp.Expr | int | float | None) -> sp.Expr:
        """``expression`` with definitions written out and its kinks as they are; None becomes 0."""
        return cast(sp.Expr, super().written(expression))


def _bent_first(mechanism: Mechanism) -> list[Entry]:
    """The entries of ``mechanism``, first those of BENT, for a definition that several use is frozen once."""
    return sorted(mechanism.entries(), key=lambda entry: entry.table not in BENT)


def is_hybrid(mechanism: Mechanism) -> bool:
    """Whether ``mechanism`` has events: contacts, stops, dry friction, conditions on constraints, or moving kinks."""
    if mechanism.hybrid:
        return True
    composition, kinks = composition_of(mechanism), Kinks()
    kinks.open_for(composition.symbols)
    for entry in _bent_first(mechanism):
        if entry.table not in ("outputs", "definitions"):  # no motion depends on an output
            kinks.bending = entry.table in BENT
            kinks.frozen(composition.written(entry.expression))
    return bool(kinks.sides)
