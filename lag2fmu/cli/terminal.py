"""What is shown on a terminal: tables on standard output, progress on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lag2fmu.language.units import Unit
    from lag2fmu.reference.trajectory import Trajectory
    from lag2fmu.verify.report import Report


def console() -> Any:
    """The console of rich, as wide as the terminal; 110 columns where the output goes elsewhere."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else 110)


def print_report(report: Report) -> None:
    """Print the checks with their values and bars."""
    console().print(report.table())


def print_summary(trajectory: Trajectory, units: Mapping[str, Unit]) -> None:
    """Print start, extremes and end of every output, in ``units`` where they are known."""
    from rich.markup import escape
    from rich.table import Table

    from lag2fmu.mechanism.display import named

    table = Table(title=f"0 to {trajectory.time[-1]:g} s, {len(trajectory)} points", title_justify="left")
    for heading in ("output", "start", "least", "greatest", "end"):
        table.add_column(heading, justify="left" if heading == "output" else "right")
    for name in trajectory.names:
        column = units[name].from_si(trajectory[name]) if name in units else trajectory[name]
        numbers = (column[0], column.min(), column.max(), column[-1])
        table.add_row(escape(named(name, units)), *(f"{x:.9g}" for x in numbers))
    console().print(table)


@contextmanager
def progress_bar(title: str, total: float | None) -> Iterator[Callable[[float], None] | None]:
    """A progress bar with the elapsed time on a terminal's standard error, else nothing: what sets how far it is."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=total)
        yield lambda completed: bar.update(task, completed=completed)


@contextmanager
def build_progress() -> Iterator[Callable[[int, int, str], None] | None]:
    """The progress of the compiler: the share of the libraries that are done."""
    with progress_bar("building (the first build for a platform takes minutes)", 1.0) as update:
        yield None if update is None else lambda done, total, _: update(done / total)
