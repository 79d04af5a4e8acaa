"""Communication steps of a system: of one length, or as long as the error of the coupling allows.

That error is known for nothing: what an input was taken to be at the end of a step, by the derivatives at its
beginning, less what it then hears. The energy that the step has made in a bond is a second one. Where an error is too
large, all FMUs go back to the beginning and a shorter step is made.
Sources: M. Arnold, C. Clauss, T. Schierz, Error analysis and error estimates for co-simulation in FMI for Model
Exchange and Co-Simulation v2.0, Archive of Mechanical Engineering 60 (2013), section 5; of the energy see ``ledger``.

The components make a step side by side (Jacobi), or one after the other along their connections, so that each knows
where those before it have come to (Gauss and Seidel); or the step is repeated until no input misses what it hears
(waveform relaxation). Source: C. Gomes, C. Thule, D. Broman, P. G. Larsen, H. Vangheluwe, Co-simulation: a survey, ACM
Computing Surveys 51 (2018), section 4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from lag2fmu.systems.circuit import Circuit
from lag2fmu.systems.coupling import Coupling, CouplingReport
from lag2fmu.systems.ledger import Ledger
from lag2fmu.systems.member import Member, StepDiscardedError
from lag2fmu.verify.run import Floats

_SAFETY, _LEAST, _MOST = 0.9, 0.2, 3.0
"""The next step is shorter than the error asks for by the first factor, and no less and no more times the last one."""
_SHORTEST = 1e-4
"""The shortest step as a part of the longest one. Where an input jumps, no step is short enough."""
_ITERATED = 0.01
"""In units of the tolerance: iterated steps end when inputs miss less, because errors of many steps may add up."""
_ITERATIONS = 20
"""The most repetitions of a step. Each makes what is missed smaller by a factor that falls with its length."""

Outer = Callable[[float], Mapping[str, float]]
"""A function of time (s) that gives the values of the system's inputs."""


class FixedSteps:
    """One step from each communication point to the next; with ``hold`` all inputs keep their values within it.

    ``growth``: the most that the next step may be, as a part of the last one.
    """

    growth = _MOST

    def __init__(
        self,
        members: Mapping[str, Member],
        circuit: Circuit,
        outer: Outer,
        ledger: Ledger,
        *,
        hold: bool,
        coupling: Coupling = "jacobi",
    ) -> None:
        """``outer`` gives the inputs of the system, ``ledger`` keeps the energies of its bonds."""
        self._in_turn = coupling == "gauss-seidel"
        self._sequence = circuit.sequence if self._in_turn else list(members)
        self._members, self.circuit, self._outer, self._ledger = members, circuit, outer, ledger
        self._hold = hold
        self._steps = self._repeated = self._jumps = 0
        self._shortest, self._longest, self._error = math.inf, 0.0, 0.0
        self._before: list[Floats] = []

    def begin(self, t: float) -> None:
        """Bring all inputs to what they hear at ``t`` (s). Raises SimulationError where nothing agrees."""
        self.circuit.hear(self._outer(t))
        self.circuit.settle(t)

    def advance(self, t: float, end: float) -> None:
        """From ``t`` to the ``end`` (s), where all inputs are what they hear. Raises SimulationError."""
        missed, _ = self.make(t, end - t, last=True)
        self.accept(end - t, missed)

    def make(self, t: float, h: float, *, last: bool) -> tuple[float, float]:
        """A step from ``t`` of length ``h`` (s); ``last``: it is not repeated.

        Returns the greatest error of an input and of the energy in a bond, both relative. Raises SimulationError.
        """
        before = [] if self._hold else self.circuit.saved()
        if not self._hold:
            self._drive(h)
        self._ledger.open()
        for i, name in enumerate(self._sequence):
            ends = self.circuit.ends(name, self._sequence[:i]) if self._in_turn else {}
            if ends:
                self.circuit.lead(name, ends, h, hold=self._hold)
            self._members[name].step(t, h)
        self._ledger.close(h)
        expected = self.circuit.expected(h)
        self.begin(t + h)
        self._before = before
        return 0.0 if self.circuit.sampled else self.circuit.missed(expected), self._ledger.settled(h)

    def _drive(self, h: float) -> None:
        """Tell all inputs how they go on in the next step, of length ``h`` (s)."""
        self.circuit.drive()

    @contextmanager
    def taken_back(self) -> Iterator[Callable[[], None]]:
        """A context with a function that brings all components and inputs back to what they are at its begin."""
        before, states = self.circuit.saved(), [(member, member.save()) for member in self._members.values()]

        def back() -> None:
            for member, state in states:
                member.restore(state)
            self.circuit.restore(before)

        try:
            yield back
        finally:
            for member, state in states:
                member.forget(state)

    @property
    def order(self) -> int:
        """The order of the error within a step."""
        return self.circuit.order

    def reject(self) -> None:
        """Count a step that was taken back."""
        self._repeated += 1

    def accept(self, h: float, error: float, *, jumps: bool = False) -> None:
        """Count a step of length ``h`` (s), whose inputs had a relative ``error``; an input may have ``jumps``."""
        self._jumps += jumps
        self._ledger.accept()
        if self._before:
            self.circuit.passed(self._before, h)
        self._steps += 1
        self._shortest, self._longest = min(self._shortest, h), max(self._longest, h)
        self._error = max(self._error, error)

    def facts(self, unjudged: tuple[str, ...]) -> CouplingReport:
        """What the steps have come to; ``unjudged`` is what was not judged before."""
        return CouplingReport(
            self._steps,
            self._repeated,
            self._jumps,
            self._shortest if self._steps else 0.0,
            self._longest,
            None if self.circuit.sampled else self._error,
            self._ledger.bonds(),
            unjudged,
        )


class ControlledSteps:
    """``steps`` whose errors of coupling are within the relative ``tolerance``; none is longer than ``longest`` (s)."""

    def __init__(self, steps: FixedSteps, tolerance: float, longest: float) -> None:
        self._steps, self.circuit, self.begin, self.facts = steps, steps.circuit, steps.begin, steps.facts
        self._tolerance, self._limit, self._length = tolerance, longest, longest
        self._exponent = 1.0 / (steps.order + 1)

    def advance(self, t: float, end: float) -> None:
        """From ``t`` to the ``end`` (s) in as many steps as it takes. Raises SimulationError."""
        shortest = _SHORTEST * self._limit
        while t < end:
            parts = math.ceil((end - t) / self._length * (1 - 1e-9))
            h = (end - t) / parts
            error = self._try(t, h, shortest)
            wished = h * max(_SAFETY * error**-self._exponent, _LEAST) if error > 0 else math.inf
            self._length = min(max(wished, shortest), self._steps.growth * self._length, self._limit)
            if error <= 1.0 or h <= shortest:
                t = end if parts == 1 else t + h

    def _try(self, t: float, h: float, shortest: float) -> float:
        """The error of a step, in units of the tolerance; where it is too large, all is as before the step."""
        with self._steps.taken_back() as back:
            try:
                missed, made = self._steps.make(t, h, last=h <= shortest)
            except StepDiscardedError:
                if h <= shortest:
                    raise
                missed, made = math.inf, 0.0
            worst = max(missed, made)
            error = worst / self._tolerance if math.isfinite(worst) else math.inf
            if error > 1.0 and h > shortest:
                back()
                self._steps.reject()
            else:
                self._steps.accept(h, missed, jumps=error > 1.0)
        return error


class IteratedSteps(FixedSteps):
    """Steps that are repeated until all inputs come to what they hear at the end, well within the ``tolerance``."""

    def __init__(
        self, members: Mapping[str, Member], circuit: Circuit, outer: Outer, ledger: Ledger, tolerance: float
    ) -> None:
        """All ``members`` can go back to a state before."""
        super().__init__(members, circuit, outer, ledger, hold=False)
        self._tolerance = _ITERATED * tolerance
        self._goal: list[Floats] = []

    def advance(self, t: float, end: float) -> None:
        """From ``t`` to the ``end`` (s). Raises SimulationError."""
        h, self._goal = end - t, []
        with self.taken_back() as back:
            missed, _ = self.make(t, h, last=False)
            for _ in range(_ITERATIONS):
                if missed <= self._tolerance:
                    break
                self._goal = self.circuit.saved()
                back()
                self.make(t, h, last=False)
                missed = self.circuit.missed(self._goal)
                self._repeated += 1
            self.accept(h, missed)

    def _drive(self, h: float) -> None:
        """By what the run before has come to."""
        super()._drive(h)
        for name, goal in zip(self.circuit.inputs, self._goal, strict=False):
            self.circuit.lead(name, dict(enumerate(goal)), h, part=0.5)
