"""From one communication point to the next, in the solver's own steps.

Sources: [HNW] Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, sections II.1 and II.4;
[HW] Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2 (the PI controller), with the
constants of the code dopri5.f of the same authors. The same method, weights and constants as in a native FMU.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from operator import mul
from sys import float_info

from . import step_control as control
from .model import STATE, Model, Unsolvable, Vector
from .state import State

TOLERANCE, STEP, MAX_STEP = range(3)
"""The settings; 0 is automatic for each of them."""
DEFAULT_TOLERANCE = 1e-6
LEAST_TOLERANCE = 2e-15  # the least one that rounding allows
MOST_STEPS = 1e12  # the most steps of a fixed-step method in a communication step

Derivative = Callable[[float, Vector], list[float]]
"""dx/dt (2n + f,) at a time (s) and states (2n + f,); raises Unsolvable."""


@dataclass(frozen=True)
class _Trial:
    """The result of a trial step of ``length`` (s): time, states, their derivative, and error estimates (2n,)."""

    length: float
    end: float
    states: list[float]
    derivative: list[float]
    error: list[float]
    second: list[float]  # another estimate of lower order; empty if there is none


class Integrator:
    """Advances ``state`` with the method of ``model``."""

    def __init__(self, model: Model, state: State, derivative: Derivative) -> None:
        self.model, self.state, self.derivative = model, state, derivative
        self.nominal = [*model.nominal, *model.nominal, *model.nominal_further]
        tableau = model.tableau
        self.power = 1.0 + min(tableau.error_order, tableau.order)  # the error of a step is proportional to h^power

    def advance(self, end: float) -> None:
        """Integrate to exactly ``end`` (s); raises Unsolvable where a step cannot be done."""
        state = self.state
        if not state.first_stage:
            state.first_stage = self.derivative(state.time, state.states)
        if self.model.tableau.e:
            self._adaptively(end)
        else:
            self._in_equal_steps(end)
        state.time = end

    # ------------------------------------------------------------------------------------------------- step size

    @property
    def tolerance(self) -> float:
        """solver_tolerance if given, else that of the importer if given, else the default."""
        return self.state.settings[TOLERANCE] or self.state.tolerance or DEFAULT_TOLERANCE

    @property
    def longest(self) -> float:
        """solver_max_step, s; if not given a part of the experiment under error control, else infinite.

        The stages of longer steps could all miss what lasts for a short time only.
        """
        usual = control.LONGEST_PART * self._duration if self.model.tableau.e else math.inf
        return self.state.settings[MAX_STEP] or usual

    @property
    def _duration(self) -> float:
        """The duration (s) that the importer gave, if it did, else that of the default experiment."""
        span = self.state.stop_time - self.state.start_time
        return span if 0.0 < span < math.inf else self.model.default_duration

    def _adaptively(self, end: float) -> None:
        state, rejected = self.state, False
        state.next_step = state.next_step or state.settings[STEP] or self._first_step()
        while state.time < end:
            shortest = control.SHORTEST_ROUNDINGS * float_info.epsilon * max(abs(state.time), abs(end))
            state.next_step = max(state.next_step, shortest)
            length, next_time, cut_short = self._choose(end)
            try:
                trial = self._step(length, next_time)
                error, worst = self._size(trial)
                failure = self._inaccurate(length, error, worst) if not error <= 1.0 else None
            except Unsolvable as reason:
                error, failure = math.inf, reason
            if failure is None:
                self._propose(length, cut_short, error, rejected)
                self._accept(trial)
                rejected = False
                continue
            safety = self.model.tableau.safety
            measured = safety * error ** (-1.0 / self.power) if math.isfinite(error) else control.UNMEASURED_REDUCTION
            reduction = max(measured, control.LARGEST_REDUCTION)
            state.next_step, rejected = length * reduction, True
            if state.next_step < shortest:
                raise failure

    def _first_step(self) -> float:
        """The length of the very first step, s: [HNW], 'Starting step size'."""
        state = self.state
        d0, d1 = self._norm(state.states), self._norm(state.first_stage)
        h0 = (
            control.RESTING_PART * self._duration
            if d0 < control.RESTING or d1 < control.RESTING
            else control.FIRST_PART * d0 / d1
        )
        near = [x + h0 * dx for x, dx in zip(state.states, state.first_stage, strict=True)]
        try:
            there = self.derivative(state.time + h0, near)
        except Unsolvable:
            return control.FAILED_START * h0
        change = [(new - old) / h0 for new, old in zip(there, state.first_stage, strict=True)]
        largest = max(d1, self._norm(change))
        h1 = h0 if largest <= control.NO_CHANGE else (control.FIRST_PART / largest) ** (1.0 / self.power)
        return min(control.FIRST_GROWTH * h0, h1)

    def _norm(self, v: Vector) -> float:
        """The greatest |v_i| / weight_i, weights at the present point."""
        weights = (self.tolerance * (abs(x) + size) for x, size in zip(self.state.states, self.nominal, strict=True))
        return max((abs(entry) / weight for entry, weight in zip(v, weights, strict=True)), default=0.0)

    def _choose(self, end: float) -> tuple[float, float, bool]:
        """Length (s) and end (s) of the next trial step, and whether the communication point cut it short."""
        state = self.state
        remaining, proposed = end - state.time, min(state.next_step, self.longest)
        if remaining <= control.STRETCH * proposed and remaining <= control.MAX_STEP_SLACK * self.longest:
            return remaining, end, remaining < proposed
        next_time = state.time + proposed
        return next_time - state.time, next_time, False

    def _propose(self, length: float, cut_short: bool, error: float, after_rejection: bool) -> None:
        """The proposal after an accepted step, [HW]: h (1 / error)^alpha previous_error^beta, bounded.

        A step that was cut short says little and does not reduce the proposal.
        """
        state, beta = self.state, control.REMEMBERED_EXPONENT / self.power
        alpha = 1.0 / self.power - control.REMEMBERED_SHARE * beta
        factor = self.model.tableau.safety * state.previous_error**beta / error**alpha if error else math.inf
        factor = min(max(factor, control.LARGEST_REDUCTION), 1.0 if after_rejection else control.LARGEST_GROWTH)
        if cut_short:
            state.next_step = max(state.next_step, factor * length)
        else:
            state.next_step, state.previous_error = factor * length, max(error, control.SMALLEST_ERROR)

    def _in_equal_steps(self, end: float) -> None:
        """Integrate in the fewest equal steps that are not longer than solver_step; the times do not drift."""
        start = self.state.time
        longest = min(self.state.settings[STEP] or self.model.default_step, self.longest)
        whole = (end - start) * (1.0 - 1e-9) - 4.0 * math.ulp(end)  # less: H = 10 h takes 10 steps
        count = max(1.0, whole / longest)
        if not count <= MOST_STEPS:
            raise Unsolvable(
                f"from time {start:.17g} the communication step would take {count:.3g} solver steps; raise solver_step"
            )
        steps = math.ceil(count)
        for i in range(1, steps + 1):
            next_time = start + (end - start) * (i / steps) if i < steps else end
            self._accept(self._step((end - start) / steps, next_time))

    # ----------------------------------------------------------------------------------------------------- one step

    def _step(self, length: float, end: float) -> _Trial:
        """A trial step from the present point, [HNW] section II.1."""
        state, tableau = self.state, self.model.tableau
        stages, there = [state.first_stage], state.states
        for weights, c in zip(tableau.a[1:], tableau.c[1:], strict=True):
            there = self._combined(length, weights, stages)
            stages.append(self.derivative(end if c == 1.0 else state.time + c * length, there))
        if not tableau.first_same_as_last:
            there = self._combined(length, tableau.b, stages)
        for name, x in zip(self.model.of(STATE), there, strict=True):
            if not math.isfinite(x):
                raise Unsolvable(
                    f"at time {state.time:.17g} the state {name.name} grows beyond all bounds even in a solver step of "
                    f"{length:.3g} s; the motion ends here"
                )
        derivative = stages[-1] if tableau.first_same_as_last else self.derivative(end, there)
        errors = [
            [length * sum(map(mul, row, entries)) for entries in zip(*stages, strict=True)] if row else []
            for row in (tableau.e, tableau.second)
        ]
        return _Trial(length, end, there, derivative, *errors)

    def _combined(self, length: float, weights: Vector, stages: list[list[float]]) -> list[float]:
        """x + h sum_j weights_j k_j"""
        used = [(weight, stage) for weight, stage in zip(weights, stages, strict=True) if weight]
        sums = (sum(weight * stage[i] for weight, stage in used) for i in range(len(self.state.states)))
        return [x + length * total for x, total in zip(self.state.states, sums, strict=True)]

    def _size(self, trial: _Trial) -> tuple[float, int]:
        """The error in units of the tolerance and the worst state.

        [HNW] formula 4.10 with the maximum norm; two estimates are combined by formula 10.17.
        """
        weights = [
            self.tolerance * (max(abs(old), abs(new)) + size)
            for old, new, size in zip(self.state.states, trial.states, self.nominal, strict=True)
        ]
        ratios = [abs(error) / weight for error, weight in zip(trial.error, weights, strict=True)]
        ratios = [math.inf if math.isnan(ratio) else ratio for ratio in ratios]
        if not ratios:
            return 0.0, 0
        largest = max(ratios)
        worst = ratios.index(largest)
        if trial.second and 0.0 < largest < math.inf:
            second = max(abs(error) / weight for error, weight in zip(trial.second, weights, strict=True))
            largest *= largest / math.hypot(largest, 0.1 * second)
        return largest, worst

    def _inaccurate(self, length: float, error: float, worst: int) -> Unsolvable:
        return Unsolvable(
            f"at time {self.state.time:.17g} a solver step of {length:.3g} s still makes an error of {error:.3g} times "
            f"the tolerance in the state {self.model.of(STATE)[worst].name}; raise solver_tolerance unless the motion "
            "is singular here"
        )

    def _accept(self, trial: _Trial) -> None:
        """Make the result of a trial step the present point."""
        self.state.time, self.state.states, self.state.first_stage = trial.end, trial.states, trial.derivative
