"""Runs of the FMU and the direct integration side by side, as long as that means something.

Bars: errors are relative to max(range, nominal) of each coordinate, velocity and further state. Two runs whose starts
differ by 1e-8 drift apart by the amplification A(t), in units of the motion; an error of the solver grows alike, and a
long vibration adds one for every radian: ``Reference.growth``. The bar is 100 growth tolerance. The comparison ends
where that exceeds 1e-2: from there on the motion is chaotic at this tolerance, and ``windows`` goes on.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lag2fmu.errors import SimulationError
from lag2fmu.reference.record import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.hybrid import comparable
from lag2fmu.verify.report import Check
from lag2fmu.verify.task import Floats, Task

SAFETY, CHAOS = 100.0, 1e-2


def horizon_of(task: Task, reference: Reference) -> float:
    """The time (s) until which trajectories can be compared at this tolerance."""
    bar = SAFETY * reference.growth * task.tolerance
    return float(reference.trajectory.time[bar <= CHAOS][-1]) if bar[0] <= CHAOS else 0.0


def own_error(task: Task, reference: Reference) -> float:
    """The error that the direct integration estimates of itself, amplification taken out, until the horizon."""
    weighed = reference.relative_error / reference.growth
    compared = comparable(task, reference) & (reference.trajectory.time <= horizon_of(task, reference))
    return float(weighed[compared].max(initial=0.0))


def on_grid(reference: Reference, time: Floats) -> NDArray[np.intp]:
    """The rows of the reference at ``time``; raises SimulationError if a time is not on its grid."""
    rows = np.searchsorted(reference.trajectory.time, time - 1e-9 * max(1.0, float(time[-1])))
    if not np.allclose(reference.trajectory.time[rows], time, rtol=1e-9, atol=1e-12):
        raise SimulationError("the communication points of the FMU are not those of the direct integration")
    return rows


def compare(task: Task, label: str, run: Trajectory, reference: Reference) -> Check:
    """The largest error of q, qd and further states, amplification taken out, until the horizon."""
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
