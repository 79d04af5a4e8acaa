"""Output on a terminal: tables on standard output, progress on standard error."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from lag2fmu.progress import progress_bar


def console(*, error: bool = False) -> Any:
    """The console of rich, on standard output or ``error``: as wide as the terminal, or 110 columns without one."""
    from rich.console import Console

    return Console(width=None if (sys.stderr if error else sys.stdout).isatty() else 110, stderr=error)


def knows_unicode() -> bool:
    """Whether standard output is a terminal that shows Greek letters and dots above them."""
    encoding = (sys.stdout.encoding or "").lower().replace("-", "")
    return sys.stdout.isatty() and encoding == "utf8" and os.environ.get("TERM", "") not in {"dumb", "linux"}


@contextmanager
def runs_bar() -> Iterator[Callable[[int, int], None] | None]:
    """A bar of runs on a terminal's standard error, with their rate and the time left.

    The context yields a function of (runs done, total), or None without a terminal, where lines are written.
    """
    if not sys.stderr.isatty():
        with progress_bar("runs", None):
            yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    rate = TextColumn("{task.fields[rate]}")
    with Progress(BarColumn(), MofNCompleteColumn(), rate, TimeRemainingColumn(), console=Console(stderr=True)) as bar:
        task = bar.add_task("runs", total=None, rate="")

        def update(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)
            speed = bar.tasks[task].speed
            bar.update(task, rate=f"{speed:.3g} runs/s" if speed else "")

        yield update


@contextmanager
def build_progress() -> Iterator[Callable[[int, int, str], None] | None]:
    """The progress of compilation: the share of the libraries that are built."""
    with progress_bar("building (the first one for a platform takes longer)", 1.0) as update:
        yield None if update is None else lambda done, total, _: update(done / total)
