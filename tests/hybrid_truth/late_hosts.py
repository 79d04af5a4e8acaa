"""Hosts of model exchange with fixed steps that locate no events, as many real-time and block simulators are."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from compiling import compiled
from numpy.typing import NDArray
from stepping import WARNING, Stepping

from lag2fmu.errors import SimulationError

Floats = NDArray[np.float64]
EULER = ((0.0,), (1.0,))
RK4 = ((0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6))
"""Places and weights of the stages; each stage begins with the slope of the one before."""
_FUNCTIONS = (
    *("SetTime", "SetContinuousStates", "GetContinuousStates", "GetDerivatives", "GetEventIndicators"),
    *("CompletedIntegratorStep", "EnterEventMode", "NewDiscreteStates", "EnterContinuousTimeMode"),
)
_ARRAYS = ("place", "weight", "x", "start", "slope", "sum", "indicators", "signs")


class _LateHost(ctypes.Structure):
    """The structure of late_host.c."""

    _fields_ = [
        *((name, ctypes.c_void_p) for name in ("component", *_FUNCTIONS)),
        *((name, ctypes.c_size_t) for name in ("states", "events", "stages")),
        *((name, ctypes.c_void_p) for name in _ARRAYS),
        ("next_time", ctypes.c_double),
    ]


@cache
def _library() -> ctypes.CDLL:
    text = (Path(__file__).parent / "late_host.c").read_text("utf-8")
    folder = Path(tempfile.mkdtemp(prefix="late_host"))
    return compiled(folder, {"late_host.c": text}, units=("late_host.c",))


def fixed_steps(
    path: Path,
    values: Mapping[str, float],
    names: Sequence[str],
    stop: float,
    step: float,
    method: tuple[tuple[float, ...], tuple[float, ...]],
    every: int = 1,
) -> tuple[Floats, Floats]:
    """The values of ``names`` after each ``every``-th step, (m, names), and the indicators there, (m, events).

    An event is seen after the step in which an indicator changes its sign, and passed there. Raises SimulationError
    where a function of the FMU fails.
    """
    with Stepping(path, kind="ModelExchange") as fmu:
        host = _Host(fmu.start(values, stop_time=stop), method)
        rows, indicators = [_values(fmu, names)], [host.indicators().copy()]
        for i in range(every, round(stop / step) + 1, every):
            host.steps(step, i - every, i)
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
    """Steps of one instance in continuous-time mode, in C."""

    def __init__(self, fmu: Stepping, method: tuple[tuple[float, ...], tuple[float, ...]]) -> None:
        states, events = fmu.description.numberOfContinuousStates, fmu.description.numberOfEventIndicators
        sizes = {"indicators": events, "signs": events}
        place, weight = map(np.array, method)
        self.arrays = {name: np.zeros(sizes.get(name, states)) for name in _ARRAYS} | {"place": place, "weight": weight}
        functions = {f: ctypes.cast(getattr(fmu.unit.dll, f"fmi2{f}"), ctypes.c_void_p).value for f in _FUNCTIONS}
        pointers = {name: array.ctypes.data for name, array in self.arrays.items()}
        sized = {"states": states, "events": events, "stages": len(place)}
        component = ctypes.cast(fmu.unit.component, ctypes.c_void_p).value
        self.host = _LateHost(component=component, next_time=np.inf, **functions, **sized, **pointers)
        self._succeed(_library().late_begin(ctypes.byref(self.host)), 0.0)

    def indicators(self) -> Floats:
        """The present indicators, (events,), in an array that the next call fills again."""
        host, indicators = self.host, self.arrays["indicators"]
        get = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)(host.GetEventIndicators)
        self._succeed(get(host.component, host.indicators, host.events), 0.0)
        return indicators

    def steps(self, length: float, first: int, end: int) -> None:
        """Make the steps ``first`` to ``end`` - 1 of this ``length``, s."""
        made = _library().late_steps(
            ctypes.byref(self.host), ctypes.c_double(length), ctypes.c_size_t(first), ctypes.c_size_t(end)
        )
        self._succeed(made, end * length)

    @staticmethod
    def _succeed(status: int, time: float) -> None:
        if status > WARNING:
            raise SimulationError(f"a function of the FMU returns the status {status} before time {time:g}")
