"""The work of the verb ``sweep``."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import click

from lag2fmu.cli.fmu_settings import values_of_fmu
from lag2fmu.cli.options import refuse_to_overwrite
from lag2fmu.cli.settings import echo_settings, load_mechanism
from lag2fmu.cli.system_units import units_of_network
from lag2fmu.cli.terminal import runs_bar
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.fmu.exported import is_fmu
from lag2fmu.formats.loading import pairs_of, values_of
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units
from lag2fmu.reference.trajectory import read_csv
from lag2fmu.studies.sweeping import sweep
from lag2fmu.studies.vary_texts import axes_of_texts, numbers_of_text
from lag2fmu.systems.network import network_of_file
from lag2fmu.systems.running import start_values
from lag2fmu.systems.source import is_system
from lag2fmu.verify import entry_points


@dataclass(frozen=True)
class SweepOptions:
    """The options of ``sweep``, by their names."""

    model: str
    vary: tuple[str, ...]
    sample: int | None
    sampling: str
    seed: int
    outputs: tuple[str, ...]
    at_end: bool
    times: str | None
    stop_time: float | None
    tolerance: float | None
    solver: str | None
    inputs: Path | None
    hold: bool
    workers: int | None
    out: Path
    force: bool
    settings: tuple[str, ...]


def sweep_model(asked: SweepOptions) -> None:
    """Make the runs and write the result.

    Raises Lag2FmuError for a model or options that do not fit, and SimulationError if all runs fail.
    """
    refuse_to_overwrite(asked.out, force=asked.force)
    source, values, units = _source(asked.model, asked.settings)
    axes = axes_of_texts(pairs_of(asked.vary), units, sampled=asked.sample is not None)
    with runs_bar() as progress, _pool(asked.workers) as executor:
        found = sweep(
            source,
            {axis.names: axis for axis in axes},
            sample=asked.sample,
            sampling=asked.sampling,
            seed=asked.seed,
            outputs=asked.outputs or None,
            at_end=asked.at_end,
            times=None if asked.times is None else numbers_of_text("--times", asked.times),
            stop_time=asked.stop_time,
            values=values,
            inputs=None if asked.inputs is None else read_csv(asked.inputs, units),
            hold=asked.hold,
            tolerance=asked.tolerance,
            solver=asked.solver,
            executor=executor,
            path=asked.out,
            progress=progress,
        )
    _say(found, asked.out)


def _say(found: Any, out: Path) -> None:
    failed = int(found["failed"].sum())
    click.echo(f"wrote {out}: {found['failed'].size} runs, {failed} failed", err=True)
    if failed:
        reason = found["reason"].values[found["failed"].values][0]
        if failed == found["failed"].size:
            raise SimulationError(f"all {failed} runs failed; the first one: {reason}")
        click.echo(f"the first failure: {reason}", err=True)


def _source(model: str, settings: tuple[str, ...]) -> tuple[Any, dict[str, float], dict[str, Unit]]:
    """(what to run, values (SI) of each run, {name: unit})."""
    if is_system(model):
        texts = pairs_of(settings)
        with network_of_file(Path(model)) as network:
            units = units_of_network(network)
            values = values_of(texts, units)
            start_values(network, values)  # raises for what cannot be set, before it is shown as set
        echo_settings(texts, units)
        return Path(model), values, units
    if not is_fmu(Path(model)):
        mechanism = load_mechanism(model, settings)
        return mechanism, {}, display_units(mechanism)
    texts, inside = pairs_of(settings), entry_points.mechanism_of(Path(model))
    units = {} if inside is None else display_units(inside)
    return Path(model), values_of_fmu(Path(model), texts, units), units


@contextmanager
def _pool(workers: int | None) -> Iterator[Executor | None]:
    if workers is None:
        yield None
        return
    if workers < 1:
        raise LoadError(f"--workers {workers}: give at least 1")
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield pool
