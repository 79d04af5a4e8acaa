"""What is shown on a terminal: tables on standard output, progress on standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


def console() -> Any:
    """The console of rich, as wide as the terminal; 110 columns where the output goes elsewhere."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else 110)


def knows_unicode() -> bool:
    """Whether standard output is a terminal that shows Greek letters and dots above them."""
    encoding = (sys.stdout.encoding or "").lower().replace("-", "")
    return sys.stdout.isatty() and encoding == "utf8" and os.environ.get("TERM", "") not in {"dumb", "linux"}


@contextmanager
def progress_bar(title: str, total: float | None) -> Iterator[Callable[[float], None] | None]:
    """A progress bar with elapsed and remaining time on a terminal's standard error, else nothing.

    What it yields is told how far the work is, of ``total``. Without a total the bar only shows that work goes on.
    """
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    times = (TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(elapsed_when_finished=False))
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), *(times if total else times[:1]))
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=total)
        yield lambda completed: bar.update(task, completed=completed)


@contextmanager
def build_progress() -> Iterator[Callable[[int, int, str], None] | None]:
    """The progress of the compiler: the share of the libraries that are done."""
    with progress_bar("building (the first build for a platform takes minutes)", 1.0) as update:
        yield None if update is None else lambda done, total, _: update(done / total)
