"""Sweeps: many runs of one model over what varies, here or on any executor."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from pathlib import Path
from typing import Any

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.fmu.exported import is_fmu
from lag2fmu.language.given import check_names
from lag2fmu.progress import reached, telling
from lag2fmu.reference.trajectory import Floats
from lag2fmu.studies.datasets import check_path, dataset, save
from lag2fmu.studies.design import Design, SweepTask, TaskResults, axes_of, grid, sampled
from lag2fmu.studies.engines import run_part
from lag2fmu.studies.parts import PartStore
from lag2fmu.studies.system_tasks import task_of_system
from lag2fmu.studies.tasks import Wanted, task_of_fmu, task_of_model
from lag2fmu.systems.source import is_system
from lag2fmu.verify.inputs import Inputs
from lag2fmu.verify.plan import check_tolerance
from lag2fmu.verify.run import Run

_PART = {"mechanism": 2000, "fmu": 20, "system": 20}
"""The number of runs in a part."""
_AHEAD = 64
"""The most parts that wait on an executor at a time."""
_ATTEMPTS = 3
"""How often a part is sent in all, if its workers are lost."""

Progress = Callable[[int, int], None]
"""A function that is called with the number of runs that are done, and the number of all runs."""


@telling("sweeping")
def sweep(  # noqa: PLR0913 (choices of the user)
    model: Any,
    vary: Mapping[Any, Any],
    *,
    sample: int | None = None,
    sampling: str = "random",
    seed: int = 0,
    outputs: Sequence[str] | None = None,
    at_end: bool = False,
    times: Sequence[float] | Floats | None = None,
    stop_time: float | None = None,
    values: Mapping[str, float] | None = None,
    inputs: Inputs | None = None,
    hold: bool = False,
    tolerance: float | None = None,
    solver: str | None = None,
    executor: Executor | None = None,
    part: int | None = None,
    path: str | Path | None = None,
    progress: Progress | None = None,
) -> Any:
    """Run ``model`` over all values that ``vary`` describes; it is a mechanism, what ``load`` takes, any FMU, or
    the path of a system, .ssp or .ssd, whose names are COMPONENT.VARIABLE.

    ``vary`` {name: values (n,)} gives the full grid; {(name, name): (n, 2)} are columns that vary together. With
    ``sample``, the number of runs, these are drawn, and {name: (low, high)} is a range; ``sampling`` is "random",
    "sobol", "halton" or "latin". ``outputs`` are read at ``times`` (m,) in s, by default at 101 times, or with
    ``at_end`` at the end only. ``values``, ``inputs`` and ``hold`` are those of ``simulate``. All values are in SI
    units.

    ``executor`` is any concurrent.futures.Executor; it gets parts of ``part`` runs. With ``path`` (.nc, .parquet) the
    result is written there. Parts that are done are kept beside it until then, so that the same call goes on after an
    interruption. Returns an xarray.Dataset, in which ``failed`` and ``reason`` tell of runs that failed. Raises
    LoadError for bad arguments, SimulationError where an executor fails.
    """
    target = None if path is None else Path(path)
    check_path(target)
    if tolerance is not None:
        check_tolerance(tolerance)
    if outputs is not None:
        check_names("outputs", outputs)
    axes = axes_of(vary)
    run = Run(stop_time, None, tolerance, values, hold=hold, outputs=outputs)
    wanted = Wanted(run, inputs, at_end, times, solver)
    design = grid(axes) if sample is None else sampled(axes, sample, sampling, seed)
    if is_system(model):
        task, units, title = task_of_system(Path(str(model)), design, wanted)
    elif is_fmu(model):
        task, units, title = task_of_fmu(model, design, wanted)
    else:
        task, units, title = task_of_model(model, design, wanted, threads=1 if executor else None)
    store = PartStore(target, task, design, _size(part, task, len(design)))
    try:
        _make_parts(store, task, design, executor, progress or (lambda done, total: reached(done / total)))
    except BaseException:
        store.leave()
        raise
    found = dataset(store, task, design, units, title)
    if target is not None:
        save(found, target)
        store.remove()
    return found


def _size(part: int | None, task: SweepTask, runs: int) -> int:
    if part is not None and part < 1:
        raise LoadError(f"parts of {part} runs are asked for; give at least 1")
    return min(part or _PART[task.kind], runs)


def _make_parts(
    store: PartStore, task: SweepTask, design: Design, executor: Executor | None, progress: Progress
) -> None:
    """Make the parts that are missing, here or on the executor."""
    missing = store.missing()
    done = len(design) - sum(len(design.values[store.rows(i)]) for i in missing)
    progress(done, len(design))
    rows = {number: design.values[store.rows(number)] for number in missing}
    for number, part in _here(task, rows) if executor is None else _there(task, rows, executor):
        store.put(number, part)
        done += len(part.values)
        progress(done, len(design))


def _here(task: SweepTask, rows: Mapping[int, Floats]) -> Iterator[tuple[int, TaskResults]]:
    for number, values in rows.items():
        yield number, run_part(task, values)


def _there(task: SweepTask, rows: Mapping[int, Floats], executor: Executor) -> Iterator[tuple[int, TaskResults]]:
    """(number, part) of each part when it is done; a part that is lost with its worker is sent again."""
    left: list[int] = sorted(rows, reverse=True)
    attempts = dict.fromkeys(left, 0)
    running: dict[Future[TaskResults], int] = {}
    try:
        while left or running:
            while left and len(running) < _AHEAD:
                number = left.pop()
                attempts[number] += 1
                running[_submitted(executor, task, rows[number])] = number
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                number = running.pop(future)
                error = future.exception()
                if error is None:
                    yield number, future.result()
                elif isinstance(error, LoadError):
                    raise error
                elif attempts[number] >= _ATTEMPTS:
                    what = f"a part of the runs failed on the executor {_ATTEMPTS} times"
                    raise SimulationError(f"{what}: {type(error).__name__}: {error}; what was done is kept") from error
                else:
                    left.append(number)
    finally:
        for future in running:
            future.cancel()


def _submitted(executor: Executor, task: SweepTask, rows: Floats) -> Future[TaskResults]:
    try:
        return executor.submit(run_part, task, rows)
    except RuntimeError as error:  # the executor is broken or shut down
        raise SimulationError(f"the executor takes no more runs: {error}; what was done is kept") from error
