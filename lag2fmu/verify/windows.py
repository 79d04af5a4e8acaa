"""Where a motion is chaotic at the tolerance: windows of it, in each of which both sides start from the same state.

Beyond the horizon of the comparison two right runs have nothing in common. So the rest of the run is looked at in
windows of half that length: the FMU starts from the state that the direct integration has there, and so does a direct
integration of the window, which knows how errors grow in it. Contacts and dry friction have modes that no start value
gives; there the run has to be comparable by itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lag2fmu.reference.integrate import integrate
from lag2fmu.reference.record import Reference
from lag2fmu.verify.comparison import CHAOS, SAFETY, compare, horizon_of
from lag2fmu.verify.hybrid import has_rows
from lag2fmu.verify.plan import Run
from lag2fmu.verify.report import Check
from lag2fmu.verify.simulate import simulate_fmu
from lag2fmu.verify.task import Task

MOST_WINDOWS = 20
"""Windows that are further apart than they are long make the comparison a sample of the rest of the run."""
FEWEST = 0.1
"""The least part of a run that has to be compared."""


@dataclass(frozen=True)
class Windows:
    """The comparisons in windows: ``worst`` of them, how many there are, and the time (s) they cover in all."""

    worst: Check | None = None
    count: int = 0
    covered: float = 0.0


def windows_after(task: Task, reference: Reference) -> Windows:
    """The windows of the run beyond the horizon, in co-simulation with the middle communication step."""
    step, horizon = task.steps[1], horizon_of(task, reference)
    grid = task.grid(step)
    first = int(np.searchsorted(grid, horizon * (1 + 1e-9), side="right")) - 1
    if has_rows(task.mechanism) or first + 1 >= len(grid):
        return Windows()
    length = max(1, first // 2)
    count = min(MOST_WINDOWS, math.ceil((len(grid) - 1 - first) / length))
    begins = np.unique(np.linspace(first, max(first, len(grid) - 1 - length), count).astype(int))
    label = f"co-simulation in windows, step {step:.3g} s"
    found = [window for begin in begins if (window := _window(task, reference, int(begin), length, label))]
    checks = [check for check, _ in found]
    worst = max(checks, key=lambda check: (not check.passed, check.value), default=None)
    covered = min(sum(time for _, time in found), task.stop_time - horizon)
    return Windows(worst, len(found), covered)


def _window(task: Task, reference: Reference, begin: int, length: int, label: str) -> tuple[Check, float] | None:
    """The comparison from grid point ``begin`` over ``length`` steps and the time (s) it covers.

    None where the state lies beyond the bounds of a start value, or where errors grow too much in the first step.
    """
    step = task.steps[1]
    grid = task.grid(step)[begin : begin + length + 1]
    row = int(np.searchsorted(reference.trajectory.time, grid[0] - 1e-9 * task.stop_time))
    starts = {name: float(reference.trajectory[name][row]) for name in task.states}
    if not all(
        (c.minimum is None or c.minimum <= starts[c.name]) and (c.maximum is None or starts[c.name] <= c.maximum)
        for c in task.mechanism.coordinates
    ):
        return None
    rtol = max(1e-13, min(1e-10, 1e-3 * task.tolerance))
    direct = integrate(task.mechanism, grid, starts=starts, inputs=task.driving(step), rtol=rtol)
    horizon = horizon_of(task, direct)
    if horizon <= grid[0]:
        return None
    options = Run(
        start_time=float(grid[0]),
        stop_time=float(grid[-1]),
        step=step,
        tolerance=task.tolerance,
        values={name: starts[name] for name in task.settable},
        inputs=task.inputs,
        hold=task.hold,
        outputs=task.states,
    )
    of_run = Reference(**{**vars(direct), "scales": reference.scales})
    return compare(task, label, simulate_fmu(task.path, options), of_run), horizon - float(grid[0])


def extent_check(task: Task, reference: Reference, windows: Windows | None = None) -> Iterator[Check]:
    """That trajectories were compared at all, for runs of which next to nothing was; and the windows."""
    windows = windows or Windows()
    if windows.worst is not None:
        yield windows.worst
    horizon = horizon_of(task, reference)
    compared = horizon + windows.covered
    if compared < FEWEST * task.stop_time:
        times = reference.trajectory.time
        early = float(reference.growth[times <= FEWEST * task.stop_time][-1])
        detail = (
            f"the comparison ends at t = {horizon:.3g} s: errors grow {early:.1e} times within {FEWEST:.0%} of the run,"
            f" beyond {CHAOS / SAFETY / task.tolerance:.1g} at tolerance {task.tolerance:g}; "
            "take a sharper --tolerance or a shorter --stop-time"
        )
        yield Check("trajectories, share not compared", 1 - compared / task.stop_time, 1 - FEWEST, detail)


def extent_note(task: Task, reference: Reference, windows: Windows) -> str:
    """A sentence on which part of the run was compared; empty if all of it was."""
    horizon = horizon_of(task, reference)
    if horizon >= task.stop_time * (1 - 1e-9):
        return ""
    longer = [f"{step:.3g} s" for step in task.steps if step > horizon * (1 + 1e-9)]
    beyond = f", and runs with a communication step of {' or '.join(longer)} not at all" if longer else ""
    note = f"Chaotic at this tolerance: trajectories are compared until t = {horizon:.4g} s only{beyond}"
    if not windows.count:
        return f"{note}."
    share = (horizon + windows.covered) / task.stop_time
    return (
        f"{note}; from there on in {windows.count} windows that start from the direct integration, {share:.0%} of the "
        "run in all."
    )
