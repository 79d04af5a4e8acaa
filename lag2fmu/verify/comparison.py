"""Runs of the FMU and the direct integration side by side, as long as that means something.

Beyond the horizon two right runs may have nothing in common, see ``agreement``. A run at a sharper tolerance has a
later one. Where even that does not come to the end, the rest is compared in windows, one after the other. In a window
the FMU starts from a state of the direct integration, and so does a second direct integration, which finds how errors
grow in the window, and so how long it may be. Mechanisms with contacts and dry friction have no windows, because no
start value gives their modes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lag2fmu.deadline import OutOfTimeError
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.agreement import (
    CHAOS,
    LEFT_OUT,
    SAFETY,
    SHARPER,
    comparable,
    comparable_growth,
    has_rows,
    horizon_of,
    on_grid,
    out_of_time,
)
from lag2fmu.verify.report import Check
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu
from lag2fmu.verify.task import Floats, Task

Integration = Callable[[Floats, Mapping[str, float]], Reference]
"""A function (times in s, states at the first of them) -> the direct integration from there."""


LEAST_WINDOWS = 20
"""The least number of windows, roughly: a fault shows itself most where errors have not grown yet."""
SHARPEST = 1000.0
"""Beyond the horizon the FMU may have to be as many times as exact: the direct integration is exact enough for that."""
LEAST = 1e-10
"""The sharpest tolerance there: below it rounding adds up in long runs."""


_OWN = 0.1
"""The part of the bar that the error of the direct integration may take."""
_ROOM = 0.5
"""The part of what may be left out that a sharper tolerance aims at."""


def most_growth(task: Task) -> float:
    """The growth of errors up to which trajectories can be compared at any tolerance."""
    return comparable_growth(max(LEAST, task.tolerance / SHARPEST))


def own_check(task: Task, reference: Reference) -> Check:
    """The check of the largest error of the direct integration by its own estimate, divided by the growth of errors.

    It is the one until the horizon.
    """
    names = reference.error.names
    errors = reference.error.values / [reference.scales[name] for name in names]
    worst = float((errors / _growths(task, reference, names))[_compared(task, reference)].max(initial=0.0))
    detail = "of runs at two tolerances; growth taken out"
    return Check("direct integration, own error", worst, _OWN * SAFETY * task.tolerance, detail)


def compare(task: Task, label: str, run: Trajectory, reference: Reference) -> Check:
    """The check of the largest error of q, qd and further states until the horizon, divided by its growth.

    Errors are relative to the scales of ``reference``, which is (m, s).
    """
    rows = on_grid(reference, run.time)
    scales = np.array([reference.scales[name] for name in task.states])
    errors = np.abs(run.columns(task.states) - reference.trajectory.columns(task.states)[rows]) / scales
    weighed = (errors / _growths(task, reference, task.states)[rows]).max(axis=1)
    compared = _compared(task, reference)[rows]
    if not compared.any():
        return Check(label, 1.0, 0.0, "no time can be compared; take a sharper --tolerance", extent=True)
    worst, column = np.unravel_index(np.argmax(errors[compared]), errors[compared].shape)
    return Check(
        label,
        float(weighed[compared].max()),
        SAFETY * task.tolerance,
        f"largest error {errors[compared][worst, column]:.1e} of {task.states[column]} "
        f"at t = {run.time[compared][worst]:.3g} s",
    )


def _growths(task: Task, reference: Reference, names: Sequence[str]) -> Floats:
    """The growth of errors for each of the ``names`` (s,) of states, (m, s)."""
    return reference.growths(names, comparable_growth(task.tolerance))


def _compared(task: Task, reference: Reference) -> NDArray[np.bool_]:
    """The times of ``reference`` at which another run has to agree with it, (m,)."""
    return comparable(task, reference) & (reference.trajectory.time <= horizon_of(task, reference))


# ------------------------------------------------------------------------------------------------- beyond the horizon


@dataclass(frozen=True)
class Windows:
    """The comparisons in windows: the ``worst`` of them, their number, and the time (s) that they cover in all.

    A single one may be the run from its start at a sharper ``tolerance``, ``until`` a time (s).
    """

    worst: Check | None = None
    count: int = 0
    covered: float = 0.0
    until: float = 0.0
    tolerance: float | None = None

    def told(self, horizon: float) -> str:
        """A phrase on how the run is compared beyond the ``horizon`` (s), or nearer to events; "" if it is not."""
        if self.tolerance is not None:
            where = f"from there on until t = {self.until:.4g} s" if self.until > horizon else "nearer to events"
            return f"{where} at the tolerance {self.tolerance:.2g}"
        return f"from there on in {self.count} windows that start from the direct integration" if self.count else ""

    def with_another(self, check: Check, covered: float) -> Windows:
        """These and one more window with its ``check``, which has ``covered`` that time (s)."""
        worst = max(filter(None, (self.worst, check)), key=lambda check: check.value / check.bar)
        return Windows(worst, self.count + 1, self.covered + covered)


def beyond(task: Task, reference: Reference, integrated: Integration) -> Windows:
    """The comparisons beyond the horizon, and closer around events where these leave out too much of the run.

    They are made in co-simulation with the middle communication step. ``integrated`` makes direct integrations from
    states of the ``reference``.
    """
    end = float(reference.trajectory.time[-1]) * (1 - 1e-9)
    if task.solver_step or (horizon_of(task, reference) >= end and _between_events(task, reference) >= 1 - LEFT_OUT):
        return Windows()
    sharp = _sharp(task, reference)
    whole = horizon_of(sharp, reference) >= end
    found = _whole(task, sharp, reference) if whole or has_rows(task.mechanism) else Windows()
    return found if found.count else windows_after(task, reference, integrated)


def _sharp(task: Task, reference: Reference) -> Task:
    """The ``task`` at the tolerance that the growth of errors over the ``reference`` asks for, or at the sharpest."""
    sharpest = replace(task, tolerance=max(LEAST, task.tolerance / SHARPEST))
    enough = CHAOS / (SAFETY * float(reference.growth[-1])) * (1 - 1e-9)
    if has_rows(task.mechanism):  # those of accumulating impacts are as short as the square root of the tolerance
        left_out = max(1 - _between_events(task, reference), LEFT_OUT)
        enough = min(enough, task.tolerance * (_ROOM * LEFT_OUT / left_out) ** 2)
    own = own_check(sharpest, reference).value / (_OWN * SAFETY)
    return replace(task, tolerance=min(task.tolerance, max(sharpest.tolerance, enough, own)))


def _between_events(task: Task, reference: Reference) -> float:
    """The part of the ``reference`` at which another run has to agree with it as far as events go."""
    return float(np.mean(comparable(task, reference)))


def _whole(task: Task, sharp: Task, reference: Reference) -> Windows:
    """The comparison of the run from its start at the tolerance of the task ``sharp``, as far as that goes.

    There is none if the FMU is not exact enough and does the same at the tolerance of ``task``, as methods of fixed
    step do. Where communication steps are short, other methods do the same at both, too, and are exact enough.
    """
    step, stop = task.steps[1], horizon_of(sharp, reference)
    gained = float(np.mean(_compared(sharp, reference)) - np.mean(_compared(task, reference)))
    count = int(stop / step * (1 + 1e-9))
    if gained <= 0 or not count:
        return Windows()
    times = task.grid(step)[: count + 1]
    run = _run_of_window(sharp, {}, times)
    check = compare(sharp, f"co-simulation at tolerance {sharp.tolerance:.2g}, step {step:.3g} s", run, reference)
    if not check.passed and np.array_equal(run.values, _run_of_window(task, {}, times).values):
        return Windows()
    return Windows(check, 1, gained * float(reference.trajectory.time[-1]), float(times[-1]), sharp.tolerance)


def windows_after(task: Task, reference: Reference, integrated: Integration) -> Windows:
    """The windows of the run beyond the horizon, in co-simulation with the middle communication step.

    A window ends where errors have grown too much, and the next one begins there, or before if windows would be few.
    So it goes on while there is time for their direct integrations. ``integrated`` makes these, from states of the
    ``reference``.
    """
    windows, step, horizon = Windows(), task.steps[1], horizon_of(task, reference)
    grid = task.grid(step)
    grid = grid[grid <= reference.trajectory.time[-1] * (1 + 1e-9)]
    begin = int(np.searchsorted(grid, horizon * (1 + 1e-9), side="right")) - 1
    longest = length = max(1, begin // 2)  # in a longer one a small fault may hide behind the growth
    stride, compared = max(1, (len(grid) - 1 - begin) // LEAST_WINDOWS), float(grid[begin])
    label = f"co-simulation in windows, step {step:.3g} s"
    while not has_rows(task.mechanism) and begin + 1 < len(grid):
        starts, steps = _states_at(task, reference, float(grid[begin])), 0
        if starts is not None:
            try:
                direct = integrated(grid[begin : begin + length + 1], starts)
            except OutOfTimeError:
                break
            direct = replace(direct, scales=reference.scales)
            found, steps = _window(task, label, starts, direct)
            if found is not None:
                end = float(grid[begin + steps])
                windows = windows.with_another(found, max(0.0, end - max(compared, float(grid[begin]))))
                compared = max(compared, end)
        length = min(longest, 4 * length if steps == length else 2 * max(1, steps))
        begin += max(1, min(steps, stride) if begin + steps + 1 < len(grid) else steps)
    return replace(windows, covered=min(windows.covered, task.stop_time - horizon))


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


def _window(task: Task, label: str, starts: Mapping[str, float], direct: Reference) -> tuple[Check | None, int]:
    """The comparison with ``direct`` from ``starts``, and how many communication steps it covers.

    Where errors grow too much within one step, as in the impact of stiff teeth, the FMU gets the tolerance that such
    a growth asks for. Then there is no comparison if it is not exact enough and does the same at both tolerances, as
    methods of fixed step do.
    """
    if len(direct.trajectory) < 2:
        return None, 0
    sharper = min(task.tolerance, CHAOS / (SAFETY * float(direct.growth[1])) * (1 - 1e-9))
    if sharper < task.tolerance / SHARPEST:
        return None, 0
    window = replace(task, tolerance=sharper)
    steps = int(np.sum(direct.trajectory.time <= horizon_of(window, direct))) - 1
    times = direct.trajectory.time[: steps + 1]
    run = _run_of_window(window, starts, times)
    check = compare(window, label, run, direct)
    tells = check.passed or sharper == task.tolerance
    if not tells and np.array_equal(run.values, _run_of_window(task, starts, times).values):
        return None, 0
    return check, steps


def _run_of_window(task: Task, starts: Mapping[str, float], times: Floats) -> Trajectory:
    """The run of the FMU from ``starts``, or from its own, over the communication points ``times`` (k,) in s."""
    options = Run(
        start_time=float(times[0]),
        stop_time=float(times[-1]),
        step=task.steps[1],
        tolerance=task.tolerance,
        values={name: starts[name] for name in task.settable if name in starts},
        inputs=task.inputs,
        hold=task.hold,
        outputs=task.states,
    )
    return simulate_fmu(task.path, options)


def extent_check(task: Task, reference: Reference, windows: Windows | None = None) -> Iterator[Check]:
    """Checks that enough of the trajectories was compared, and that the windows agree."""
    windows = windows or Windows()
    if windows.worst is not None:
        yield windows.worst
    horizon = horizon_of(task, reference)
    left_out = 1 - (horizon + windows.covered) / task.stop_time
    if left_out > LEFT_OUT and not has_rows(task.mechanism):
        grown = (
            f"the comparison ends at t = {horizon:.3g} s, where errors have grown beyond "
            f"{comparable_growth(task.tolerance):.1g} times at tolerance {task.tolerance:g}; {SHARPER}"
        )
        detail = out_of_time(task, reference) or grown
        yield Check("trajectories, share not compared", left_out, LEFT_OUT, detail, extent=True)


def extent_note(task: Task, reference: Reference, windows: Windows) -> str:
    """A sentence on which part of the run was compared; empty if all of it was."""
    horizon = horizon_of(task, reference)
    if horizon >= task.stop_time * (1 - 1e-9):
        return ""
    longer = [f"{step:.3g} s" for step in task.steps if step > horizon * (1 + 1e-9)]
    beyond = f", and runs with a communication step of {' or '.join(longer)} not at all" if longer else ""
    most = comparable_growth(task.tolerance)
    reason = out_of_time(task, reference) if horizon == reference.trajectory.time[-1] else ""
    note = reason[:1].upper() + reason[1:] if reason else f"Errors may grow over {most:.3g} times"
    note += f": trajectories are compared until t = {horizon:.4g} s only{beyond}"
    if not windows.count:
        return f"{note}."
    share = min(1.0, (horizon + windows.covered) / task.stop_time)
    return f"{note}; {windows.told(horizon)}, {share:.0%} of the run in all."
