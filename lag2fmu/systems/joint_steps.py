"""Communication steps of FMUs that ideal joints hold together.

Within a step the forces of all joints are linear in time. They are such that all joints are closed at its end, in
positions and velocities: as many conditions as unknowns. The step is repeated until that is so. The forces are told by
their values at the two Gauss points of the step; what they miss of the true forces is then orthogonal to linear
functions of time, as far as the mechanism does not change within the step.

The repetitions are Newton's method. Its matrix is what an impulse at the joints does to their speeds; it is measured by
steps that are taken back. Sources: B. Schweizer, P. Li, D. Lu, Stabilized index-2 co-simulation approach for solver
coupling with algebraic constraints, Multibody System Dynamics 34 (2015), for the conditions; E. Hairer, C. Lubich,
G. Wanner, Geometric Numerical Integration, section II.1.2, for the Gauss points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import cast

import numpy as np

from lag2fmu.errors import SimulationError
from lag2fmu.systems.circuit import Circuit
from lag2fmu.systems.coupling import ClosedJoints, CouplingReport
from lag2fmu.systems.joint_newton import EARLY, GAUSS, LATE, Course, Learned, correction, passing_of
from lag2fmu.systems.joint_system import JointState, JointSystem, check_closed
from lag2fmu.systems.ledger import Ledger
from lag2fmu.systems.member import Member
from lag2fmu.systems.steps import FixedSteps, Outer
from lag2fmu.verify.run import Floats

_CLOSED = 1e-12
"""A joint is closed if its gap, and what its speed opens in a step, is this part of the system's size: 1e4 times the
rounding of positions, and far less than what the FMUs' own tolerances let pass."""
_OPEN = 1e-6
"""The most that a joint may be open at the start, as a part of the system's size: the digits that users write."""
_ORDER = 3
"""The error within a step goes with the fourth power of its length."""
_REPETITIONS = 12
"""The most runs of one step. Two or three are enough where the motion is smooth; after an impact there are more."""
_SLOW = 0.3
"""Newton's matrix is measured anew where a repetition leaves more than this part of the error."""
_ENOUGH = 2
"""It is also measured before a step where the last one took more runs, but no more often than it costs a run a step."""
_FIRST = (0.5, 1.0)
"""The steps that tell the forces at the start, as parts of a step: four values of each force."""
_HISTORY, _TERMS = 3, 4
"""The forces of a step begin as the polynomial with so many terms that fits those of the last steps, two of each."""


@dataclass(frozen=True)
class _Made:
    """A step of length ``h`` (s) that closes all joints.

    - ``forces`` (2, k) at the Gauss points, whose ``times`` (2,) are in s; ``wrenches`` (n,) by the time (s) in it.
    - ``course``: the joints within it; ``end``: at its end. ``runs``: how often it was run.
    """

    times: Floats
    h: float
    forces: Floats
    wrenches: Callable[[float], Floats]
    course: Course
    end: JointState
    runs: int


class JoinedSteps(FixedSteps):
    """One step from each communication point to the next, repeated until all ``joints`` are closed.

    ``runs``: how often each step was run.
    """

    def __init__(
        self,
        members: Mapping[str, Member],
        circuit: Circuit,
        outer: Outer,
        joints: JointSystem,
        *,
        step: float,
        hold: bool,
    ) -> None:
        """``step`` (s) is about the length of all steps; ``outer`` and ``hold`` as for FixedSteps."""
        super().__init__(members, circuit, outer, Ledger(members, circuit.inputs, (), hold=hold), hold=hold)
        self._joints, self._step, self._due, self._age = joints, step, True, 0
        self._learned = Learned()
        self._past: list[tuple[Floats, Floats]] = []
        self._last: tuple[Course, float] | None = None
        self.runs: list[int] = []
        self._gap, self._most_astray, self._made = 0.0, 0.0, cast("_Made | None", None)

    def begin(self, t: float) -> None:
        """Bring inputs and forces of joints to what they are at ``t`` (s), the begin of the run.

        Steps that are taken back tell the forces. Raises SimulationError for joints that are open.
        """
        super().begin(t)
        check_closed(self._joints, t, _OPEN)
        with self.taken_back() as back:
            for part in _FIRST:
                self._last = self._last and (self._last[0], 0.0)
                made = self._closed(t, part * self._step, back)
                self._keep(made)
                back()
        self._past, self._last = self._past[-len(_FIRST) :], self._last and (self._last[0], 0.0)
        self.runs, self._gap, self._most_astray = [], 0.0, 0.0
        self._arrive(t, made.wrenches(0.0))

    @property
    def order(self) -> int:
        """The order of the error within a step: that of joints, or of the inputs that connections drive."""
        return min(_ORDER, super().order) if self.circuit.inputs else _ORDER

    def make(self, t: float, h: float, *, last: bool) -> tuple[float, float]:
        """A step from ``t`` of length ``h`` (s), at whose end all joints are closed; ``last``: it is not repeated.

        Returns the greatest relative error of an input, and the way that places go astray within the step, as a part of
        the system's size; both are infinite where no forces close the joints. Raises SimulationError for these if it is
        the ``last`` one.
        """
        before = self.circuit.saved()
        with self.taken_back() as back:
            found = self._close(t, h, back)
        if isinstance(found, SimulationError):
            if last:
                raise found
            return math.inf, math.inf
        self._made = found
        expected = self.circuit.expected(h)
        self._arrive(t + h, found.wrenches(h))
        self._before = before
        return self.circuit.missed(expected), self._astray(found)

    def accept(self, h: float, error: float, *, jumps: bool = False) -> None:
        """Count the step that was made last, of length ``h`` (s), whose inputs had a relative ``error``."""
        if self._made is not None:
            self._most_astray = max(self._most_astray, self._astray(self._made))
            self._keep(self._made)
            self._repeated += self._made.runs - 1
        super().accept(h, error, jumps=jumps)

    def _keep(self, made: _Made) -> None:
        """What the next step is told by the one that was ``made``."""
        self._last = made.course, made.h
        self._past = [*self._past[1 - _HISTORY :], (made.times, made.forces)]
        self._due = made.runs > _ENOUGH and self._age >= self._joints.driven
        self._gap = max(self._gap, float(np.abs(made.end.gap[self._joints.held]).max(initial=0.0)))
        self.runs.append(made.runs)

    def _astray(self, made: _Made) -> float:
        """How far places go within the step ``made`` by what linear forces miss, as a part of the system's size.

        The forces of this step and the last two have a second derivative f"; a linear function misses f" h^2/12 at the
        ends of the step. That pushes for the time h at most.
        """
        times, values = (np.concatenate(x) for x in zip(*self._past[-2:], (made.times, made.forces), strict=True))
        h = made.h
        powers = np.array([((times - made.times.mean()) / h) ** i for i in range(3)]).T
        missed = np.linalg.lstsq(powers, values, rcond=None)[0][2] / 6
        middle = made.course(h / 2)
        pushed = self._joints.effect(made.end, middle.turned, middle.directions) @ missed * h**2
        return self._joints.open_by(pushed * self._joints.held, np.zeros(len(pushed)), h)

    def _closed(self, t: float, h: float, back: Callable[[], None]) -> _Made:
        """As ``_close``; raises SimulationError where no forces are found."""
        found = self._close(t, h, back)
        if isinstance(found, SimulationError):
            raise found
        return found

    def facts(self, unjudged: tuple[str, ...]) -> CouplingReport:
        """Those of all steps, and how the joints were closed."""
        runs = self.runs or [0]
        return replace(
            super().facts(unjudged),
            joints=ClosedJoints(self._gap, self._most_astray, float(np.median(runs)), max(runs)),
        )

    def _arrive(self, t: float, wrenches: Floats) -> None:
        """Bring all inputs to what they are at ``t`` (s)."""
        self._joints.set(wrenches)
        super().begin(t)

    def _close(self, t: float, h: float, back: Callable[[], None]) -> _Made | SimulationError:
        """Run a step from ``t`` of length ``h`` (s) with the forces that close all joints.

        Returns the step, or what is wrong where no forces are found. ``back`` takes a run back.
        """
        if self._due or self._joints.redundant:
            self._measure(t, h)
        self._age += 1
        self._learned.begin()
        start, left = self._joints.state(), np.inf
        course, forces = self._ahead(start, h), self._expected(t, h) @ self._joints.shared.T
        for run in range(1, _REPETITIONS + 1):
            passing = [course(c * h) for c in GAUSS]
            wrenches = _linear([x.directions for x in passing], forces, h)
            self._joints.drive(wrenches(0.0), (wrenches(h) - wrenches(0.0)) / h)
            self._run(t, h)
            end = self._joints.state()
            course = partial(passing_of, start, end, h)
            try:
                passed = [course(c * h) for c in GAUSS]
                change, reached = correction(self._joints, self._learned, end, forces, passing, passed, h)
            except np.linalg.LinAlgError:  # what an FMU tells is no number, or nothing moves
                break
            miss = self._joints.open_by(reached[1] * h, reached[0], h)
            if miss <= _CLOSED:
                if self._contradict(end, h):
                    break
                return _Made(t + h * GAUSS, h, forces, wrenches, course, end, run)
            back()
            if run > 1 and miss > _SLOW * left:
                self._measure(t, h)
            left, forces = miss, forces + change
        return SimulationError(
            f"at t = {t + h:g} s no forces close the joints: {self._joints.worst(end)}; give a shorter --step"
        )

    def _measure(self, t: float, h: float) -> None:
        """Measure Newton's matrix at ``t`` (s)."""
        self._joints.measure(t, h)
        self._learned.forget()
        self._age = 0

    def _contradict(self, end: JointState, h: float) -> bool:
        """Whether the ``end`` leaves open what no force closes: joints that contradict each other."""
        held = self._joints.held
        return self._joints.open_by(end.gap * held, end.speed * held, h) > _OPEN

    def _run(self, t: float, h: float) -> None:
        if not self._hold:
            self.circuit.drive()
        for member in self._members.values():
            member.step(t, h, last=False)

    def _expected(self, t: float, h: float) -> Floats:
        """The forces (2, k) at the Gauss points of the step from ``t``, by those of the last steps."""
        if not self._past:
            return np.zeros((2, len(self._joints.held)))
        times = np.concatenate([times for times, _ in self._past])
        values = np.concatenate([values for _, values in self._past])
        powers = range(min(len(times), _TERMS))
        known, wanted = (np.array([((x - t) / h) ** i for i in powers]).T for x in (times, t + h * GAUSS))
        found: Floats = wanted @ np.linalg.lstsq(known, values, rcond=None)[0]
        return found

    def _ahead(self, start: JointState, h: float) -> Course:
        """The course of the step ``h`` (s) from ``start`` as far as the last step tells it."""
        if self._last is None:
            pairs = {"directions": "rates", "turned": "turning", "gap": "speed"}
            further = {name: getattr(start, name) + h * getattr(start, rate) for name, rate in pairs.items()}
            return partial(passing_of, start, replace(start, **further), h)
        before, length = self._last
        return lambda time: before(length + time)


def _linear(directions: Sequence[Floats], forces: Floats, h: float) -> Callable[[float], Floats]:
    """The wrenches on all places in a step ``h`` (s), linear in time.

    ``forces`` (2, k) and their ``directions`` (n, k) are those at the Gauss points.
    """
    early, late = (x @ force for x, force in zip(directions, forces, strict=True))
    slope = (late - early) / (h * (LATE - EARLY))
    return lambda time: early + slope * (time - h * EARLY)
