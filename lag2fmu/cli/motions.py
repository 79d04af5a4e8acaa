"""The motion of a run, written as CSV or summed up in a table."""

from __future__ import annotations

from collections.abc import Mapping

import click
from rich.markup import escape
from rich.table import Table

from lag2fmu.cli.terminal import console
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import named
from lag2fmu.reference.trajectory import Trajectory


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
