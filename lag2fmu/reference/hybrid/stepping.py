"""Smooth pieces between events: SciPy's steps, and the first root of the event functions on their dense output.

Event functions are positive while the modes last. Every step is looked at in POINTS places, so that two roots in a step
are not missed. It is halved where these places do not tell the functions, as those of a condition that turns many times
within one step. A function that starts within rounding of zero counts once it was positive, or when it is clearly
negative. A step that ends at the root ends the piece exactly there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from lag2fmu.errors import SimulationError
from lag2fmu.reference.hybrid.modes import Due
from lag2fmu.reference.hybrid.piece import Piece
from lag2fmu.reference.hybrid.roots import Function, bottom, dips, root
from lag2fmu.reference.hybrid.timed import first_descent
from lag2fmu.reference.state import Floats

Dense = Callable[[float], Floats]
Solver = Any
"""One of SciPy's solvers, which have no types."""

POINTS = 8
"""The intervals of a step at whose ends event functions are evaluated."""
BETWEEN = np.array([0.5, 2.5, 5.5, 7.5])
"""Where, in units of the distance of two places, a polynomial through the POINTS + 1 places is compared."""
RESOLVED = 1e-6
"""Relative to the greatest value of a function: the places tell the function if their polynomial differs by less."""
HALVINGS = 10
"""The most halvings of a step."""
TOUCHING = 1e5
"""In units of its rounding error: how far below 0 a gap may begin, where an event was found to the accuracy of a step.
If the bodies do not part behind it, as balls at rest, it comes to zero once it is below its beginning.
"""
SAME = 1e-12
"""Relative to the time: roots that are nearer to the first one are one event with it."""


def _weights() -> Floats:
    """The values at BETWEEN of the polynomials that are 1 at one of the places and 0 at all others, (places, 4)."""
    places = np.arange(POINTS + 1)
    others = [np.delete(places, k) for k in places]
    return np.array([np.prod((BETWEEN[:, None] - o) / (k - o), axis=1) for k, o in zip(places, others, strict=True)])


def _derivatives() -> Floats:
    """The slopes at the places of the polynomials that are 1 at one place and 0 at all others, (places, places).

    They are in units of the distance of two places. Source: Berrut, Trefethen, Barycentric Lagrange Interpolation, SIAM
    Review 2004, section 9.3.
    """
    places, unit = np.arange(POINTS + 1), np.eye(POINTS + 1)
    weights = 1 / np.prod(places[:, None] - places + unit, axis=1)
    found = (1 - unit) * weights[:, None] / weights / (places - places[:, None] + unit)
    return np.asarray(found - np.diag(found.sum(axis=0)))


_WEIGHTS, _DERIVATIVES = _weights(), _derivatives()


@dataclass
class Stepper:
    """Integrates pieces by SciPy's ``method``, by steps of at most ``longest`` (s), and ``most`` evaluations in all."""

    method: str
    rtol: float
    atol: Floats
    longest: float
    most: float
    evaluations: int = 0

    def run(
        self,
        piece: Piece,
        t: float,
        y: Floats,
        end: float,
        first: float | None,
        wanted: Callable[[Dense, float, float], None],
    ) -> tuple[float, Floats, Due]:
        """From ``t`` (s) and y (s,) to the first event or to ``end`` (s): time, y and what is due there.

        ``wanted`` is told each step's dense output with its two ends. Raises SimulationError with the time reached.
        """
        watch = Watch(piece, t, y)
        solver = self._solver(piece, t, y, end, first)
        while True:
            before, at = solver.t, solver.y.copy()
            failed = _stepped(solver)
            self._count(solver, piece)
            if failed is not None or solver.status == "failed":
                due = watch.nearly(before, at)
                if due:
                    return before, at, due
                raise SimulationError(f"{self.method} cannot go on; {failed}")
            dense = solver.dense_output()
            found = watch.first(dense, before, solver.t, at, solver.y)
            if found is None:
                wanted(dense, before, solver.t)
                piece_over = solver.status == "finished"
                if piece_over:
                    return end, solver.y.copy(), frozenset()
                piece.turn(solver.t, solver.y)
                continue
            time, due = found
            wanted(dense, before, time)
            return time, self._landed(piece, before, at, time), due

    def _solver(self, piece: Piece, t: float, y: Floats, end: float, first: float | None) -> Solver:
        from scipy.integrate import DOP853, Radau

        longest = max(min(self.longest, end - t), 16 * np.spacing(abs(end)))
        start = None if first is None or not 0 < first < longest else max(first, 1e-14 * max(1.0, abs(t)))
        if start is not None and start > end - t:
            start = None
        kind = {"DOP853": DOP853, "Radau": Radau}[self.method]
        return kind(piece.slope, t, y, end, rtol=self.rtol, atol=self.atol, max_step=longest, first_step=start)

    def _count(self, solver: Solver, piece: Piece) -> None:
        self.evaluations += solver.nfev - getattr(solver, "counted", 0)
        solver.counted = solver.nfev
        if self.evaluations > self.most:
            raise SimulationError(f"{self.method} took {self.evaluations} evaluations")

    def _landed(self, piece: Piece, t: float, y: Floats, end: float) -> Floats:
        """y (s,) at ``end`` (s), by steps that end exactly there; raises SimulationError if that fails."""
        if end <= t:
            return y
        solver = self._solver(piece, t, y, end, end - t)
        while solver.status == "running":
            _stepped(solver)
        self.evaluations += solver.nfev
        if solver.status == "failed":
            raise SimulationError(f"{self.method} cannot reach the event at {end!r} s")
        return np.array(solver.y)


def _stepped(solver: Solver) -> str | None:
    """Makes a step of ``solver``; why it cannot, as where SciPy finds no finite Jacobian matrix."""
    try:
        with np.errstate(all="ignore"):  # a step to values that are not finite is repeated with a shorter one
            reason: str | None = solver.step()
    except ValueError as error:
        solver.status, reason = "failed", str(error)
    return reason


class Watch:
    """Looks for the first down-crossing of the event functions of a ``piece`` that starts at (t, y)."""

    def __init__(self, piece: Piece, t: float, y: Floats) -> None:
        self.piece, self.floors = piece, piece.floors(t, y)
        start = piece.events(np.array([t]), y[None])[:, 0]
        gaps = np.array([label[0] == "gap" for label in piece.labels], dtype=bool)
        touching = gaps & (start < 0) & (-start < TOUCHING * self.floors)
        self.floors[touching] = np.maximum(self.floors, -start)[touching]
        self.last: tuple[float, Floats] | None = None  # the time (s) looked at last, and the event functions there
        self.armed = start > self.floors
        self.known: dict[float, Floats] = {}  # the event functions at times (s) within the step

    def first(self, dense: Dense, a: float, b: float, ya: Floats, yb: Floats) -> tuple[float, Due] | None:
        """The time (s) of the first event in (a, b], y there being ``yb`` (s,), and what is due; None without one."""
        if not len(self.floors):
            return None
        roots, self.known = self._timed_roots(a, b, ya), {}
        found = self._first(dense, (a, b), (ya, yb), HALVINGS)
        at = min([*roots.values(), *([found[0]] if found else [])], default=None)
        if at is None:
            return None
        last = at + SAME * max(1.0, abs(at))
        timed = frozenset(label for label, root in roots.items() if root <= last)
        return at, timed | (found[1] if found and found[0] <= last else frozenset())

    def _timed_roots(self, a: float, b: float, y: Floats) -> dict[tuple[str, int], float]:
        """{label: time (s) of its first descent in (a, b]} of the functions of the time alone; y (s,) is any."""
        roots = {}
        for i in self.piece.timed:
            function = partial(self.piece.margin_of_time, i, y=y)
            time = first_descent(function, a, b, float(self.floors[i]), bool(self.armed[i]))
            if time is not None:
                roots[self.piece.labels[i]] = time
        return roots

    def _first(
        self, dense: Dense, ends: tuple[float, float], there: tuple[Floats, Floats], halvings: int
    ) -> tuple[float, Due] | None:
        """As ``first``, between two ``ends`` (s) with the states ``there``, (s,) each."""
        (a, b), (ya, yb) = ends, there
        times = a + (b - a) * np.arange(0, POINTS + 1) / POINTS
        times[-1] = b
        y = np.stack([ya, *(dense(t) for t in times[1:-1]), yb])
        values = self._values(times, y)
        if halvings > 0 and not self._resolved(dense, times, values):
            middle, half = float(times[POINTS // 2]), y[POINTS // 2]
            first = self._first(dense, (a, middle), (ya, half), halvings - 1)
            return first or self._first(dense, (middle, b), (half, yb), halvings - 1)
        others, dip = sorted(set(range(len(values))) - {*self.piece.timed}), dips(values, values @ _DERIVATIVES)
        for j in range(1, len(times)):
            roots: dict[tuple[str, int], float] = {}
            for i in others:
                so_far = min(roots.values(), default=None)
                time = self._root(i, dense, times, values[i], j, dip[i, j - 1], so_far)
                if time is not None:
                    roots[self.piece.labels[i]] = time
            if roots:
                at = min(roots.values())
                return at, frozenset(label for label, root in roots.items() if root <= at + SAME * max(1.0, abs(at)))
            self.armed |= values[:, j] > self.floors
        return None

    def _values(self, times: Floats, y: Floats) -> Floats:
        """The event functions at ``times`` (b,) and y (b, s), (count, b); where the last step ended they are known."""
        if self.last is not None and not self.piece.turning and self.last[0] == times[0]:
            values = np.column_stack([self.last[1], self.piece.events(times[1:], y[1:])])
        else:
            values = self.piece.events(times, y)
        self.last = float(times[-1]), values[:, -1]
        return values

    def _resolved(self, dense: Dense, times: Floats, values: Floats) -> bool:
        """Whether the ``values`` (count, places) at ``times`` (places,) tell those between, of what is without forces.

        The weights are those of Lagrange's interpolation.
        """
        between = times[0] + (times[-1] - times[0]) * BETWEEN / POINTS
        margins = self.piece.margins(between, np.stack([dense(t) for t in between]))
        known = values[: len(margins)]
        bound = np.maximum(RESOLVED * np.abs(known).max(axis=1), self.floors[: len(margins)])
        told = np.abs(known @ _WEIGHTS - margins).max(axis=1, initial=0.0) <= bound
        told[list(self.piece.timed)] = True
        return bool(told.all())

    def _root(
        self, i: int, dense: Dense, times: Floats, values: Floats, j: int, dip: bool, first: float | None
    ) -> float | None:
        """The root of function ``i`` between the places j - 1 and j of a step, if it comes down to zero there.

        In a ``dip`` it does so where its least value is not positive. Of a root behind the ``first`` one of others,
        (s), it is only told that there is one: it does not count.
        """
        value, left, right = partial(self._value, i, dense), float(times[j - 1]), float(times[j])
        if self.armed[i]:
            if values[j] <= 0:
                return root(value, left, right) if first is None else _root_beside(value, left, right, first)
            low = bottom(value, left, right) if dip else None
            return None if low is None else root(value, left, low)
        if values[j] >= -10 * self.floors[i]:
            return None
        for k in range(1, 40):  # after a rebound it may have been positive for a short while
            peak = left + (right - left) * 0.5**k
            if value(peak) > self.floors[i]:
                return root(value, peak, right)
        # where it was not, it is 0 as long as nothing shows: the time goes on, and accelerations tell the next modes
        sunk = partial(self._value, i, dense, rise=10 * self.floors[i])
        return root(sunk, left, right)

    def _value(self, i: int, dense: Dense, t: float, rise: float = 0.0) -> float:
        if i < self.piece.plain:
            return float(self.piece.margins(np.array([t]), dense(t)[None])[i, 0]) + rise
        if t not in self.known:  # cones of one body come to their limits together
            self.known[t] = self.piece.events(np.array([t]), dense(t)[None])[:, 0]
        return float(self.known[t][i]) + rise

    def nearly(self, t: float, y: Floats) -> Due:
        """The kinks whose margins are almost zero at ``t`` (s) and y (s,); a formula may be undefined beyond them."""
        values = self.piece.events(np.array([t]), y[None])[:, 0]
        return frozenset(
            label
            for label, value in zip(self.piece.labels, values, strict=True)
            if label[0] == "side" and abs(value) <= 1e-9
        )


def _root_beside(value: Function, left: float, right: float, first: float) -> float:
    """The root (s) between two times of a function that falls, or ``right`` where it is behind the ``first`` one."""
    same = SAME * max(1.0, abs(first))
    if first + same < right and value(first + same) > 0:
        return right
    return first if first - same > left and value(first - same) > 0 else root(value, left, min(first + same, right))
