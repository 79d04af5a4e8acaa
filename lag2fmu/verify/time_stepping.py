"""What an FMU that steps over impacts and changes of modes may be off by, and at which step it is judged.

What happens in a step happens up to a step h late: in a position that is off by h times the velocity before it. Behind
it positions are off by h times the velocity there, and velocities by h times the change of accelerations. Smooth
motions between are off by terms of h^2. The direct integration tells these and how errors grow, so the sum of them is a
bar of its own. It is no use where it is no longer small. Then the FMU is judged at a shorter step: its laws are the
same there, and what is wrong with them does not become less. No step is short enough where contacts take impacts from
each other in ever shorter times: what a step takes at once is another impact, by which velocities may be off. Source:
V. Acary, B. Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, Springer 2008, chapter 10, for the order of
event-capturing schemes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.fmu.advice import steps_over_impacts
from lag2fmu.fmu.materials import solver_inside
from lag2fmu.fmu.runtime_tables import default_solver_step
from lag2fmu.mechanism.record import Mechanism, complete
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.solvers.methods import METHODS, TimeStepping
from lag2fmu.verify.agreement import CHAOS, SAFETY, horizon_of, on_grid
from lag2fmu.verify.laws.along import STILL
from lag2fmu.verify.run import Kind
from lag2fmu.verify.task import Floats, Task

MOST_STEPS = 2e5
"""The most steps with which the FMU is judged; if it needs more, less of the run is compared."""
NEAR = 3.0
"""In steps: so near to each other impacts may fall into one step, as each is late by up to one."""


def own_step(mechanism: Mechanism, path: Path) -> float:
    """The step (s) with which the FMU ``path`` steps over events, where nothing else is set; 0 if it locates them."""
    stepping = isinstance(METHODS.get(solver_inside(path) or ""), TimeStepping)
    return default_solver_step(mechanism) if stepping else 0.0


def as_stepped(mechanism: Mechanism) -> Mechanism:
    """The ``mechanism`` as time stepping takes it: the impacts of a step are one problem."""
    differs = any(steps_over_impacts(mechanism, method) for method in METHODS.values())
    return complete(replace(mechanism.description, impacts="simultaneous")) if differs else mechanism


def sharpened(task: Task, references: Sequence[Reference]) -> Task:
    """The ``task`` with the step, its own at most, at which the errors of steps stay below half of the bar CHAOS.

    ``references`` are its direct integrations.
    """
    if not task.solver_step:
        return task
    return replace(task, solver_step=min(_sharp_step(task, reference) for reference in references))


def _sharp_step(task: Task, reference: Reference) -> float:
    at = int(np.searchsorted(reference.trajectory.time, horizon_of(task, reference) * (1 + 1e-9))) - 1
    late, bent = float(_late(task, reference)[at]), float(_bent(task, reference)[at])
    room = 0.5 * max(CHAOS / float(reference.growth[at]) - SAFETY * task.tolerance, 0.0)
    least = task.stop_time / MOST_STEPS
    short = 2 * room / max(late + np.sqrt(late**2 + 4 * bent * room), 1e-300)  # late h + bent h^2 = room
    return float(min(task.solver_step, max(least, short)))


def as_seen(task: Task, reference: Reference, kind: Kind = "co-simulation") -> Reference:
    """The ``reference`` with what steps over events add to the growth of errors; itself for what locates events.

    Model exchange is the latter ``kind``.
    """
    if task.solver_step == 0.0 or kind != "co-simulation":
        return reference
    h = task.solver_step
    off = h * _late(task, reference) + h**2 * _bent(task, reference) + _taken_at_once(task, reference)
    added = off / (SAFETY * task.tolerance)
    return replace(reference, amplification=reference.growth * (1.0 + added))


def _late(task: Task, reference: Reference) -> Floats:
    """By how much states are off until each time where all events are late by 1 s, relative to their scales: (m,)."""
    happened = [*(event.time for event in reference.events), *reference.turns]
    run, changes = reference.trajectory, np.zeros(len(reference.trajectory))
    cells, counts = np.unique(_cells(reference, happened), return_counts=True)
    for c in task.mechanism.coordinates:
        speeds, kicks = np.abs(run[names.velocity(c.name)]), np.abs(np.diff(run[names.acceleration(c.name)]))
        moved = np.maximum(speeds[cells - 1], speeds[cells]) / reference.scales[c.name]
        kicked = kicks[cells - 1] / reference.scales[names.velocity(c.name)]
        changes[cells] = np.maximum(changes[cells], counts * np.maximum(moved, kicked))
    return _before(changes)


def _bent(task: Task, reference: Reference) -> Floats:
    """By how much velocities are off until each time, relative to their scales, over the square of the step: (m,).

    A step of h takes an acceleration in its middle for the mean, which is off by h^2/24 times its second derivative.
    The energy of a vibration swings by (w h)^2/8 from its first period on. Source: E. Hairer, C. Lubich, G. Wanner,
    Geometric Numerical Integration, 2nd edition, sections I.1.4 and IX.3.
    """
    run, changes, swing = reference.trajectory, np.zeros(len(reference.trajectory)), 0.0
    happened = _cells(reference, [*(event.time for event in reference.events), *reference.turns])
    quiet = ~np.isin(np.arange(1, len(run) - 1), [*happened, *(happened - 1)])
    for c in task.mechanism.coordinates:
        slopes = np.diff(run[names.acceleration(c.name)]) / np.diff(run.time)
        scale = reference.scales[names.velocity(c.name)]
        bends = np.where(quiet, np.abs(np.diff(slopes)), 0.0) / scale
        changes[1:-1] = np.maximum(changes[1:-1], bends / 24)
        swing = max(swing, float(np.abs(slopes[1:][quiet]).max(initial=0.0)) / scale / 8)
    return swing + np.asarray(np.cumsum(changes))


def _taken_at_once(task: Task, reference: Reference) -> Floats:
    """By how much velocities may be off until each time because a step takes several impacts at once: (m,).

    It is relative to their scales: the change of velocities by each impact that follows one of another contact within
    NEAR steps.
    """
    impacts = [event for event in reference.events if event.kind == "impact"]
    near = [
        after.time
        for before, after in pairwise(impacts)
        if before.element != after.element and 0 < after.time - before.time <= NEAR * task.solver_step
    ]
    changes, cells = np.zeros(len(reference.trajectory)), np.unique(_cells(reference, near))
    for rate in (names.velocity(c.name) for c in task.mechanism.coordinates):
        jumps = np.abs(np.diff(reference.trajectory[rate]))[cells - 1] / reference.scales[rate]
        changes[cells] = np.maximum(changes[cells], jumps)
    return _before(changes)


def _cells(reference: Reference, times: Sequence[float]) -> NDArray[np.intp]:
    """The rows of ``reference`` right behind ``times`` (k,) in s: (k,)."""
    known = reference.trajectory.time
    return np.clip(np.searchsorted(known, sorted(times)), 1, len(known) - 1)


def _before(changes: Floats) -> Floats:
    """The sum of ``changes`` (m,) from the row before each of them on: (m,)."""
    summed: Floats = np.cumsum(np.append(changes[1:], 0.0))
    return summed


def own_step_notes(own: Task, reference: Reference, run_of: Callable[..., Trajectory]) -> list[str]:
    """A sentence on what positions are off by at the step of the task ``own``, that of the FMU itself, if it has one.

    ``run_of`` makes a run of a task: of its kind, with a communication step (s), whether by event mode, told warnings.
    """
    if not own.solver_step:
        return []
    run = run_of(own, "co-simulation", own.steps[1], False, lambda sentence: None)
    run = run.until(float(reference.trajectory.time[-1]))
    rows = on_grid(reference, run.time)
    seen = np.isfinite(reference.growth[rows])
    worst, told = 0.0, "no position"
    for c in own.mechanism.coordinates:
        off = np.where(seen, np.abs(run[c.name] - reference.trajectory[c.name][rows]), 0.0)
        at = int(np.argmax(off))
        if off[at] / reference.scales[c.name] >= worst:
            worst = float(off[at] / reference.scales[c.name])
            told = f"{c.name} by {off[at]:.2g} (SI), {worst:.1%} of its range, at t = {run.time[at]:.3g} s"
    return [f"At the FMU's own step of {own.solver_step:.3g} s the greatest error is that of {told}."]


def order_notes(task: Task) -> list[str]:
    """A sentence on the bars of an FMU that steps over events; none for another."""
    if not task.solver_step:
        return []
    return [
        "The FMU steps over impacts and over what sticks or slips anew: what happens is up to a step late, and bars "
        f"hold this, at steps of {task.solver_step:.3g} s; forces have to break their laws at {STILL} points in a row. "
        "A smaller solver_step is as much more exact; a solver that locates events, as --solver dopri5, is exact."
    ]
