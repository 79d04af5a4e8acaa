"""Time that a piece of work may take: whoever starts it sets the bound, and its loops look at the clock.

The bound is ambient, as the cancel scopes of trio are (N. J. Smith, Timeouts and cancellation for humans, 2018). So it
reaches loops far below without an argument in every function between. The clock is the CPU time of the thread: what is
reached in a given time does not depend on what else the machine does.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TypeVar

LIMIT = 60.0
"""The CPU time, in s, that a direct integration or an analysis may take where the user gives no other."""


EARLY = 0.1
"""The part of work, and of the time for it, that tells whether the time is enough."""

Piece = TypeVar("Piece")


@dataclass
class _Bound:
    """The end of the work, in CPU time of the thread, and the time of the wall clock before which it is not reached.

    A thread needs no more CPU time than passes on the wall. Reading the wall clock is a hundred times faster than
    reading the CPU time, which asks the kernel.
    """

    end: float
    not_before: float = -math.inf


_bound: ContextVar[_Bound] = ContextVar("bound", default=_Bound(math.inf, math.inf))  # noqa: B039  never written to


class OutOfTimeError(Exception):
    """The time is over; it is caught by whoever set the bound, and no user sees it."""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Bound the CPU time of the work inside by ``seconds``, and by what is left of an outer bound."""
    token = _bound.set(_Bound(min(_bound.get().end, time.thread_time() + seconds)))
    try:
        yield
    finally:
        _bound.reset(token)


def seconds_left() -> float:
    """The CPU time, in s, until the innermost bound; infinite without one, negative where it is over."""
    return _bound.get().end - time.thread_time()


def check_time() -> None:
    """Raise OutOfTimeError if the time is over; loops that may be long call it at every turn."""
    bound = _bound.get()
    if time.perf_counter() < bound.not_before:
        return
    now, left = time.perf_counter(), seconds_left()
    if left < 0.0:
        raise OutOfTimeError
    bound.not_before = now + left


def paced(items: Sequence[Piece]) -> Iterator[Piece]:
    """The ``items``, one after another, each of which takes the caller some time.

    Raises OutOfTimeError where the time is over, and as soon as a tenth of it was enough for less than a tenth of them.
    """
    begin, first = time.thread_time(), seconds_left()
    for done, item in enumerate(items):
        check_time()
        spent = time.thread_time() - begin
        if spent > EARLY * first and done < EARLY * len(items):
            raise OutOfTimeError
        yield item


class Budget:
    """CPU time for several pieces of work with other work between them, that takes nothing from it."""

    def __init__(self, seconds: float) -> None:
        """``seconds`` for all pieces together."""
        self.left = seconds

    @contextmanager
    def spent(self, share: float = 1.0) -> Iterator[None]:
        """Bound the work inside by this ``share`` of what is left, and take from it what the work needs."""
        begin = time.thread_time()
        try:
            with within(share * self.left):
                yield
        finally:
            self.left -= time.thread_time() - begin
