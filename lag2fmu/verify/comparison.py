"""Runs of the FMU and the direct integration side by side, as long as that means something.

Beyond the horizon two right runs may have nothing in common, see ``agreement``. There the run is compared in windows of
half the horizon's length. In a window the FMU starts from a state of the direct integration, and so does a second
direct integration, which finds how errors grow in the window. Mechanisms with contacts and dry friction have no
windows, because no start value gives their modes; such a run has to be comparable by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.agreement import CHAOS, LEFT_OUT, SAFETY, SHARPER, comparable, has_rows, horizon_of, on_grid
from lag2fmu.verify.report import Check
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu
from lag2fmu.verify.task import Floats, Task

Integration = Callable[[Floats, Mapping[str, float]], Reference]
"""A function (times in s, states at the first of them) -> the direct integration from there."""
MOST_WINDOWS = 20
"""The most windows. If they are further apart than they are long, they are a sample of the rest of the run."""


def own_error(task: Task, reference: Reference) -> float:
    """The largest error until the horizon, divided by its growth, that the direct integration estimates of itself."""
    weighed = reference.relative_error / reference.growth
    compared = comparable(task, reference) & (reference.trajectory.time <= horizon_of(task, reference))
    return float(weighed[compared].max(initial=0.0))


def compare(task: Task, label: str, run: Trajectory, reference: Reference) -> Check:
    """The check of the largest error of q, qd and further states until the horizon, divided by its growth.

    Errors are relative to the scales of ``reference``, which is (m, s).
    """
    rows = on_grid(reference, run.time)
    scales = np.array([reference.scales[name] for name in task.states])
    errors = np.abs(run.columns(task.states) - reference.trajectory.columns(task.states)[rows]) / scales
    weighed = errors.max(axis=1) / reference.growth[rows]
    compared = (run.time <= horizon_of(task, reference)) & comparable(task, reference)[rows]
    if not compared.any():
        return Check(label, 1.0, 0.0, "no time can be compared; take a sharper --tolerance")
    worst, column = np.unravel_index(np.argmax(errors[compared]), errors[compared].shape)
    return Check(
        label,
        float(weighed[compared].max()),
        SAFETY * task.tolerance,
        f"largest error {errors[compared][worst, column]:.1e} of {task.states[column]} "
        f"at t = {run.time[compared][worst]:.3g} s",
    )


# ------------------------------------------------------------------------------------------------------------ windows


@dataclass(frozen=True)
class Windows:
    """The comparisons in windows: the ``worst`` of them, their number, and the time (s) that they cover in all."""

    worst: Check | None = None
    count: int = 0
    covered: float = 0.0


def windows_after(task: Task, reference: Reference, integrated: Integration) -> Windows:
    """The windows of the run beyond the horizon, in co-simulation with the middle communication step.

    ``integrated`` makes their direct integrations, from states of the ``reference``.
    """
    step, horizon = task.steps[1], horizon_of(task, reference)
    grid = task.grid(step)
    first = int(np.searchsorted(grid, horizon * (1 + 1e-9), side="right")) - 1
    if has_rows(task.mechanism) or first + 1 >= len(grid):
        return Windows()
    length = max(1, first // 2)
    count = min(MOST_WINDOWS, math.ceil((len(grid) - 1 - first) / length))
    begins = np.unique(np.linspace(first, max(first, len(grid) - 1 - length), count).astype(int))
    label = f"co-simulation in windows, step {step:.3g} s"
    found: list[tuple[Check, float]] = []
    for begin in begins:
        starts = _states_at(task, reference, float(grid[begin]))
        if starts is not None:
            direct = integrated(grid[begin : begin + length + 1], starts)
            found += _window(task, label, starts, replace(direct, scales=reference.scales))
    checks = [check for check, _ in found]
    worst = max(checks, key=lambda check: (not check.passed, check.value), default=None)
    covered = min(sum(time for _, time in found), task.stop_time - horizon)
    return Windows(worst, len(found), covered)


def _states_at(task: Task, reference: Reference, time: float) -> dict[str, float] | None:
    """The states at ``time`` (s); None where they lie beyond the bounds of start values."""
    row = int(np.searchsorted(reference.trajectory.time, time - 1e-9 * task.stop_time))
    found = {name: float(reference.trajectory[name][row]) for name in task.states}
    for c in task.mechanism.coordinates:
        if not (c.minimum is None or c.minimum <= found[c.name]) or not (
            c.maximum is None or found[c.name] <= c.maximum
        ):
            return None
    return found


def _window(task: Task, label: str, starts: Mapping[str, float], direct: Reference) -> Iterator[tuple[Check, float]]:
    """The comparison with ``direct`` and the time (s) it covers; none where errors grow too much in the first step."""
    times = direct.trajectory.time
    horizon = horizon_of(task, direct)
    if horizon > times[0]:
        options = Run(
            start_time=float(times[0]),
            stop_time=float(times[-1]),
            step=task.steps[1],
            tolerance=task.tolerance,
            values={name: starts[name] for name in task.settable},
            inputs=task.inputs,
            hold=task.hold,
            outputs=task.states,
        )
        yield compare(task, label, simulate_fmu(task.path, options), direct), horizon - float(times[0])


def extent_check(task: Task, reference: Reference, windows: Windows | None = None) -> Iterator[Check]:
    """Checks that enough of the trajectories was compared, and that the windows agree."""
    windows = windows or Windows()
    if windows.worst is not None:
        yield windows.worst
    horizon = horizon_of(task, reference)
    left_out = 1 - (horizon + windows.covered) / task.stop_time
    if left_out > LEFT_OUT and not has_rows(task.mechanism):
        detail = (
            f"the comparison ends at t = {horizon:.3g} s, where errors have grown beyond "
            f"{CHAOS / SAFETY / task.tolerance:.1g} times at tolerance {task.tolerance:g}; {SHARPER}"
        )
        yield Check("trajectories, share not compared", left_out, LEFT_OUT, detail, extent=True)


def extent_note(task: Task, reference: Reference, windows: Windows) -> str:
    """A sentence on which part of the run was compared; empty if all of it was."""
    horizon = horizon_of(task, reference)
    if horizon >= task.stop_time * (1 - 1e-9):
        return ""
    longer = [f"{step:.3g} s" for step in task.steps if step > horizon * (1 + 1e-9)]
    beyond = f", and runs with a communication step of {' or '.join(longer)} not at all" if longer else ""
    most = CHAOS / SAFETY / task.tolerance
    note = f"Errors may grow over {most:.3g} times: trajectories are compared until t = {horizon:.4g} s only{beyond}"
    if not windows.count:
        return f"{note}."
    share = (horizon + windows.covered) / task.stop_time
    return (
        f"{note}; from there on in {windows.count} windows that start from the direct integration, {share:.0%} of the "
        "run in all."
    )
