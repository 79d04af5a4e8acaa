"""What ``sweep`` does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import click
import numpy as np

from lag2fmu.cli.settings import echo_settings, load_mechanism
from lag2fmu.cli.terminal import runs_bar
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import pairs_of, values_of
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units, value_in_si
from lag2fmu.reference.csv_tables import csv_text, parse_columns
from lag2fmu.reference.trajectory import Floats, read_csv
from lag2fmu.studies.design import Axis
from lag2fmu.studies.sweeping import sweep
from lag2fmu.verify import entry_points


def sweep_model(  # noqa: PLR0913, PLR0917 (an option each)
    model: str,
    vary: tuple[str, ...],
    sample: int | None,
    sampling: str,
    seed: int,
    outputs: tuple[str, ...],
    at_end: bool,
    times: str | None,
    stop_time: float | None,
    tolerance: float | None,
    solver: str | None,
    inputs: Path | None,
    hold: bool,
    workers: int | None,
    out: Path,
    settings: tuple[str, ...],
) -> None:
    """Make the runs and write the result; raises Lag2FmuError."""
    source, values, units = _source(model, settings)
    axes = axes_of_texts(pairs_of(vary), units, sampled=sample is not None)
    with runs_bar() as progress, _pool(workers) as executor:
        found = sweep(
            source,
            {axis.names: axis for axis in axes},
            sample=sample,
            sampling=sampling,
            seed=seed,
            outputs=outputs or None,
            at_end=at_end,
            times=None if times is None else _numbers("--times", times),
            stop_time=stop_time,
            values=values,
            inputs=None if inputs is None else read_csv(inputs, units),
            hold=hold,
            tolerance=tolerance,
            solver=solver,
            executor=executor,
            path=out,
            progress=progress,
        )
    _say(found, out)


def _say(found: Any, out: Path) -> None:
    failed = int(found["failed"].sum())
    click.echo(f"wrote {out}: {found['failed'].size} runs, {failed} failed", err=True)
    if failed:
        reasons = found["reason"].values[found["failed"].values]
        click.echo(f"the first failure: {reasons[0]}", err=True)


def _source(model: str, settings: tuple[str, ...]) -> tuple[Any, dict[str, float], dict[str, Unit]]:
    """What to run, values for each run (SI), and the units of names."""
    if not entry_points.is_fmu(Path(model)):
        mechanism = load_mechanism(model, settings)
        return mechanism, {}, display_units(mechanism)
    texts, inside = pairs_of(settings), entry_points.mechanism_of(Path(model))
    units = {} if inside is None else display_units(inside)
    echo_settings(texts, units)
    return Path(model), values_of(texts, units), units


@contextmanager
def _pool(workers: int | None) -> Iterator[Executor | None]:
    if workers is None:
        yield None
        return
    if workers < 1:
        raise LoadError(f"--workers {workers}: give at least 1")
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield pool


def axes_of_texts(texts: Mapping[str, str], units: Mapping[str, Unit], *, sampled: bool) -> list[Axis]:
    """The axes that ``NAME=A:B:N``, ``NAME=V,V,...`` and ``NAME=@CSV`` mean; columns of one table vary together.

    Raises LoadError for a text of another form.
    """
    axes, tables = [], dict[str, list[str]]()
    for name, text in texts.items():
        if text.startswith("@"):
            tables.setdefault(text[1:], []).append(name)
        elif ":" in text:
            axes.append(_range(name, text, units, sampled=sampled))
        else:
            axes.append(
                Axis((name,), np.array([value_in_si(name, v.strip(), units) for v in text.split(",")])[:, None])
            )
    return [*axes, *(_table(Path(file), names, units) for file, names in tables.items())]


def _range(name: str, text: str, units: Mapping[str, Unit], *, sampled: bool) -> Axis:
    parts = [part.strip() for part in text.split(":")]
    usage = f"--vary {name}={text}: give {name}=A:B:N, N values from A to B"
    if len(parts) not in ((2, 3) if sampled else (3,)) or not all(parts):
        raise LoadError(usage + (" (or A:B, a range)" if sampled else "; only --sample takes A:B"))
    low, high = (value_in_si(name, part, units) for part in parts[:2])
    if len(parts) == 2:
        if not low < high:
            raise LoadError(f"--vary {name}={text}: the range is empty; A has to be less than B")
        return Axis((name,), None, low, high)
    if not parts[2].isdigit() or int(parts[2]) < 1:
        raise LoadError(f"{usage}; '{parts[2]}' is no number of values")
    return Axis((name,), np.linspace(low, high, int(parts[2]))[:, None])


def _table(file: Path, names: Sequence[str], units: Mapping[str, Unit]) -> Axis:
    """The columns ``names`` of a table; raises LoadError for one that is missing."""
    found, table = parse_columns(csv_text(file), str(file), units)
    for name in names:
        if name not in found:
            raise LoadError(f"'{file}' has no column '{name}'; there are {', '.join(found)}")
    return Axis(tuple(names), table[:, [found.index(name) for name in names]])


def _numbers(option: str, text: str) -> Floats:
    try:
        return np.array([float(part) for part in text.split(",")])
    except ValueError:
        raise LoadError(f"{option} {text}: give numbers between commas") from None
