"""Output on a terminal: tables on standard output, progress on standard error."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

EVERY = 10.0
"""Seconds between two lines of progress where there is no terminal."""


def console() -> Any:
    """The console of rich: as wide as the terminal, or of 110 columns if the output is no terminal."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else 110)


def knows_unicode() -> bool:
    """Whether standard output is a terminal that shows Greek letters and dots above them."""
    encoding = (sys.stdout.encoding or "").lower().replace("-", "")
    return sys.stdout.isatty() and encoding == "utf8" and os.environ.get("TERM", "") not in {"dumb", "linux"}


@contextmanager
def _lines(title: str) -> Iterator[None]:
    """A line on standard error EVERY so many seconds: what takes so long, and how long it has taken."""
    ended, begin = threading.Event(), time.monotonic()

    def write() -> None:
        while not ended.wait(EVERY):
            print(f"{title}: {time.monotonic() - begin:.0f} s", file=sys.stderr, flush=True)

    threading.Thread(target=write, daemon=True).start()
    try:
        yield
    finally:
        ended.set()


@contextmanager
def progress_bar(title: str, total: float | None, counted: str = "") -> Iterator[Callable[[float], None] | None]:
    """A progress bar with elapsed and remaining time on a terminal's standard error, else a line EVERY so often.

    The context yields a function that is called with the amount of work done, out of ``total``. Before the first call,
    and without a total, the bar shows the elapsed time only. ``counted`` is the word for counted things, if any.
    """
    if not sys.stderr.isatty():
        with _lines(title):
            yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    times = (TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(elapsed_when_finished=False))
    count = (TextColumn(f"{{task.completed:.0f}} {counted}"),) if counted else ()
    shown = times if total else (*count, times[0])
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), *shown)
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=None)
        yield lambda completed: bar.update(task, completed=completed, total=total)


@contextmanager
def runs_bar() -> Iterator[Callable[[int, int], None] | None]:
    """A bar of runs on a terminal's standard error, with their rate and the time left.

    The context yields a function of (runs done, total), or None without a terminal.
    """
    if not sys.stderr.isatty():
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
    with progress_bar("building (the first build for a platform takes minutes)", 1.0) as update:
        yield None if update is None else lambda done, total, _: update(done / total)
