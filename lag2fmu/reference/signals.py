"""The inputs of a mechanism during a run: numbers, expressions of time, callables, or a Trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np
import sympy as sp

from lag2fmu.description.names import acceleration, velocity
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.language.vocabulary import TIME, normal_form
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.functions import compiled
from lag2fmu.reference.state import Floats
from lag2fmu.reference.symbols import symbols_of
from lag2fmu.reference.trajectory import Trajectory

Signal: TypeAlias = float | sp.Expr | Callable[[float], float]


@dataclass(frozen=True, eq=False)
class Signals:
    """The inputs over time: ``at`` maps a time (s) to name -> SI value; ``breaks`` are times of kinks or jumps, in s.

    The integration is restarted at ``breaks``, so that they cost no accuracy.
    """

    at: Callable[[float], Mapping[str, float]]
    breaks: Floats

    def sampled(self, times: Floats) -> dict[str, Floats]:
        """The inputs at ``times`` (m,) in s: name -> (m,). Raises SimulationError if other names come and go."""
        samples = [self.at(float(t)) for t in times]
        for t, sample in zip(times, samples, strict=True):
            if sample.keys() != samples[0].keys():
                raise SimulationError(
                    f"the inputs are {sorted(sample)} at time {float(t)!r} s and {sorted(samples[0])} at the start"
                )
        return {name: np.array([sample[name] for sample in samples], dtype=float) for name in samples[0]}


Inputs: TypeAlias = Mapping[str, Signal] | Callable[[float], Mapping[str, float]] | Trajectory | Signals


def signals_of(mechanism: Mechanism, inputs: Inputs | None, start: float) -> Signals:
    """The signals that ``inputs`` describe, one of

    - a mapping name -> number, SymPy expression in t, or callable t -> number. For a motion input an expression is
      differentiated; a callable must be accompanied by NAME_dot and NAME_ddot; a number is a support at rest;
    - a callable t -> {name: value}, with NAME, NAME_dot and NAME_ddot for every motion input it moves;
    - Signals, from ``held`` for instance;
    - a Trajectory, linear between its times and constant beyond its ends, with the same three columns.

    Derivatives that are given must be those of the motion, for the equations use them unchecked. Names are those of
    inputs and Q_<coordinate>; values are in SI units. ``start`` (s) is the time at which the inputs are tried. Raises
    LoadError for unknown names and missing derivatives, SimulationError for values that are not finite.
    """
    if inputs is None:
        return Signals(lambda t: {}, np.empty(0))
    if isinstance(inputs, Signals):
        signals = inputs
    elif isinstance(inputs, Trajectory):
        signals = _of_trajectory(inputs)
    elif isinstance(inputs, Mapping):
        signals = _of_mapping(mechanism, inputs)
    else:
        signals = Signals(inputs, np.asarray(getattr(inputs, "breaks", ()), dtype=float))
    first = signals.at(start)
    _check_names(mechanism, set(first), numbers=_numbers(inputs))
    for name, value in first.items():
        if not np.isfinite(value):
            raise SimulationError(f"input '{name}' is {value!r} at time {start!r} s; give a finite value")
    return signals


@dataclass(frozen=True, eq=False)
class Pieces:
    """The inputs ``names`` (k,) as polynomials of third degree between ``breaks`` (b + 1,) in s, constant beyond them.

    At breaks[i] + s they are the sums over j of coefficients[j, i] s^j; ``coefficients`` is (4, b, k), in SI units.
    """

    names: tuple[str, ...]
    breaks: Floats
    coefficients: Floats

    def derivatives(self, t: float, slack: float = 0.0) -> Floats:
        """Values and the first three derivatives just after t (s), (4, k); a break within ``slack`` (s) is passed."""
        i, s, between = self._place(t, slack)
        a, b, c, d = self.coefficients[:, i]
        found: Floats = np.stack([a + s * (b + s * (c + s * d)), b + s * (2 * c + 3 * s * d), 2 * c + 6 * s * d, 6 * d])
        return found if between else found * np.array([[1.0], [0.0], [0.0], [0.0]])

    def values(self, t: float) -> list[float]:
        """The values at t (s), (k,), in SI units; it takes a tenth of the time of ``derivatives``."""
        i, s, _ = self._place(t)
        return [a + s * (b + s * (c + s * d)) for a, b, c, d in self._piece(i)]

    def _place(self, t: float, slack: float = 0.0) -> tuple[int, float, bool]:
        """The piece that holds at t (s), the time since its beginning (s), and whether t lies between the ends."""
        last = len(self.breaks) - 2
        i = int(self.breaks.searchsorted(t + slack, side="right")) - 1
        if i < 0:
            return 0, 0.0, False
        if i > last:
            return last, float(self.breaks[-1] - self.breaks[last]), False
        return i, t - float(self.breaks[i]), True

    @cached_property
    def _piece(self) -> Callable[[int], list[list[float]]]:
        """A function that gives the coefficients of a piece as numbers, (k, 4), and keeps the last one."""
        return lru_cache(maxsize=4)(lambda i: self.coefficients[:, i].T.tolist())

    @property
    def signals(self) -> Signals:
        """The inputs in the form that a direct integration takes."""

        def at(t: float) -> dict[str, float]:
            return dict(zip(self.names, self.values(t), strict=True))

        return Signals(at, self.breaks)


def interpolated(inputs: Trajectory, motions: Sequence[str], stop_time: float) -> Pieces:
    """``inputs`` from 0 to ``stop_time`` (s): linear between their times, constant beyond their ends.

    A motion among ``motions`` whose two derivatives are not given gets them by a cubic spline, whose second derivative
    is continuous. Raises LoadError where there is no signal, where one derivative is given without the other, or where
    a position alone ends before the stop time. Source: C. de Boor, A Practical Guide to Splines, chapter IV
    (not-a-knot).
    """
    if not inputs.names:
        raise LoadError("the inputs have no signal beside the time; give a column for each input that is to move")
    inside = inputs.time[(inputs.time > 0) & (inputs.time < stop_time)]
    breaks = np.concatenate([[0.0], inside, [stop_time]])
    length = np.diff(breaks)
    names, columns = [], []
    for name in inputs.names:
        rates = (velocity(name), acceleration(name))
        if name in motions and not any(rate in inputs for rate in rates) and np.ptp(inputs[name]) > 0:
            names += [name, *rates]
            columns += _spline(inputs, name, breaks)
        else:
            x = np.interp(breaks, inputs.time, inputs[name])
            names.append(name)
            columns.append(np.stack([x[:-1], np.diff(x) / length, 0 * length, 0 * length]))
    _check_rates(names, motions, {name for name in inputs.names if np.ptp(inputs[name]) == 0})
    return Pieces(tuple(names), breaks, np.stack(columns, axis=-1))


def _spline(inputs: Trajectory, name: str, breaks: Floats) -> list[Floats]:
    """The coefficients (4, b) of a motion and its two derivatives between ``breaks`` (b + 1,)."""
    from scipy.interpolate import CubicSpline

    slack = 1e-9 * breaks[-1]
    if inputs.time[0] > slack or inputs.time[-1] < breaks[-1] - slack or len(inputs) < 4:
        raise LoadError(
            f"the motion '{name}' is given by position alone, at {len(inputs)} times from {inputs.time[0]:g} s to "
            f"{inputs.time[-1]:g} s; for its derivatives it must be known at 4 times or more from 0 to the stop time, "
            f"{breaks[-1]:g} s, or give {velocity(name)} and {acceleration(name)} too"
        )
    spline, at = CubicSpline(inputs.time, inputs[name]), breaks[:-1]
    y, y1, y2, y3 = spline(at), spline(at, 1), spline(at, 2), spline((at + breaks[1:]) / 2, 3)
    zero = np.zeros_like(y)
    return [np.stack(rows) for rows in ((y, y1, y2 / 2, y3 / 6), (y1, y2, y3 / 2, zero), (y2, y3, zero, zero))]


def _check_rates(given: Sequence[str], motions: Sequence[str], resting: set[str]) -> None:
    for name in motions:
        triple = (name, velocity(name), acceleration(name))
        found = [x for x in triple if x in given]
        if found and len(found) < len(triple) and not (found == [name] and name in resting):
            missing = ", ".join(x for x in triple if x not in given)
            raise LoadError(
                f"the inputs give {', '.join(found)} but not {missing}; a motion input needs all three columns, or its "
                "position alone"
            )


def held(trajectory: Trajectory, motions: Sequence[str] = ()) -> Signals:
    """``trajectory`` as an importer holds it between communication points: constant from each of its times on.

    One of ``motions`` is continued by its velocity and acceleration, as in an FMU. Before the first time the first
    values hold. All times (s) are breaks.
    """
    last = len(trajectory) - 1

    def at(t: float) -> dict[str, float]:
        row = min(max(int(np.searchsorted(trajectory.time, t, side="right")) - 1, 0), last)
        values = dict(zip(trajectory.names, trajectory.values[row].tolist(), strict=True))
        s = max(t - float(trajectory.time[row]), 0.0)
        for name in motions:
            rate, rate_of_rate = values.get(velocity(name), 0.0), values.get(acceleration(name), 0.0)
            if name in values:
                values[name] += s * (rate + s / 2 * rate_of_rate)
            if velocity(name) in values:
                values[velocity(name)] += s * rate_of_rate
        return values

    return Signals(at, trajectory.time)


def _of_trajectory(trajectory: Trajectory) -> Signals:
    columns = dict(zip(trajectory.names, trajectory.values.T, strict=True))
    return Signals(
        lambda t: {name: float(np.interp(t, trajectory.time, x)) for name, x in columns.items()}, trajectory.time
    )


def _of_mapping(mechanism: Mechanism, inputs: Mapping[str, Signal]) -> Signals:
    numbers = {name: float(x) for name, x in inputs.items() if isinstance(x, (int, float))}
    callables = {name: x for name, x in inputs.items() if callable(x) and not isinstance(x, sp.Basic)}
    expressions: dict[str, sp.Expr] = {}
    motions = {u.name for u in mechanism.motions}
    for name, signal in inputs.items():
        if name in numbers or name in callables:
            continue
        expression = normal_form(signal, f"input '{name}'")
        if expression.free_symbols - {TIME}:
            raise LoadError(f"input '{name}': '{expression}' may depend on t only")
        expressions[name] = expression
        if name in motions:
            expressions[velocity(name)] = expression.diff(TIME)
            expressions[acceleration(name)] = expression.diff(TIME, 2)
    function = compiled([TIME], list(expressions.values()))

    def at(t: float) -> dict[str, float]:
        written = function(np.array([[t]]), ())[:, 0].tolist() if expressions else ()
        called = {name: float(f(t)) for name, f in callables.items()}
        return {**numbers, **dict(zip(expressions, written, strict=True)), **called}

    return Signals(at, np.empty(0))


def _numbers(inputs: Inputs) -> set[str]:
    """The names that stay constant: a motion among them needs no derivatives."""
    if isinstance(inputs, Trajectory):
        return {name for name in inputs.names if np.ptp(inputs[name]) == 0}
    if isinstance(inputs, Mapping):
        return {name for name, x in inputs.items() if isinstance(x, (int, float))}
    return set()


def _check_names(mechanism: Mechanism, given: set[str], numbers: set[str]) -> None:
    known = [s.name for s in symbols_of(mechanism).signals]
    for name in sorted(given - set(known)):
        raise LoadError(f"mechanism '{mechanism.name}' has no input '{name}'; known are {', '.join(known)}")
    for motion in mechanism.motions:
        rates = {velocity(motion.name), acceleration(motion.name)}
        if given & {motion.name, *rates} and motion.name not in numbers and not {motion.name, *rates} <= given:
            lacking = sorted({motion.name, *rates} - given)
            raise LoadError(
                f"motion input '{motion.name}': {' and '.join(lacking)} missing; give the motion with its two "
                f"derivatives, or as an expression in t"
            )
