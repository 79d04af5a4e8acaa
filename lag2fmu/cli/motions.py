"""What ``simulate`` is asked for, of whatever model; and the motion of a run, as CSV or summed up in a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import click
from rich.markup import escape
from rich.table import Table

from lag2fmu.cli.options import CSV, check_ending, check_picture, refuse_to_overwrite
from lag2fmu.cli.terminal import console
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import named
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.systems.coupling import Coupling
from lag2fmu.systems.source import is_system


@dataclass(frozen=True)
class SimulateOptions:
    """The options of ``simulate``, by their names."""

    models: tuple[str, ...]
    connect: tuple[str, ...]
    join: tuple[str, ...]
    apart: bool
    patience: float | None
    coupling: Coupling
    stop_time: float | None
    step: float | None
    tolerance: float | None
    solver: str | None
    inputs: Path | None
    hold: bool
    wanted: tuple[str, ...]
    out: str | None
    plot: Path | None
    animation: Path | None
    force: bool
    settings: tuple[str, ...]

    @property
    def model(self) -> str:
        """The model, where there is one."""
        return self.models[0]


def is_one_model(models: tuple[str, ...]) -> bool:
    """Whether these words are one mechanism or FMU: not a system, or components NAME=COMPONENT."""
    return len(models) == 1 and not is_system(models[0]) and ("=" not in models[0] or Path(models[0]).is_file())


def check_targets(asked: SimulateOptions) -> None:
    """Raise LoadError, before a long run, for a CSV file or a picture of another kind.

    Raises ExportError for a CSV file that exists, unless it may be overwritten.
    """
    check_picture(asked.plot)
    table = None if asked.out in (None, "-") else Path(str(asked.out))
    if table is not None:
        check_ending(table, CSV)
        refuse_to_overwrite(table, force=asked.force)


def write_motion(trajectory: Trajectory, out: str | None, units: Mapping[str, Unit]) -> None:
    """Write the trajectory in ``units`` as CSV to the file ``out``, or "-" for standard output; None: a summary."""
    if out == "-":
        click.echo(trajectory.to_csv(units), nl=False)
    elif out is not None:
        trajectory.write_csv(out, units)
        click.echo(f"wrote {out}", err=True)
    else:
        _print_summary(trajectory, units)


def _print_summary(trajectory: Trajectory, units: Mapping[str, Unit]) -> None:
    """Print start, extremes and end of every output, in ``units`` where they are known."""
    table = Table(title=f"0 to {trajectory.time[-1]:g} s, {len(trajectory)} points", title_justify="left")
    for heading in ("output", "start", "least", "greatest", "end"):
        table.add_column(heading, justify="left" if heading == "output" else "right", overflow="fold")
    for name in trajectory.names:
        column = units[name].from_si(trajectory[name]) if name in units else trajectory[name]
        numbers = (column[0], column.min(), column.max(), column[-1])
        table.add_row(escape(named(name, units)), *(f"{x + 0.0:.9g}" for x in numbers))
    console().print(table)
