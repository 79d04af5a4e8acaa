"""What takes long shows how it gets on: a bar on a terminal or in a notebook, else a line now and then.

Public functions carry the decorator ``telling``. Of functions within each other the outermost one shows itself. A
caller that gives ``progress`` is told instead. The environment variable LAG2FMU_QUIET, if it is not empty, switches
all of this off, and worker processes show nothing.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, ParamSpec, TypeVar

QUIET = "LAG2FMU_QUIET"
"""The environment variable that switches bars and lines off."""
AFTER, EVERY = 2.0, 10.0
"""Seconds until something is shown, and between two lines where there is no terminal."""

P = ParamSpec("P")
R = TypeVar("R")

_only_one = threading.Lock()
_tell: list[Callable[[float], None]] = []
"""The function that the work on show tells its share, if there is such work."""


def reached(share: float) -> None:
    """Tell what is on show, if anything, which ``share`` of the work is done, 0 to 1."""
    for tell in _tell:
        tell(share)


def telling(title: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A decorator: the function is on show under ``title``, unless it is given the argument ``progress``."""

    def decorated(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def told(*args: P.args, **kwargs: P.kwargs) -> R:
            with progress_bar(title, 1.0, after=AFTER, hidden=kwargs.get("progress") is not None) as update:
                if update is not None:
                    _tell.append(update)
                try:
                    return function(*args, **kwargs)
                finally:
                    if update is not None:
                        _tell.remove(update)

        return told

    return decorated


@contextmanager
def progress_bar(
    title: str, total: float | None, counted: str = "", *, after: float = 0.0, hidden: bool = False
) -> Iterator[Callable[[float], None] | None]:
    """A bar with elapsed and remaining time on standard error, from ``after`` seconds on, else lines.

    The context yields a function that is called with the amount of work done, out of ``total``. Before the first call,
    and without a total, only the elapsed time is shown. ``counted`` is the word for counted things, if any. The
    function is None where nothing is drawn: there is no terminal, the work is ``hidden``, or other work is on show.
    """
    first = _only_one.acquire(blocking=False)
    try:
        if not first or hidden or os.environ.get(QUIET) or _in_worker():
            yield None
        elif sys.stderr.isatty() or _in_notebook():
            with _bar(title, total, counted, after) as update:
                yield update
        else:
            with _lines(title):
                yield None
    finally:
        if first:
            _only_one.release()


def _in_worker() -> bool:
    """Whether another process started this one to share its work; such a process has the module of processes."""
    return getattr(sys.modules.get("multiprocessing"), "parent_process", lambda: None)() is not None


def _in_notebook() -> bool:
    """Whether this is a kernel of Jupyter, which shows what is written over a line as a terminal does."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell"


@contextmanager
def _lines(title: str) -> Iterator[None]:
    """A line on standard error after AFTER seconds, and then every EVERY seconds: what takes so long, and how long."""
    ended, begin = threading.Event(), time.monotonic()

    def write() -> None:
        wait = min(AFTER, EVERY)
        while not ended.wait(wait):
            print(f"{title}: {time.monotonic() - begin:.0f} s", file=sys.stderr, flush=True)
            wait = EVERY

    threading.Thread(target=write, daemon=True).start()
    try:
        yield
    finally:
        ended.set()


@contextmanager
def _bar(title: str, total: float | None, counted: str, after: float) -> Iterator[Callable[[float], None]]:
    """The bar of rich, which is not drawn before ``after`` seconds."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    left: tuple[Any, ...] = (TextColumn("left"), TimeRemainingColumn(elapsed_when_finished=False)) if total else ()
    count = (TextColumn(f"{{task.completed:.0f}} {counted}"),) if counted else ()
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), *count, TimeElapsedColumn(), *left)
    notebook = {"force_terminal": True, "force_jupyter": False, "width": 80} if _in_notebook() else {}
    bar = Progress(*columns, console=Console(stderr=True, **notebook), transient=True)  # type: ignore[arg-type]
    task = bar.add_task(title, total=None)
    starting = threading.Timer(after, bar.start)
    starting.daemon = True
    starting.start()
    try:
        yield lambda completed: bar.update(task, completed=completed, total=total)
    finally:
        starting.cancel()
        starting.join()
        if bar.live.is_started:
            bar.stop()
