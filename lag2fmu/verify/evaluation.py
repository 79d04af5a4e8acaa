"""An FMU's equations at single states, without a simulation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from ctypes import c_double
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lag2fmu.errors import SimulationError
from lag2fmu.verify.co_simulation import Reader, Writer, settle
from lag2fmu.verify.instances import Instance, instance_of, is_fmi3, offers_model_exchange
from lag2fmu.verify.scalars import scalars_of

Floats = NDArray[np.float64]


class Evaluation(Protocol):
    """An instance in a mode where states can be set."""

    def evaluate(self, values: Mapping[str, float], names: Sequence[str]) -> Floats:
        """Set ``values`` (states, inputs and parameters, SI) and get ``names``: (len(names),).

        Raises SimulationError where the FMU refuses.
        """
        ...


@contextmanager
def evaluation(path: Path, time: float) -> Iterator[Evaluation]:
    """An ``Evaluation`` of the FMU ``path`` at ``time`` (s); raises SimulationError if it cannot be made.

    The instance is in continuous-time mode of model exchange. If the FMU has no model exchange, it is in initialization
    mode of co-simulation.
    """
    kind = "ModelExchange" if offers_model_exchange(path) else "CoSimulation"
    with instance_of(path, kind) as instance:
        yield _begun(instance, path, time)


def _begun(instance: Instance, path: Path, time: float) -> Evaluation:
    fmu = instance.fmu
    try:
        if is_fmi3(instance.description):
            fmu.enterInitializationMode(startTime=time)
            fmu.exitInitializationMode()
            return _OfFmi3(instance, path)
        fmu.setupExperiment(startTime=time)
        fmu.enterInitializationMode()
        if offers_model_exchange(path):
            fmu.exitInitializationMode()
            fmu.newDiscreteStates()
            fmu.enterContinuousTimeMode()
        return _OfFmi2(instance)
    except Exception as error:  # fmpy raises bare exceptions
        raise SimulationError(f"the FMU could not begin at t = {time:g} s: {error}; {instance.log.tail()}") from error


class _OfFmi2:
    """An ``Evaluation`` by FMI 2.0: all states, inputs and tunable parameters are set in continuous-time mode."""

    def __init__(self, instance: Instance) -> None:
        self._instance = instance
        self._references = {v.name: v.valueReference for v in instance.description.modelVariables}
        self._has_modes = bool(instance.description.numberOfEventIndicators)

    def evaluate(self, values: Mapping[str, float], names: Sequence[str]) -> Floats:
        """As ``Evaluation`` says."""
        fmu = self._instance.fmu
        try:
            fmu.setReal([self._references[name] for name in values], list(values.values()))
            if self._has_modes:
                fmu.enterEventMode()
                fmu.newDiscreteStates()
                fmu.enterContinuousTimeMode()
            return np.array(fmu.getReal([self._references[name] for name in names]))
        except Exception as error:  # fmpy raises bare exceptions
            raise SimulationError(f"the FMU could not be evaluated: {error}; {self._instance.log.tail()}") from error


class _OfFmi3:
    """An ``Evaluation`` by FMI 3.0: inputs and parameters are set in event mode, states in continuous-time mode.

    Where there are event indicators, another event follows the states: kinks turn to their sides of them.
    """

    def __init__(self, instance: Instance, path: Path) -> None:
        self._instance, self._scalars = instance, scalars_of(instance.description, path)
        derived = [unknown.variable.derivative.valueReference for unknown in instance.description.derivatives]
        own = [s for s in self._scalars.values() if not s.variable.alias]
        self._states = [s.name for reference in derived for s in own if s.reference == reference]
        self._writers: dict[tuple[str, ...], Writer] = {}
        self._readers: dict[tuple[str, ...], Reader] = {}
        self._has_modes = bool(instance.description.numberOfEventIndicators)
        settle(instance.fmu)
        self._instance.fmu.enterContinuousTimeMode()

    def evaluate(self, values: Mapping[str, float], names: Sequence[str]) -> Floats:
        """As ``Evaluation`` says."""
        fmu, n, found = self._instance.fmu, len(self._states), np.empty(len(names))
        others = tuple(name for name in values if name not in self._states)
        writer = self._writers.setdefault(others, Writer(fmu, self._scalars, others))
        reader = self._readers.setdefault(tuple(names), Reader(fmu, self._scalars, names))
        x = (c_double * n)()
        try:
            fmu.enterEventMode()
            writer.write([values[name] for name in others])
            settle(fmu)
            fmu.enterContinuousTimeMode()
            fmu.getContinuousStates(x, n)
            x[:] = [values.get(name, x[i]) for i, name in enumerate(self._states)]
            fmu.setContinuousStates(x, n)
            if self._has_modes:
                fmu.enterEventMode()
                settle(fmu)
                fmu.enterContinuousTimeMode()
            reader.read(found)
        except Exception as error:  # fmpy raises bare exceptions
            raise SimulationError(f"the FMU could not be evaluated: {error}; {self._instance.log.tail()}") from error
        return found
