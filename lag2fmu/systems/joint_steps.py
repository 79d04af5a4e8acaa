"""Communication steps of FMUs that ideal joints hold together.

Within a step the forces of all joints are quadratic in time. Their values at the two Gauss points of the step are such
that all joints are closed at its end, in positions and velocities: as many conditions as unknowns. The step is repeated
until that is so. Their second derivative is that of the cubic through these values and those of the last step. What
they miss of the true forces is then orthogonal to linear functions of time, whatever the second derivative is, as far
as the mechanism does not change within the step.

The repetitions are Newton's method. Its matrix is what an impulse at the joints does to their speeds; it is measured by
steps that are taken back. Sources: B. Schweizer, P. Li, D. Lu, Stabilized index-2 co-simulation approach for solver
coupling with algebraic constraints, Multibody System Dynamics 34 (2015), for the conditions; E. Hairer, C. Lubich,
G. Wanner, Geometric Numerical Integration, section II.1.2, for the Gauss points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from lag2fmu.errors import SimulationError
from lag2fmu.systems.circuit import Circuit
from lag2fmu.systems.coupling import ClosedJoints, CouplingReport
from lag2fmu.systems.joint_newton import EARLY, GAUSS, LATE, Course, Learned, Passing, correction, wrenches_of
from lag2fmu.systems.joint_system import JointState, JointSystem, check_closed
from lag2fmu.systems.ledger import Ledger
from lag2fmu.systems.member import Member
from lag2fmu.systems.steps import FixedSteps, Outer
from lag2fmu.verify.run import Floats

_CLOSED = 1e-12
"""In units of the system's size: a joint is closed if its gap, and what its speed opens in a step, are less. It is 1e4
times the rounding of positions, and far less than what the FMUs' own tolerances let pass."""
_NEARLY = 3e-11
"""In units of the system's size: a joint may be open by it after the last run of a step; the next step closes it."""
_OPEN = 1e-6
"""The most that a joint may be open at the start, as a part of the system's size: the digits that users write."""
_ORDER = 4
"""The estimated error within a step goes with the fifth power of its length."""
_RUNS, _MOST_RUNS = 3, 12
"""The most runs of a step: where three do not close all joints, it is divided. At the start, and in the shortest steps,
as at an impact, there are more."""
_GROWTH = {1: 3.0, 2: 1.2}
"""{runs of a step: the most that the next one may be as a part of it}."""
_SHRINK = 0.8
"""The same after more runs where steps are divided: shorter ones close the joints in two runs, with less error."""
_SLOW = 0.3
"""The error after a repetition over the error before: where it is greater, Newton's matrix is measured anew."""
_ENOUGH = 2
"""It is also measured before a step where the last one took more runs, but not so often that it costs a run a step."""
_CLOSE_BY = 0.1
"""In units of the step that was asked for: where steps are shorter, the matrix is measured after each step that took
more runs. A pose is near then in which forces move little, and what tells them apart changes most of all."""
_FIRST = (0.25, 0.5)
"""The steps that tell the forces at the start, as parts of a step: four values of each force."""
_DIVIDED = 0.9
"""In units of the step that was asked for: a shorter step is a part of it, not one that rounding made shorter."""
_SHORT = 0.1
"""In units of the present step: a last step that is shorter does not tell how places go on."""
_STUCK = "give joints and starts that leave a way to go on there, or a --stop-time before"
"""What helps where the shortest steps do not close the joints."""
_HISTORY, _TERMS = 3, 5
"""The last steps whose forces are kept, two values from each; and the terms of the polynomial that fits these, with
which the forces of the next step begin."""


@dataclass(frozen=True)
class _Made:
    """A step of length ``h`` (s) that closes all joints.

    - ``forces`` (2, k) at the Gauss points, whose ``times`` (2,) are in s; ``terms`` (3, n): the wrenches and their
      derivatives at its begin.
    - ``course``: the joints within it; ``start``, ``end``: at its ends. ``runs``: how often it was run.
    """

    times: Floats
    h: float
    forces: Floats
    terms: Floats
    course: Course
    start: JointState
    end: JointState
    runs: int


class JoinedSteps(FixedSteps):
    """Steps that are repeated until all ``joints`` are closed.

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
        self._before_last: tuple[JointState, float] | None = None
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
                self._last, self._before_last = self._last and (self._last[0], 0.0), None
                made = self._closed(t, part * self._step, back)
                self._keep(made)
                back()
        self._past, self._last = self._past[-len(_FIRST) :], self._last and (self._last[0], 0.0)
        self._before_last = None
        self.runs, self._gap, self._most_astray = [], 0.0, 0.0
        self._arrive(t, made.terms[0])

    @property
    def order(self) -> int:
        """The order of the error within a step, of joints or of the inputs that connections drive."""
        return min(_ORDER, super().order) if self.circuit.inputs else _ORDER

    def make(self, t: float, h: float, *, last: bool) -> tuple[float, float]:
        """A step from ``t`` of length ``h`` (s), at whose end all joints are closed; ``last``: it is not repeated.

        Returns the greatest relative error of an input, and the way that places go astray within the step, as a part of
        the system's size; both are infinite where no forces close the joints. Raises SimulationError for these if it is
        the ``last`` one.
        """
        before = self.circuit.saved()
        with self.taken_back() as back:
            found = self._close(t, h, back, _MOST_RUNS if last else _RUNS)
        if isinstance(found, str):
            if last:
                raise SimulationError(f"{found}, even in the shortest steps; {_STUCK}")
            self._due = True
            return math.inf, math.inf
        self.growth = _GROWTH.get(found.runs, _SHRINK if h < _DIVIDED * self._step else 1.0)
        self._made = found
        expected = self.circuit.expected(h)
        self._arrive(t + h, found.terms[0] + h * found.terms[1] + h**2 / 2 * found.terms[2])
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
        self._last, self._before_last = (made.course, made.h), (made.start, made.h)
        self._past = [*self._past[1 - _HISTORY :], (made.times, made.forces)]
        changes = made.h < _CLOSE_BY * self._step
        self._due = made.runs > _ENOUGH and (changes or self._age >= self._joints.driven)
        self._gap = max(self._gap, float(np.abs(made.end.gap[self._joints.held]).max(initial=0.0)))
        self.runs.append(made.runs)

    def _astray(self, made: _Made) -> float:
        """How far places go within the step ``made`` by what quadratic forces miss, as a part of the system's size.

        The forces of this step and the last two have a third derivative f"'; a quadratic function misses f"' h^3/120 at
        the ends of the step. That pushes for the time h at most.
        """
        h, k = made.h, self._past[-2:]
        missed = _fitted(made.times.mean(), h, [*k, (made.times, made.forces)])[3] / 20
        middle = made.course.at(h / 2)
        pushed = self._joints.effect(made.end, middle.turned, middle.directions) @ missed * h**2
        return self._joints.open_by(pushed * self._joints.held, np.zeros(len(pushed)), h)

    def _closed(self, t: float, h: float, back: Callable[[], None]) -> _Made:
        """As ``_close``; raises SimulationError where no forces are found."""
        found = self._close(t, h, back, _MOST_RUNS)
        if isinstance(found, str):
            raise SimulationError(f"{found}; give a shorter --step, or starts from which the joints let it move")
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

    def _close(self, t: float, h: float, back: Callable[[], None], most: int) -> _Made | str:
        """Run a step from ``t`` of length ``h`` (s) with the forces that close all joints, ``most`` times at most.

        Returns the step, or what is wrong where no forces are found. ``back`` takes a run back.
        """
        if self._due or self._joints.redundant:
            self._measure(t, h)
        self._joints.foresee(t + h / 2)
        self._age += 1
        self._learned.begin()
        start, left = self._joints.state(), np.inf
        course, forces = self._ahead(start, h), self._expected(t, h) @ self._joints.shared.T
        for run in range(1, most + 1):
            passing = [course(c * h) for c in (EARLY, 0.5, LATE)]
            terms = wrenches_of([x.directions for x in passing], forces, self._bend(t, h, forces), h)
            self._joints.drive(terms)
            self._run(t, h)
            end = self._joints.state()
            made = self._course(start, end, h)
            course = made.at
            try:
                change, reached = correction(self._joints, self._learned, end, forces, passing[::2], made, h)
            except np.linalg.LinAlgError:  # what an FMU tells is no number, or nothing moves
                break
            miss = self._joints.open_by(reached[1] * h, reached[0], h)
            if miss <= (_CLOSED if run < most else _NEARLY):
                if self._contradict(end, h):
                    break
                return _Made(t + h * GAUSS, h, forces, terms, made, start, end, run)
            back()
            if run > 1 and miss > _SLOW * left:
                self._measure(t, h, anew=True)
            left, forces = miss, forces + change
        return f"at t = {t + h:g} s no forces close the joints: {self._joints.worst(end)}"

    def _measure(self, t: float, h: float, *, anew: bool = False) -> None:
        """Measure Newton's matrix at ``t`` (s); ``anew``: it is not what those before let expect."""
        self._joints.measure(t, h, anew=anew)
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
            member.step(t, h)

    def _expected(self, t: float, h: float) -> Floats:
        """The forces (2, k) at the Gauss points of the step from ``t``, by those of the last steps."""
        if not self._past:
            return np.zeros((2, len(self._joints.held)))
        terms = _fitted(t, h, self._past, _TERMS)
        found: Floats = GAUSS[:, None] ** np.arange(len(terms)) @ terms
        return found

    def _bend(self, t: float, h: float, forces: Floats) -> Floats:
        """The second derivative (k,) of the ``forces`` (2, k) of the step ``h`` (s) from ``t``, by the last step."""
        terms = _fitted(t + h / 2, h, [*self._past[-1:], (t + h * GAUSS, forces)])
        return self._joints.shared @ (2 * terms[2] / h**2) if self._past else np.zeros(len(terms[0]))

    def _course(self, start: JointState, end: JointState, h: float) -> Course:
        """The course of the step ``h`` (s) from ``start`` to ``end``, also by the state before the last step."""
        if self._before_last is None or self._before_last[1] < _SHORT * h:
            return Course([start, end], [0.0, h])
        return Course([self._before_last[0], start, end], [-self._before_last[1], 0.0, h])

    def _ahead(self, start: JointState, h: float) -> Callable[[float], Passing]:
        """The joints by the time in the step ``h`` (s) from ``start``, as far as the last step tells it."""
        if self._last is None:
            pairs = {"directions": "rates", "turned": "turning", "gap": "speed"}
            further = {name: getattr(start, name) + h * getattr(start, rate) for name, rate in pairs.items()}
            return Course([start, replace(start, **further)], [0.0, h]).at
        before, length = self._last
        return lambda time: before.at(length + time)


def _fitted(t: float, h: float, known: Sequence[tuple[Floats, Floats]], most: int = 4) -> Floats:
    """The coefficients (``most``, k) of the polynomial of (time - ``t``) / ``h`` that fits the ``known`` forces best.

    There are no more of them than times.
    """
    times, values = (np.concatenate(x) for x in zip(*known, strict=True))
    powers = ((times - t) / h)[:, None] ** np.arange(min(len(times), most))
    found: Floats = np.linalg.lstsq(powers, values, rcond=None)[0]
    return found
