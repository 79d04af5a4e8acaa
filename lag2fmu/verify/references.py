"""The direct integrations that a validation needs, within one budget of CPU time."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from lag2fmu.deadline import Budget, OutOfTimeError, check_time
from lag2fmu.errors import SimulationError
from lag2fmu.reference.direct_integration import integrate
from lag2fmu.reference.integrated import Reference
from lag2fmu.verify.agreement import has_rows
from lag2fmu.verify.comparison import most_growth
from lag2fmu.verify.task import Floats, Task

SHARE = 0.8
"""The part of the time, roughly, that the direct integration takes: for the progress that is shown."""


class References:
    """The direct integrations: one for all communication steps, or one for each where inputs are held during them."""

    def __init__(self, task: Task, progress: Callable[[float], None]) -> None:
        """``progress`` is told the share of the validation that is done."""
        self._task, self._progress = task, progress
        self._found: dict[float, Reference] = {}
        self._count = len(task.steps) if task.holds else 1
        self._rtol = max(1e-13, min(1e-10, 1e-3 * task.tolerance))
        self.budget = Budget(task.limit)

    def lacking(self) -> str:
        """A phrase on why there is nothing to compare with; "" where each integration gets over a middle step.

        Where the laws of contacts and dry friction judge alone, an integration that fails is no error.
        """
        task, middle = self._task, self._task.steps[1]
        slow = f"does not get to t = {middle:.3g} s in {task.limit:g} s of CPU time; give a longer --limit"
        try:
            references = [self.of(step) for step in task.steps]
        except OutOfTimeError:
            return slow
        except SimulationError as error:
            if not has_rows(task.mechanism):
                raise
            return f"fails ({error}): the laws along the run judge alone"
        reached = min(float(r.trajectory.time[-1]) for r in references)
        return "" if reached >= middle * (1 - 1e-9) else slow

    def of(self, step: float) -> Reference:
        """The direct integration for a communication ``step`` (s), until where it comes in its part of the time.

        Raises OutOfTimeError where its start is not settled in time.
        """
        task = self._task
        step = step if task.holds else task.steps[-1]
        if step not in self._found:
            done = len(self._found)

            def reached(share: float) -> None:
                self._progress(SHARE * (done + share) / self._count)

            grid, driving = task.grid(step), task.driving(step)
            with self.budget.spent(1 / (self._count - done)):
                self._found[step] = integrate(
                    task.mechanism,
                    grid,
                    inputs=driving,
                    rtol=self._rtol,
                    most_growth=most_growth(task),
                    low=task.tolerance,
                    progress=reached,
                )
        return self._found[step]

    def window(self, times: Floats, starts: Mapping[str, float]) -> Reference:
        """The direct integration at ``times`` (k,), in s, with the states ``starts`` {name: SI value} at the first.

        It ends where the time is over. Raises OutOfTimeError where that is at once.
        """
        task = self._task
        driving = task.driving(task.steps[1])
        with self.budget.spent():
            check_time()
            return integrate(
                task.mechanism, times, starts=starts, inputs=driving, rtol=self._rtol, whole=task.stop_time
            )
