"""The FMU against the direct integration of the same mechanism, on paths that share nothing but the record.

Bars: errors are relative to max(range, nominal) of each coordinate and velocity. Two runs whose starts differ by 1e-8
drift apart by the amplification A(t); an error of the solver grows alike, so the bar is 100 max(1, A) tolerance. The
comparison ends where that exceeds 1e-2: from there on the motion is chaotic at this tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lag2fmu.dynamics import derive
from lag2fmu.errors import SimulationError
from lag2fmu.fmu import suited_solver
from lag2fmu.mechanism import Mechanism, names
from lag2fmu.mechanism.display import display_units
from lag2fmu.reference import Equations, Reference, Trajectory, held, integrate
from lag2fmu.reference.signals import Inputs
from lag2fmu.verify.invariants import action_note, drift_checks, hamilton_checks
from lag2fmu.verify.pointwise import pointwise_checks
from lag2fmu.verify.report import Check, Report
from lag2fmu.verify.simulate import Kind, offers_model_exchange, problems, simulate_fmu
from lag2fmu.verify.task import ROUNDING, Floats, Task

SAFETY, CHAOS = 100.0, 1e-2
DIRECT = "direct integration"


def validate_fmu(
    mechanism: Mechanism,
    path: Path,
    *,
    stop_time: float | None = None,
    tolerance: float | None = None,
    inputs: Trajectory | None = None,
) -> Report:
    """Compare the FMU ``path`` with the direct integration of ``mechanism`` from 0 to ``stop_time`` (s).

    ``inputs`` drives both (held constant during a communication step); ``tolerance`` is the relative one of the FMU's
    solver. The module says what the bars are. Raises SimulationError if either side fails; differences are reported,
    not raised. Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section I.14,
    for how neighbouring solutions, and hence errors, grow apart.
    """
    experiment = mechanism.experiment
    task = Task(mechanism, path, stop_time or experiment.stop_time, tolerance or experiment.tolerance, inputs)
    found = problems(path)
    checks = [Check("findings of fmpy's validation", float(len(found)), 0.0, "; ".join(found)[:200])]
    shared = _reference(task, task.grid(task.steps[-1]), None) if inputs is None else None
    runs: dict[str, Trajectory] = {}
    warnings: dict[str, list[str]] = {}
    plan: list[tuple[Kind, float]] = [("co-simulation", step) for step in task.steps]
    if offers_model_exchange(path):
        plan.append(("model-exchange", task.steps[1]))
    for kind, step in plan:
        label = f"co-simulation, step {step:.3g} s" if kind == "co-simulation" else "model exchange, CVode of fmpy"
        reference = shared or _reference(task, task.grid(step), _driving(task, step))
        runs[label] = run = _run(task, kind, step, warnings.setdefault(label, []).append)
        checks.append(_compare(task, label, run, reference))
        if (kind, step) == ("co-simulation", task.steps[1]):
            energy = _energy_checks(task, run, reference)
            analysis, analysis_notes = _analysis(task, run, reference)
    checks += [*energy, *analysis, *_constraint_checks(task, runs, reference), *pointwise_checks(task, reference)]
    checks.append(Check("direct integration, own error", _own_error(task, reference), SAFETY * task.tolerance / 10))
    return Report(
        title=f"{mechanism.title}: FMU against direct integration, {task.stop_time:g} s, tolerance {task.tolerance:g}",
        checks=tuple(checks),
        notes=(*_notes(task, reference), *analysis_notes, *_solver_notes(task, warnings)),
        coordinates=tuple(c.name for c in mechanism.coordinates),
        trajectories={DIRECT: reference.trajectory, **runs},
        units=display_units(mechanism),
    )


def _driving(task: Task, step: float) -> Inputs | None:
    """The inputs as the FMU meets them: held during each communication step."""
    return None if task.inputs is None else held(task.inputs.interpolated(task.grid(step)))


def _reference(task: Task, grid: Floats, inputs: Inputs | None) -> Reference:
    rtol = max(1e-13, min(1e-10, 1e-3 * task.tolerance))
    return integrate(task.mechanism, grid, inputs=inputs, rtol=rtol)


def _run(task: Task, kind: Kind, step: float, warned: Callable[[str], None]) -> Trajectory:
    """One run of the FMU, whose warnings go to ``warned``.

    CVode gets a hundredth of the tolerance, for its global errors exceed its local ones.
    """
    outputs = [*task.states, *(names.acceleration(c.name) for c in task.mechanism.coordinates), "generalized_energy"]
    outputs += [names.residual(c.name) for c in task.mechanism.constraints]
    tolerance = task.tolerance if kind == "co-simulation" else max(task.tolerance / 100, 1e-13)
    return simulate_fmu(
        task.path,
        stop_time=task.stop_time,
        step=step,
        tolerance=tolerance,
        inputs=task.inputs,
        outputs=outputs,
        kind=kind,
        warned=warned,
    )


# ------------------------------------------------------------------------------------------------------- trajectories


def _horizon(task: Task, reference: Reference) -> float:
    """The time (s) until which trajectories can be compared at this tolerance."""
    bar = SAFETY * np.maximum(1.0, reference.amplification) * task.tolerance
    return float(reference.trajectory.time[bar <= CHAOS][-1]) if bar[0] <= CHAOS else 0.0


def _own_error(task: Task, reference: Reference) -> float:
    """The error that the direct integration estimates of itself, amplification taken out, until the horizon."""
    weighed = reference.relative_error / np.maximum(1.0, reference.amplification)
    return float(weighed[reference.trajectory.time <= _horizon(task, reference)].max())


def _on_grid(reference: Reference, time: Floats) -> NDArray[np.intp]:
    """The rows of the reference at ``time``; raises SimulationError if a time is not on its grid."""
    rows = np.searchsorted(reference.trajectory.time, time - 1e-9 * max(1.0, float(time[-1])))
    if not np.allclose(reference.trajectory.time[rows], time, rtol=1e-9, atol=1e-12):
        raise SimulationError("the communication points of the FMU are not those of the direct integration")
    return rows


def _compare(task: Task, label: str, run: Trajectory, reference: Reference) -> Check:
    """The largest error of q and qd, amplification taken out, until the horizon."""
    rows = _on_grid(reference, run.time)
    scales = np.array([reference.scales[name] for name in task.states])
    errors = (np.abs(run.columns(task.states) - reference.trajectory.columns(task.states)[rows]) / scales).max(axis=1)
    weighed = errors / np.maximum(1.0, reference.amplification[rows])
    compared = run.time <= _horizon(task, reference)
    worst = int(np.argmax(errors[compared]))
    return Check(
        label,
        float(weighed[compared].max()),
        SAFETY * task.tolerance,
        f"largest error {errors[compared][worst]:.1e} at t = {run.time[worst]:.3g} s",
    )


def _constraint_checks(task: Task, runs: Mapping[str, Trajectory], reference: Reference) -> Iterator[Check]:
    """The residuals at all communication points, in units of what a coordinate's nominal value makes."""
    if not task.mechanism.constraints:
        return
    labels = [names.residual(c.name) for c in task.mechanism.constraints]
    scales = _constraint_scales(task)
    for label, run in runs.items():
        bar = ROUNDING if label.startswith("co-simulation") else SAFETY * task.tolerance
        yield Check(f"constraints, {label}", float((np.abs(run.columns(labels)) / scales).max()), bar)
    for k, c in enumerate(task.mechanism.constraints):
        if c.massless:  # whatever keeps to the equilibrium must do so without a force
            force = np.abs(reference.trajectory[names.multiplier(c.name)]).max() * scales[k]
            yield Check(f"no force belongs to {c.name}", float(force / max(_sizes(reference), default=1.0)), 1e-8)


def _constraint_scales(task: Task) -> Floats:
    """How much each residual changes with a coordinate's (for nonholonomic ones a velocity's) nominal value, (m,)."""
    energies = Equations(task.mechanism).energies
    jacobian = energies.constraints(energies.state(0.0, *energies.start()))[3]
    nominal = np.array([c.nominal for c in task.mechanism.coordinates])
    found: Floats = np.abs(jacobian * nominal).max(axis=1)
    return np.where(found > 0, found, 1.0)


def _energy_checks(task: Task, run: Trajectory, reference: Reference) -> list[Check]:
    """dh/dt = power at every point, and h - work constant over the run where no motion input drives it."""
    coordinates = [c.name for c in task.mechanism.coordinates]
    q, qd = run.columns(coordinates), run.columns([names.velocity(c) for c in coordinates])
    qdd = run.columns([names.acceleration(c) for c in coordinates])
    inputs: Mapping[str, Floats] = {}
    if task.inputs is not None:
        # what was set before the step that led to a point is still set when its accelerations are recorded
        given = task.inputs.interpolated(run.time)
        inputs = {name: np.concatenate([given[name][:1], given[name][:-1]]) for name in given}
    balance = Equations(task.mechanism).balance(run.time, q, qd, qdd, inputs)
    scale = float(np.max(balance.scale, initial=0.0)) or 1.0
    pointwise = Check("energy: dh/dt - power, every point", float(np.abs(balance.residual).max() / scale), ROUNDING)
    if any(motion.name in inputs for motion in task.mechanism.motions):
        return [pointwise]  # motions that are held jump at communication points, and h with them
    rows = _on_grid(reference, run.time)
    h, work = run["generalized_energy"], reference.work[rows]
    size = max(float(np.abs(h).max()), float(np.ptp(h)), float(np.ptp(work)), *_sizes(reference), 1e-300)
    drift = np.abs(h - h[0] - work + work[0]) / size / np.maximum(1.0, reference.amplification[rows])
    compared = run.time <= _horizon(task, reference)
    return [pointwise, Check("energy: h - work over the run", float(drift[compared].max()), SAFETY * task.tolerance)]


def _analysis(task: Task, run: Trajectory, reference: Reference) -> tuple[list[Check], list[str]]:
    """Conserved quantities and Hamilton's equations, of a run without inputs, and notes."""
    if task.inputs is not None:
        return [], ["Conserved quantities and Hamilton's equations are compared in runs without inputs only."]
    equations, horizon = derive(task.mechanism), _horizon(task, reference)
    rows = _on_grid(reference, run.time)
    checks, notes = hamilton_checks(equations, reference, horizon, SAFETY * task.tolerance)
    drifts = drift_checks(equations, run, reference, rows, horizon, SAFETY * task.tolerance)
    return [*drifts, *checks], [*notes, action_note(equations, reference)]


def _sizes(reference: Reference) -> list[float]:
    kinetic = "kinetic_energy"
    return [float(np.abs(reference.trajectory[kinetic]).max())] if kinetic in reference.trajectory else []


def _solver_notes(task: Task, warnings: Mapping[str, Sequence[str]]) -> list[str]:
    """Which solver suits the start, and what the FMU said of its own in each run."""
    solver, reason = suited_solver(task.mechanism, "c")
    suited = [f"Solver for co-simulation: {solver} suits this mechanism; {reason}."] if reason else []
    return suited + [f"The FMU warned, {label}: {text}" for label, texts in warnings.items() for text in texts]


def _notes(task: Task, reference: Reference) -> list[str]:
    amplification = float(reference.amplification[-1])
    horizon = _horizon(task, reference)
    notes = [
        "Errors are relative to max(range, nominal) and divided by the amplification of start perturbations, "
        f"which reaches {amplification:.3g}.",
        f"Direct integration: {reference.method} of SciPy, {reference.evaluations} evaluations.",
    ]
    if not offers_model_exchange(task.path):
        notes.append("The FMU offers co-simulation only.")
    if horizon < task.stop_time * (1 - 1e-9):
        notes.append(f"Chaotic at this tolerance: trajectories are compared until t = {horizon:.4g} s only.")
    return notes
