"""One initial value problem of a direct integration, solved by SciPy from break to break of the inputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lag2fmu.deadline import OutOfTimeError, check_time, seconds_left
from lag2fmu.errors import SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.composition import composition_of
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.lost_rows import LostRows
from lag2fmu.reference.native import native_terms
from lag2fmu.reference.signals import Signals
from lag2fmu.reference.single import CompiledLater
from lag2fmu.reference.state import Floats, StateBatch

PERTURBATION = 1e-8
"""In units of the states: how far a start is moved, to see how errors grow."""
PULL_BACK = 0.1
"""The part of the error of a constraint that is pulled back in a communication step."""
SCIPY_METHODS = ("DOP853", "Radau")
LONGEST_PART = 0.02
"""The longest step as a part of the run."""
MAX_EVALUATIONS, MAX_WITH_JUMPS = 500_000, 50_000
"""The evaluations of the equations in one run after which a method counts as failed, without and with jumps of forces;
with a bound in time and without jumps, after which another method is tried, too, see ``_comes_far``.
Stiff equations stall DOP853. Jumps stall every method if they hold the motion, as dry friction does."""


def prepare(mechanism: Mechanism) -> None:
    """Load and compile what a direct integration of ``mechanism`` needs.

    It is meant for a thread beside other work: most of the time is the compiler's.
    """
    import scipy.integrate  # noqa: F401

    native_terms(composition_of(mechanism))


class InitialValueProblem:
    """One problem: z = (q, qd, further states, work), (s + 1,), from ``start`` over ``times`` (m,)."""

    def __init__(self, equations: Equations, signals: Signals, times: Floats, start: Floats) -> None:
        self.equations, self.signals, self.times, self.n = equations, signals, times, equations.n
        self.start = start
        self.further = [state.name for state in equations.mechanism.states]
        self.size = 2 * self.n + len(self.further)  # s
        # the rate (1/s) that pulls the motion back onto the constraints, by the step of the experiment
        self.damping = PULL_BACK / equations.mechanism.experiment.step if equations.energies.constraints.m else 0.0
        nominal = np.array([c.nominal for c in equations.mechanism.coordinates])
        self.nominal = np.concatenate([nominal, nominal, [z.nominal for z in equations.mechanism.states]])
        self.evaluations, self.end, self._before_end = 0, np.inf, np.inf
        self._step: float | None = None  # s, the step that the method proposed at the last break, to go on with
        self.whole = float(times[-1] - times[0])  # s, the length of the whole run that this run is a part of
        self.last = float(times[0]), start
        self._rows = LostRows(equations.energies.constraints)
        self._compiled = CompiledLater(equations.energies, equations.scale, small=equations.small)
        self.progress: Callable[[float], None] | None = None
        self.jumps = equations.energies.composition.jumps
        self.most: float = MAX_WITH_JUMPS if self.jumps else MAX_EVALUATIONS
        self.turns: list[tuple[float, Floats]] = []  # (time in s, how much velocities (n,) changed) of each step
        self.share = 0.0  # the share of the work done before the present run; each run is half of all work
        self._granted = math.inf  # s, the CPU time for the present run
        self.reached = float(times[0])  # s, the greatest time that a method reached before it took too many evaluations

    def state(self, t: float, z: Floats) -> StateBatch:
        """The state at the time t (s) and z (copies, s + 1)."""
        inputs: dict[str, ArrayLike] = {**self._inputs(t), **self.further_of(z)}
        return self.equations.energies.state(t, z[:, : self.n], z[:, self.n : 2 * self.n], inputs)

    def further_of(self, z: Floats) -> dict[str, Floats]:
        """The further states by name, (m,) each, of z (m, s + 1)."""
        return dict(zip(self.further, z[:, 2 * self.n : self.size].T, strict=True))

    def _inputs(self, t: float) -> Mapping[str, float]:
        """{input: SI value} at t (s); an input that jumps keeps its value until the end of the segment."""
        return self.signals.at(min(t, self._before_end))

    def check_start(self) -> None:
        """Raise SimulationError if the mechanism cannot start: M is singular, or a value is not finite."""
        state = self.state(float(self.times[0]), self.start[None])
        qdd, _, power = self.equations.rates(state)
        if not (np.isfinite(qdd).all() and np.isfinite(power).all()):
            raise SimulationError(
                f"{self._place(self.times[0])}: no accelerations at the start, {self.equations.weakness(state)}"
            )
        reason = self.equations.weakness(state)
        if "singular" in reason:
            raise SimulationError(f"{self._place(self.times[0])}: {reason}")

    def perturbed(self, units: Floats) -> Floats:
        """The start moved by 1e-8 in the norm of the ``units`` (s,), along a direction without symmetry."""
        direction = np.cos(np.arange(1, self.size + 1))
        moved: Floats = self.start.copy()
        moved[: self.size] += PERTURBATION * units * direction / np.abs(direction).max(initial=1e-300)
        back: Floats = self.projected(self.times[:1], moved[None])[0]
        return back

    def projected(self, times: Floats, z: Floats) -> Floats:
        """z (m, s + 1) at ``times`` (m,), in s, moved onto the constraints; unchanged without constraints.

        Rows next to singular positions stay as they are, too.
        """
        if not self.equations.energies.constraints.m:
            return z
        n, energies = self.n, self.equations.energies
        at = [self.signals.at(float(t)) for t in times]
        inputs = {name: np.array([values[name] for values in at]) for name in at[0]} | self.further_of(z)
        state = energies.state(times, z[:, :n], z[:, n : 2 * n], inputs)
        firm = ~self._rows.near_at(self.equations.terms(state).mass_matrix, state)
        moved: Floats = z.copy()
        inputs = {name: values[firm] for name, values in inputs.items()}
        q, qd = energies.all_consistent(times[firm], z[firm, :n], z[firm, n : 2 * n], inputs)
        moved[firm, : 2 * n] = np.concatenate([q, qd], axis=1)
        return moved

    def solve(self, method: str, rtol: float, start: Floats, pieces: int) -> tuple[Floats, int]:
        """z at the times, (m, copies, s + 1), from ``start`` (copies, s + 1), and the evaluations it took.

        Where the time for the work (``deadline``) is over before, there are the rows that were reached, one at least.
        No step is longer than 1 / ``pieces`` of the way to the next break of the inputs, or of LONGEST_PART of the
        whole run. Otherwise a step could pass over a force that acts for a short time only. Raises SimulationError with
        the time reached. Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
        section II.5 (DOP853).
        """
        weights = np.append(self.nominal, self._energy_scale())
        atol = np.broadcast_to(rtol * weights, start.shape).ravel()
        first, last, self._granted = self.times[0], self.times[-1], seconds_left()
        breaks = self.signals.breaks
        ends = [*np.unique(breaks[(breaks > first) & (breaks < last)]), last]
        z, t, self.evaluations, self._step = start.ravel(), first, 0, None
        self.turns = [(float(first), np.zeros(self.n))]
        if self.equations.energies.constraints.m:
            self._look(first, start)
        found = [z[None]]
        for self.end in ends if last > first else ():
            inside = self.times[(self.times > t) & (self.times <= self.end)]
            asked = inside if len(inside) and inside[-1] == self.end else np.append(inside, self.end)
            # SciPy refuses steps below 10 units of rounding, and a break may be that close to an output time
            longest = min(self.end - t, LONGEST_PART * self.whole) / pieces
            longest = max(longest, 16 * np.spacing(abs(self.end)))
            self._before_end = math.nextafter(self.end, -math.inf)
            values = self._segment(method, (t, self.end), z, asked, rtol=rtol, atol=atol, max_step=longest)
            found.append(values[: len(inside)])
            if len(values) < len(asked):
                break
            z, t = values[-1], self.end
        return np.concatenate(found).reshape(-1, *start.shape), self.evaluations

    def _segment(
        self, method: str, span: tuple[float, float], z: Floats, asked: Floats, **options: float | Floats
    ) -> Floats:
        """z (b, size) at the b times ``asked``, in s, over a ``span`` without a break of the inputs inside.

        They are the first of these times where the time for the work is over before, or, with a bound in time, what
        the method may need.
        """
        import scipy.integrate

        first_step = None if self._step is None else min(self._step, span[1] - span[0])
        found: list[Floats] = []
        try:
            with np.errstate(all="ignore"):  # a step to values that are not finite is repeated with a shorter one
                solver = getattr(scipy.integrate, method)(
                    self._slope, span[0], z, span[1], first_step=first_step, **options
                )
                while solver.status == "running":
                    before = solver.y[self.n : 2 * self.n]
                    proposed, message = solver.h_abs, solver.step()
                    self.turns.append((solver.t, np.abs(solver.y[self.n : 2 * self.n] - before)))
                    if solver.status != "failed":
                        found += _passed(solver, asked)
                        self._put_back(solver)
        except OutOfTimeError:
            return np.reshape(found, (-1, len(z)))
        except _TooLongError as error:
            self.reached = max(self.reached, error.args[0])
            if not self.jumps and self._granted < math.inf:
                return np.reshape(found, (-1, len(z)))
            reason = f"{method} took {self.evaluations - 1} evaluations"
            remedy = "" if self.jumps else f", as many as one run may take; {self._shorter()}"
            raise SimulationError(f"{self._place(error.args[0])}: {reason}{remedy}") from None
        if solver.status == "failed":
            # steps have become tiny, so that the time of the last trial step is the time reached
            raise SimulationError(f"{self._place(self.last[0])}: {method} cannot go on; {self._reason(message)}")
        self._step = max(proposed, float(solver.h_abs))  # the last step was cut short by the end
        return np.stack(found)

    def _put_back(self, solver: Any) -> None:
        """Move the state of SciPy's ``solver`` onto the constraints after a step, where full steps can.

        Rounding takes it off them. Near singular positions little holds it, and that would decide on the motion. Where
        directions are lost it waits until the motion is farther off. Then forces of the constraints move it, as they
        would have done meanwhile.
        """
        n, constraints = self.n, self.equations.energies.constraints
        z = solver.y.reshape(-1, self.size + 1)
        if not constraints.m:
            return
        before = self._rows.near
        self._look(solver.t, z)
        if self._rows.near != before:
            solver.f = solver.fun(solver.t, solver.y)
        if self._rows.lost:
            return

        def moved(q: Floats, qd: Floats) -> Floats:
            return np.concatenate([q, qd, z[:, 2 * n :]], axis=1)

        parts = z[:, :n], z[:, n : 2 * n]
        q, qd, met = constraints.consistent_together(
            lambda q, qd: self.state(solver.t, moved(q, qd)), *parts, self.nominal[:n], self._rows.mobility
        )
        if met.all():
            solver.y = moved(q, qd).ravel()
            solver.f = solver.fun(solver.t, solver.y)

    def _look(self, t: float, z: Floats) -> None:
        """Have the constraints looked at, at t (s) and z (copies, s + 1)."""
        state = self.state(t, z)
        self._rows.look(self.equations.terms(state).mass_matrix, state)

    def _comes_far(self, t: float) -> bool:
        """Does the run, at t (s), come to half of its times before the time for it is over?

        Then it is as long as a fast vibration makes it, and not stalled by stiffness: it may need any evaluations.
        """
        granted, done = self._granted, (t - self.times[0]) / (self.times[-1] - self.times[0])
        if self.jumps or granted == math.inf or 2 * done * granted < granted - seconds_left():
            return False
        self.most = math.inf
        return True

    def _slope(self, t: float, z: Floats) -> Floats:
        """dz/dt, flat; NaN where there are no accelerations, which makes the method take a shorter step."""
        self.evaluations += 1
        if self.evaluations > self.most and not self._comes_far(t):
            raise _TooLongError(t)
        check_time()
        self.last = (t, z)
        if self.progress is not None and self.evaluations % 100 == 0:
            self.progress(self.share + 0.5 * (t - self.times[0]) / (self.times[-1] - self.times[0]))
        copies, n = z.reshape(-1, self.size + 1), self.n
        single, near = self._compiled.asked(), self._rows.near
        if single is None or near:
            state, solve = self.state(t, copies), self._rows.solve if near else None
            qdd, multipliers, power = self.equations.rates(state, self.damping, solve=solve)
            further = self.equations.energies.further(state, (qdd, multipliers))
            return np.concatenate([copies[:, n : 2 * n], qdd.T, further.T, power[:, None]], axis=1).ravel()
        inputs = self.equations.energies.input_values(self._inputs(t))
        slopes = np.empty_like(copies)
        slopes[:, :n] = copies[:, n : 2 * n]
        for copy, slope in zip(copies, slopes, strict=True):
            if self.further:
                self.equations.energies.with_states(inputs, copy[2 * n : self.size])
            qdd, multipliers, slope[self.size] = single.rates(t, copy, inputs, self.damping)
            slope[n : 2 * n] = qdd
            if self.further:
                state = StateBatch(np.asarray(t), copy[:n], copy[n : 2 * n], inputs)
                slope[2 * n : self.size] = self.equations.energies.further(state, (qdd, multipliers))
        return slopes.ravel()

    def _energy_scale(self) -> float:
        """An energy (J) to weigh the error of the work with: T at nominal velocities."""
        terms = self.equations.terms(self.state(float(self.times[0]), self.start[None]))
        scale = float(0.5 * np.abs(np.diagonal(terms.mass_matrix)[0] * self.nominal[: self.n] ** 2).sum())
        return scale if scale > 0 else 1.0

    def _reason(self, message: str) -> str:
        """Why the method stopped: what is wrong with the last state tried, or else SciPy's ``message``."""
        t, z = self.last
        state = self.state(t, z.reshape(-1, self.size + 1))
        if np.isfinite(self.equations.rates(state)[0]).all():
            return message
        return self.equations.weakness(state)

    def _shorter(self) -> str:
        """The remedy for a run that is too long: a shorter length, with a margin for the second integration."""
        within_reach = float(f"{0.8 * self.reached:.2g}")
        return f"give a shorter stop time, {within_reach:g} s is within reach"

    def _place(self, t: float) -> str:
        return f"mechanism '{self.equations.mechanism.name}' at time {float(t)!r} s"


def _passed(solver: Any, asked: Floats) -> list[Floats]:
    """z (size,) at those of the times ``asked`` that the last step of SciPy's ``solver`` has passed."""
    inside = asked[(asked > solver.t_old) & (asked < solver.t)]
    between = list(solver.dense_output()(inside).T) if len(inside) else []  # dense output takes further evaluations
    return [*between, solver.y] if solver.t in asked else between


class _TooLongError(Exception):
    """A method took more than MAX_EVALUATIONS evaluations; carries the time reached."""
