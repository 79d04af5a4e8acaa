"""Hosts of model exchange with fixed steps that locate no events, as many real-time and block simulators are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from ctypes import POINTER, c_double, cast
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from stepping import Stepping

Floats = NDArray[np.float64]
EULER = ((0.0,), (1.0,))
RK4 = ((0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6))
"""Places and weights of the stages; each stage begins with the slope of the one before."""
_POINTER = POINTER(c_double)


def fixed_steps(
    path: Path,
    values: Mapping[str, float],
    names: Sequence[str],
    stop: float,
    step: float,
    method: tuple[tuple[float, ...], tuple[float, ...]],
    every: int = 1,
) -> tuple[Floats, Floats]:
    """The values of ``names`` after every so many steps (s), (m, names), and the indicators there, (m, events).

    An event is seen after the step in which an indicator changes its sign, and passed there.
    """
    with Stepping(path, kind="ModelExchange") as fmu:
        host = _Host(fmu.start(values, stop_time=stop), method)
        rows, indicators = [_values(fmu, names)], [host.z.copy()]
        for i in range(1, round(stop / step) + 1):
            host.step((i - 1) * step, step)
            if i % every == 0:
                rows.append(_values(fmu, names))
                indicators.append(host.indicators().copy())
        return np.array(rows), np.array(indicators)


def _values(fmu: Stepping, names: Sequence[str]) -> list[float]:
    """The present values of ``names``; modes are integers."""
    whole = [name for name in names if name.endswith("_mode")]
    real = [name for name in names if not name.endswith("_mode")]
    modes = fmu.unit.getInteger([fmu.references[name] for name in whole]) if whole else []
    values = dict(zip([*real, *whole], [*fmu.get(real), *modes], strict=True))
    return [values[name] for name in names]


class _Host:
    """Steps of one instance in continuous-time mode, by calls that do not pass through fmpy's wrappers."""

    def __init__(self, fmu: Stepping, method: tuple[tuple[float, ...], tuple[float, ...]]) -> None:
        self.unit, self.component, self.method = fmu.unit, fmu.unit.component, method
        self.x = np.zeros(fmu.description.numberOfContinuousStates)
        self.k = np.zeros_like(self.x)
        self.z = np.zeros(fmu.description.numberOfEventIndicators)
        self.next_time = np.inf
        self._begin()

    def _begin(self) -> None:
        self.unit.fmi2GetContinuousStates(self.component, cast(self.x.ctypes.data, _POINTER), self.x.size)
        self.signs = self.indicators() > 0

    def indicators(self) -> Floats:
        """The present indicators, (events,), in an array that the next call fills again."""
        self.unit.fmi2GetEventIndicators(self.component, cast(self.z.ctypes.data, _POINTER), self.z.size)
        return self.z

    def _move(self, time: float, x: Floats) -> None:
        self.unit.fmi2SetTime(self.component, time)
        self.unit.fmi2SetContinuousStates(self.component, cast(x.ctypes.data, _POINTER), x.size)

    def step(self, time: float, length: float) -> None:
        """Go from ``time`` on by ``length``, s, and pass the event that this step has come over, if any."""
        start, total = self.x.copy(), np.zeros_like(self.x)
        for place, weight in zip(*self.method, strict=True):
            if place > 0.0:
                self._move(time + place * length, start + place * length * self.k)
            self.unit.fmi2GetDerivatives(self.component, cast(self.k.ctypes.data, _POINTER), self.k.size)
            total += weight * self.k
        self.x[:] = start + length * total
        self._move(time + length, self.x)
        signs = self.indicators() > 0
        wanted, _ = self.unit.completedIntegratorStep()
        if wanted or (signs != self.signs).any() or time + length >= self.next_time:
            self._event()

    def _event(self) -> None:
        self.unit.enterEventMode()
        again = True
        while again:
            again, _, _, _, defined, when = self.unit.newDiscreteStates()
        self.next_time = when if defined else np.inf
        self.unit.enterContinuousTimeMode()
        self._begin()
