"""Checks by the analysis of a mechanism: conserved quantities, Hamilton's equations beside Lagrange's, the action."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lag2fmu.analysis.canonical import action
from lag2fmu.analysis.conserved import Conserved, conserved
from lag2fmu.deadline import Budget, OutOfTimeError
from lag2fmu.description import names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.errors import SimulationError
from lag2fmu.graph.autodiff import reverse
from lag2fmu.graph.batches import evaluate
from lag2fmu.reference.hamilton import integrate_canonically
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.agreement import SAFETY, has_rows, horizon_of, on_grid
from lag2fmu.verify.report import Check
from lag2fmu.verify.task import Task

Floats = NDArray[np.float64]

HORIZON, POINTS = 0.1, 40
"""The part of the run over which Hamilton's equations are integrated, and the number of points at which conserved
quantities are checked."""


def analysis_checks(task: Task, run: Trajectory, reference: Reference, budget: Budget) -> tuple[list[Check], list[str]]:
    """Checks of conserved quantities and of Hamilton's equations, for a run without inputs, and notes.

    What integrates takes its time from the ``budget``.
    """
    if has_rows(task.mechanism):
        return [], [
            "Conserved quantities and Hamilton's equations are for mechanisms without contacts and dry friction."
        ]
    if task.inputs is not None:
        return [], ["Conserved quantities and Hamilton's equations are compared in runs without inputs only."]
    if not task.mechanism.coordinates:
        return [], ["Nothing moves by itself: there are no conserved quantities and no equations of Hamilton."]
    equations, horizon = derive(task.mechanism), horizon_of(task, reference)
    rows = on_grid(reference, run.time)
    try:
        with budget.spent():
            checks, notes = hamilton_checks(equations, reference, horizon, SAFETY * task.tolerance)
    except OutOfTimeError:
        checks, notes = [], [f"Hamilton's equations are not compared: the {task.limit:g} s of CPU time were over."]
    drifts = drift_checks(equations, run, reference, rows, horizon, SAFETY * task.tolerance)
    return [*drifts, *checks], [*notes, action_note(equations, reference)]


def drift_checks(
    equations: EquationsOfMotion,
    run: Trajectory,
    reference: Reference,
    rows: NDArray[np.intp],
    horizon: float,
    bar: float,
) -> Iterator[Check]:
    """Checks of how far each conserved quantity drifts in a ``run`` without inputs, until ``horizon`` (s).

    A drift is relative to the greatest value of the quantity, or to its change if q and qd change by their scales, and
    is divided by the growth of errors. ``rows`` (k,) are the rows of ``reference`` at the times of the run. The
    generalized energy is checked elsewhere. Quantities are conserved for zero inputs. If inputs start at other values,
    only those quantities are checked that the direct integration keeps constant. Source: E. Noether, Invariante
    Variationsprobleme, 1918.
    """
    seen = np.unique(np.linspace(0, np.sum(run.time <= horizon) - 1, POINTS).astype(int))
    driven = any(u.start for u in equations.mechanism.plain_inputs)
    for item in conserved(equations):
        if item.name == "generalized_energy":
            continue
        if driven and _drift(equations, item, reference.trajectory, rows[seen], reference, rows[seen]).max() > bar:
            continue
        drift = _drift(equations, item, run, seen, reference, rows[seen])
        worst = int(np.argmax(drift))
        detail = f"{item.meaning}; largest drift at t = {run.time[seen][worst]:.3g} s"
        yield Check(f"conserved: {item.name}", float(drift[worst]), bar, detail)


def _drift(
    equations: EquationsOfMotion,
    item: Conserved,
    run: Trajectory,
    seen: NDArray[np.intp],
    reference: Reference,
    rows: NDArray[np.intp],
) -> Floats:
    """The relative drift of ``item`` from its start at the rows ``seen`` (k,) of ``run``, divided by its growth."""
    g, v = equations.graph, equations.variables
    scales = [reference.scales[str(g.leaf[node])] for node in (*v.q, *v.qd)]
    nodes = [item.node, *reverse(item.graph, {item.node: g.one}, [*v.q, *v.qd])]
    value, *slopes = evaluate(item.graph, nodes, _run_values(equations, run, seen))
    moved = max(float(np.abs(slope).max() * scale) for slope, scale in zip(slopes, scales, strict=True))
    size = max(float(np.abs(value).max()), moved, 1e-300)
    drift: Floats = np.abs(value - value[0]) / size / reference.growth[rows]
    return drift


def _run_values(equations: EquationsOfMotion, run: Trajectory, rows: NDArray[np.intp]) -> dict[str, Floats]:
    """q, qd, the time and the parameters at ``rows`` of a run; everything else is absent."""
    g, v, m = equations.graph, equations.variables, equations.mechanism
    starts = {u.name: u.start for u in m.inputs}
    values = {str(g.leaf[node]): starts.get(str(g.leaf[node]), 0.0) for node in v.signals}
    values |= {p.name: p.value for p in m.parameters if p.value is not None}
    found = {name: np.full(len(rows), value) for name, value in values.items()}
    coordinates = [c.name for c in m.coordinates]
    further = [z.name for z in m.states]
    found |= {name: run[name][rows] for name in (*coordinates, *map(names.velocity, coordinates), *further)}
    return found | {"t": run.time[rows]}


def hamilton_checks(
    equations: EquationsOfMotion, reference: Reference, horizon: float, bar: float
) -> tuple[list[Check], list[str]]:
    """Hamilton's equations against the direct integration over the first tenth, at most to ``horizon`` (s).

    Returns checks and notes. The error, relative to the scales of q and qd and divided by the amplification, must not
    exceed ``bar``. The notes say why if there is no comparison. Source: Goldstein, Classical Mechanics, section 8.1.
    """
    trajectory = reference.trajectory
    if equations.mechanism.states:
        return [], ["Hamilton's equations are not compared: the mechanism has further states."]
    inside = trajectory.time <= min(horizon, HORIZON * float(trajectory.time[-1]))
    if np.sum(inside) < 2:
        return [], ["Hamilton's equations are not compared: errors grow beyond the bar before two points are reached."]
    times = trajectory.time[inside]
    try:
        own = integrate_canonically(equations.mechanism, times, method=reference.method, turns=reference.turns)
    except SimulationError as error:
        return [], [f"Hamilton's equations are not compared: {error}."]
    scales = np.array([reference.scales[name] for name in own.names])
    errors = (np.abs(own.values - trajectory.columns(list(own.names))[inside]) / scales).max(axis=1)
    weighed = errors / reference.growth[inside]
    return [Check("Hamilton's equations", float(weighed.max()), bar, f"until t = {times[-1]:.3g} s")], []


def action_note(equations: EquationsOfMotion, reference: Reference) -> str:
    """The action (J.s) along the direct integration, as a sentence."""
    trajectory = reference.trajectory
    states = {name: trajectory[name] for name in trajectory.names if name not in equations.outputs}
    S = action(equations, trajectory.time, states)
    return f"The action along the run, the integral of L dt, is {S[-1]:.6g} J s."
