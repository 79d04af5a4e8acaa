"""How long controlled steps are, by steps that say their errors without any FMU."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import cast

from lag2fmu.systems.steps import ControlledSteps, FixedSteps


class Told:
    """Steps of which the first one fails; each may be longer than the last one by a fifth."""

    order, growth, circuit, begin, facts = 4, 1.2, None, None, None

    def __init__(self) -> None:
        self.lengths: list[float] = []

    @contextmanager
    def taken_back(self) -> Iterator[Callable[[], None]]:
        yield lambda: None

    def make(self, t: float, h: float, *, last: bool) -> tuple[float, float]:
        self.lengths.append(h)
        return (math.inf, math.inf) if len(self.lengths) == 1 else (0.0, 0.0)

    def accept(self, h: float, error: float, *, jumps: bool = False) -> None:
        """It is known already."""

    def reject(self) -> None:
        """It is known already."""


def test_divided_steps_grow_to_one_again() -> None:
    """Also by less than what lies between two parts and one."""
    told = Told()
    steps = ControlledSteps(cast("FixedSteps", told), 1e-6, 1.0)
    for t in range(8):
        steps.advance(float(t), t + 1.0)
    assert told.lengths[:2] == [1.0, 0.2]
    assert told.lengths[-1] == 1.0
