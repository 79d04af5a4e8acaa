"""Checks of a run that need no second run: the constraints, and the balance of energy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from lag2fmu.description import names
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.agreement import SAFETY, comparable, has_rows, horizon_of, on_grid
from lag2fmu.verify.firmness import Firmness
from lag2fmu.verify.report import Check
from lag2fmu.verify.task import ROUNDING, Floats, Task

_POINTS = 200
"""The number of points of a run at which forces are looked at."""

_SLOW = 1e-3
"""The part of nominal velocities whose power measures that of slower motions: what rests moves by rounding alone, and
rounding has no relative precision."""

_INSTANT = 1e-12
"""s; the distance from a point of a run at which the other side of a force is that jumps there."""


def constraint_checks(task: Task, runs: Mapping[str, Trajectory], reference: Reference) -> Iterator[Check]:
    """The residuals at all communication points, relative to their change with a coordinate's nominal value."""
    if not task.mechanism.constraints:
        return
    labels = [names.residual(c.name) for c in task.mechanism.constraints]
    equations = Equations(task.mechanism)
    for label, run in runs.items():
        # co-simulation meets constraints to rounding at any tolerance, unless they are ill-conditioned
        bar = max(ROUNDING, task.tolerance / SAFETY) if label.startswith("co-simulation") else SAFETY * task.tolerance
        relative = np.abs(run.columns(labels)) / _constraint_scales(task, equations, run)
        row, column = np.unravel_index(np.argmax(relative), relative.shape)
        detail = f"largest: {labels[column]} at t = {run.time[row]:.3g} s"
        yield Check(f"constraints, {label}", float(relative[row, column]), bar, detail)
    scales = _constraint_scales(task, equations, reference.trajectory)
    for k, c in enumerate(task.mechanism.constraints):
        if c.massless:  # the equilibrium has to hold without a force
            force = np.abs(reference.trajectory[names.multiplier(c.name)] * scales[:, k]).max()
            yield Check(f"no force belongs to {c.name}", float(force / max(_sizes(reference), default=1.0)), 1e-8)


def _constraint_scales(task: Task, equations: Equations, run: Trajectory) -> Floats:
    """How much each residual changes with a coordinate's nominal value at the points of ``run``, (k, m).

    Residuals of nonholonomic constraints change with a velocity. Its nominal value is that of the coordinate by 1 s, or
    the greatest velocity of the motion.
    """
    n, energies = len(task.mechanism.coordinates), equations.energies
    x = run.columns(task.states)
    nominal = np.array([c.nominal for c in task.mechanism.coordinates])
    state = energies.state(run.time, x[:, :n], x[:, n : 2 * n], task.further(run))
    jacobian = energies.constraints(state)[3]
    found: Floats = np.abs(jacobian * nominal[:, None]).max(axis=1).T
    found = np.where(found > 0, found, 1.0)
    found[:, energies.constraints.h :] *= np.maximum(1.0, np.abs(x[:, n : 2 * n] / nominal).max(axis=1))[:, None]
    return found


def energy_checks(task: Task, run: Trajectory, reference: Reference) -> list[Check]:
    """Checks that dh/dt is the power at every point, and that h - work is constant if no motion input drives the run.

    h is the generalized energy (J). Source: Goldstein, Classical Mechanics, section 2.7.
    """
    coordinates = [c.name for c in task.mechanism.coordinates]
    q, qd = run.columns(coordinates), run.columns([names.velocity(c) for c in coordinates])
    qdd = run.columns([names.acceleration(c) for c in coordinates])
    inputs = _inputs_at(task, run.time)
    residual, power = _balance_beside(task, run.time, (q, qd, qdd), inputs | task.further(run))
    resting = resting_energy(task, run)
    slow = _SLOW * resting / ROUNDING  # W, as nominal velocities are nominal values by 1 s
    scale = max(power, slow) or 1.0
    worst = int(np.argmax(residual))
    off, detail = float(residual[worst] / scale), f"largest at t = {run.time[worst]:.3g} s"
    pointwise = Check("energy: dh/dt - power, every point", off, ROUNDING, detail)
    checks = [] if has_rows(task.mechanism) else [pointwise]  # forces of contacts do work too
    if task.holds and any(motion.name in inputs for motion in task.mechanism.motions):
        return checks  # held motions jump at communication points, and h jumps with them
    rows = on_grid(reference, run.time)
    h, work = run["generalized_energy"], reference.work[rows]
    found = float(np.abs(h).max()), float(np.ptp(h)), float(np.ptp(work)), *_sizes(reference)
    size = max(*found, resting, 1e-300)
    drift = np.abs(h - h[0] - work + work[0]) / size / reference.growth[rows]
    compared = (run.time <= horizon_of(task, reference)) & comparable(task, reference)[rows]
    drift = np.where(compared, drift, 0.0)
    worst = int(np.argmax(drift))
    detail = f"largest drift at t = {run.time[worst]:.3g} s"
    # a range is twice an amplitude, and energies are squares: 1 % of the range of a vibration is 4 % of its energy
    bar = 4 * SAFETY * task.tolerance
    return [*checks, Check("energy: h - work over the run", float(drift[worst]), bar, detail)]


def _balance_beside(
    task: Task, time: Floats, motion: tuple[Floats, Floats, Floats], given: Mapping[str, Floats]
) -> tuple[Floats, float]:
    """The residuals (k,) of dh/dt - power in W, and the greatest power: at the points, or just before or after them.

    At an instant at which a force jumps, as sign(t) does at 0, either side is right: each point has the smallest one.
    Points at which constraints are about to be lost have none.
    """
    equations, (q, qd, qdd) = Equations(task.mechanism), motion
    beside = [equations.balance(time + dt, q + dt * qd, qd + dt * qdd, qdd, given) for dt in (0.0, -_INSTANT, _INSTANT)]
    residual = np.min([np.abs(balance.residual) for balance in beside], axis=0)
    state = equations.energies.state(time, q, qd, given)
    residual = np.where(Firmness.along(equations.energies, state).at(state), residual, 0.0)
    return residual, float(np.max(beside[0].scale, initial=0.0))


def resting_energy(task: Task, run: Trajectory) -> float:
    """The energy (J) of rounding errors of the positions along ``run``: forces times nominal values times rounding.

    The drift of a body at rest, on a floor or stuck, is measured by it, because there is no other energy. What
    frictions bear counts, too: a moving belt and the ground may pull at a body that rests.
    """
    equations, n = Equations(task.mechanism), len(task.mechanism.coordinates)
    seen = np.unique(np.linspace(0, len(run) - 1, _POINTS).astype(int))
    x = run.columns(task.states)[seen]
    given = {name: values[seen] for name, values in (_inputs_at(task, run.time) | task.further(run)).items()}
    terms = equations.terms(equations.energies.state(run.time[seen], x[:, :n], x[:, n : 2 * n], given))
    force = np.abs(terms.lagrangian_slope).max(axis=-1) + np.abs(terms.forces).max(axis=-1)
    nominal = np.array([c.nominal for c in task.mechanism.coordinates])
    rubbing = np.abs(run.columns([names.force(f.name) for f in task.mechanism.frictions])).max(axis=0, initial=0.0)
    energy = ROUNDING * float(force @ nominal + rubbing.sum() * nominal.max(initial=0.0))
    return energy if np.isfinite(energy) else 0.0


def _inputs_at(task: Task, times: Floats) -> dict[str, Floats]:
    """{input: values (k,)} in the FMU when its accelerations are recorded at the communication points ``times`` (k,).

    Held inputs then still have the values that were set before the step to the point.
    """
    signals = task.driving(times[1] - times[0] if len(times) > 1 else task.stop_time)  # a run may end at its start
    if signals is None:
        return {}
    return signals.sampled(np.append(times[0], np.nextafter(times[1:], 0.0)) if task.holds else times)


def _sizes(reference: Reference) -> list[float]:
    kinetic = "kinetic_energy"
    return [float(np.abs(reference.trajectory[kinetic]).max())] if kinetic in reference.trajectory else []
