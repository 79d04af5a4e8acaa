"""What makes the runs of a sweep: compiled batches for models, fmpy for FMUs and systems.

Tasks travel to other processes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from lag2fmu.ensemble.compiled import Ensemble
from lag2fmu.errors import SimulationError
from lag2fmu.formats.text import read
from lag2fmu.reference.trajectory import Floats, Trajectory
from lag2fmu.studies.design import SweepTask, TaskResults
from lag2fmu.studies.givable import kinds_of
from lag2fmu.systems.network import network_of_file
from lag2fmu.systems.running import simulate_system
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu


def run_part(task: SweepTask, rows: Floats) -> TaskResults:
    """Make the runs with the values in ``rows`` (runs, names), in SI units; a run that fails gets a reason."""
    values = np.full((len(rows), len(task.times), len(task.outputs)), np.nan)
    reasons = _out_of_bounds(task, rows)
    good = np.array([i for i in range(len(rows)) if i not in reasons], dtype=int)
    if len(good):
        found = _ENGINES[task.kind](task, rows[good])
        values[good] = found.values
        reasons |= {int(good[i]): reason for i, reason in found.reasons.items()}
    return TaskResults(values, reasons)


def _out_of_bounds(task: SweepTask, rows: Floats) -> dict[int, str]:
    """{run: reason} of the runs whose values are out of bounds."""
    found: dict[int, str] = {}
    for name, column in zip(task.names, rows.T, strict=True):
        for i in np.flatnonzero(~np.isfinite(column)).tolist():
            found.setdefault(i, f"{name} = {column[i]:g} is no finite number")
        low, high = task.bounds.get(name, (-np.inf, np.inf))
        for i in np.flatnonzero((column < low) | (column > high)).tolist():
            found.setdefault(i, f"{name} = {column[i]:g} is out of its bounds, {low:g} to {high:g} (SI)")
    return found


# ------------------------------------------------------------------------------------------------------------- models


@lru_cache(maxsize=8)
def _ensemble(text: str, solver: str | None) -> Ensemble:
    """The compiled batches of a mechanism, made once in each process."""
    return Ensemble(read(text, "sweep.toml"), solver=solver)


def _by_ensemble(task: SweepTask, rows: Floats) -> TaskResults:
    ensemble = _ensemble(task.model, task.solver)
    given: dict[str, dict[str, object]] = {"starts": {}, "parameters": {}, "inputs": {}}
    kinds = kinds_of(ensemble.mechanism)
    run, signals = task.run, task.run.inputs
    for name, value in (run.values or {}).items():
        given[kinds[name]][name] = value
    given["inputs"] |= {} if signals is None else dict(zip(signals.names, signals.values.T, strict=True))
    for name, column in zip(task.names, rows.T, strict=True):
        whole = kinds[name] == "inputs" and signals is not None
        given[kinds[name]][name] = np.repeat(column[:, None], len(signals.time), 1) if whole else column  # type: ignore[union-attr]
    runs = ensemble.run(
        **given,  # type: ignore[arg-type]
        input_times=None if signals is None else signals.time,
        hold=run.hold,
        stop_time=run.stop_time,
        samples=task.times if len(task.times) > 1 else (),
        outputs=task.outputs,
        tolerance=1e-6 if run.tolerance is None else run.tolerance,
        threads=task.threads,
    )
    found = [runs.samples[n] if len(task.times) > 1 else runs.final[n][:, None] for n in task.outputs]
    return TaskResults(np.stack(found, axis=2), runs.reasons)


# --------------------------------------------------------------------------------------------------------------- FMUs


def _by_fmpy(task: SweepTask, rows: Floats) -> TaskResults:
    """The runs, made one after the other; between runs an FMU of lag2fmu is reset, another one loaded anew."""
    return _one_by_one(task, rows, partial(simulate_fmu, Path(task.model)))


def _by_system(task: SweepTask, rows: Floats) -> TaskResults:
    """The runs, made one after the other."""
    with network_of_file(Path(task.model)) as network:
        return _one_by_one(task, rows, lambda run: simulate_system(network, run, run.inputs))


def _one_by_one(task: SweepTask, rows: Floats, simulate: Callable[[Run], Trajectory]) -> TaskResults:
    values, reasons = np.full((len(rows), len(task.times), len(task.outputs)), np.nan), {}
    for i, row in enumerate(rows):
        try:
            varied = dict(zip(task.names, row.tolist(), strict=True))
            run = simulate(replace(task.run, values={**(task.run.values or {}), **varied}))
        except SimulationError as error:
            reasons[i] = str(error)
        else:
            values[i] = run.interpolated(task.times).columns(task.outputs)
    return TaskResults(values, reasons)


_ENGINES = {"mechanism": _by_ensemble, "fmu": _by_fmpy, "system": _by_system}
