"""The component for WebAssembly in an FMU, run by wasmtime and driven call by call like ``Stepping3``."""

from __future__ import annotations

import itertools
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import fmpy
import wasmtime
from stepping3 import Stepping3
from wasmtime import component as binding

from lag2fmu.fmu.wasm.draft import FOLDER, LOGGER, interfaces

STATUS = interfaces()["types"].types["status"][1:]


def component_of(path: Path) -> bytes:
    """The component in the FMU ``path``."""
    with zipfile.ZipFile(path) as archive:
        (name,) = (name for name in archive.namelist() if name.startswith(f"binaries/{FOLDER}/"))
        return archive.read(name)


class ComponentUnit:
    """An instance of a component, with fmpy's names for its calls; ``log`` collects (status, category, sentence).

    A call that fails raises RuntimeError. ``component`` are the bytes, ``kind`` is 'CoSimulation' or 'ModelExchange'.
    """

    def __init__(self, component: bytes, kind: str, log: list[tuple[int, str, str]]) -> None:
        self._short = "co-simulation" if kind == "CoSimulation" else "model-exchange"
        engine = wasmtime.Engine()
        self._store, linker = wasmtime.Store(engine), binding.Linker(engine)
        self.names: list[str] = []

        def hear(_: object, name: str, status: str, category: str, message: str) -> None:
            self.names.append(name)
            log.append((STATUS.index(status), category, message))

        with linker.root() as root, root.add_instance(interfaces()["callbacks"].name) as callbacks:
            callbacks.add_func(LOGGER, hear)
        self._component = linker.instantiate(self._store, binding.Component(engine, component))
        self._self: Any = None

    def _function(self, name: str, short: str) -> Any:
        outer = self._component.get_export_index(self._store, interfaces()[short].name)
        index = self._component.get_export_index(self._store, name, outer)
        assert index is not None, name
        return self._component.get_func(self._store, index)

    def _called(self, name: str, *arguments: Any, short: str = "") -> Any:
        function = self._function(name, short or self._short)
        result = function(self._store, *arguments)
        function.post_return(self._store)
        return result

    def version(self) -> str:
        """The version of FMI."""
        return str(self._called("get-version", short="common"))

    def instantiate(self, *arguments: Any) -> bool:
        """Make the instance with the arguments of the draft; whether there is one."""
        resource = interfaces()[self._short].resource
        self._self = self._called(f"[static]{resource}.instantiate-{self._short}", *arguments)
        return self._self is not None

    def call(self, name: str, *arguments: Any) -> Any:
        """The result of a method by its name in WIT."""
        resource = interfaces()[self._short].resource
        result = self._called(f"[method]{resource}.{name}", self._self, *arguments)
        if isinstance(result, str) and result in STATUS[2:]:
            raise RuntimeError(f"{name}: {result}")
        return result

    def __getattr__(self, name: str) -> Any:
        """A method that takes and returns what the one in WIT does, by fmpy's ``name``."""
        if name.startswith("_"):
            raise AttributeError(name)
        words = "".join(f"-{c.lower()}" if c.isupper() else c for c in name).replace("f-m-u-", "fmu-")
        return lambda *arguments: self.call(words, *arguments)

    def enterInitializationMode(
        self, tolerance: float | None = None, startTime: float = 0.0, stopTime: Any = None
    ) -> None:
        self.call("enter-initialization-mode", tolerance, startTime, stopTime)

    def updateDiscreteStates(self) -> tuple[Any, ...]:
        return tuple(vars(self.call("update-discrete-states")).values())

    def doStep(self, point: float, step: float) -> tuple[bool, bool, bool, float]:
        last, event, terminate, early = vars(self.call("do-step", point, step, True)).values()
        return event, terminate, early, last

    def completedIntegratorStep(self) -> tuple[bool, bool]:
        event, terminate = vars(self.call("completed-integrator-step", True)).values()
        return event, terminate

    def freeInstance(self) -> None:
        self._self.drop(self._store)


class SteppingComponent(Stepping3):
    """The same as ``Stepping3`` with the component of the FMU ``path``."""

    def __init__(
        self, path: Path, kind: str = "CoSimulation", *, events: bool = False, early: bool = False, logging: bool = True
    ) -> None:
        self.description: Any = fmpy.read_model_description(str(path), validate=False)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.log: list[tuple[int, str, str]] = []
        self.unit: Any = ComponentUnit(component_of(path), kind, self.log)
        self.events, self.kind, self._follow = events or kind == "ModelExchange", kind, None
        arguments = [f"a component, {kind}", self.description.instantiationToken, "", False, logging]
        assert self.unit.instantiate(*arguments, *([events, early, []] if kind == "CoSimulation" else []))


def _vector(stepping: Stepping3, what: str, count: int) -> list[float]:
    """A vector of model exchange with ``count`` elements, from a component or by fmpy."""
    if isinstance(stepping, SteppingComponent):
        values: list[float] = getattr(stepping.unit, f"get{what}")()
        return values
    array = (fmpy.fmi3.fmi3Float64 * count)()
    getattr(stepping.unit, f"get{what}")(array, count)
    return list(array)


def exchange(stepping: Stepping3, times: Sequence[float]) -> list[list[float]]:
    """States, derivatives and event indicators at ``times`` (s), by steps of Euler's method with events at their ends.

    No integrator that one should use, but one that calls all of model exchange, and finds events late.
    """
    unit, rows = stepping.unit, []
    states, indicators = unit.getNumberOfContinuousStates(), unit.getNumberOfEventIndicators()
    signs = [z > 0 for z in _vector(stepping, "EventIndicators", indicators)]
    for start, end in itertools.pairwise(times):
        x, rates = (
            _vector(stepping, "ContinuousStates", states),
            _vector(stepping, "ContinuousStateDerivatives", states),
        )
        moved = [a + (end - start) * b for a, b in zip(x, rates, strict=True)]
        unit.setTime(end)
        if isinstance(stepping, SteppingComponent):
            unit.setContinuousStates(moved)
        else:
            unit.setContinuousStates((fmpy.fmi3.fmi3Float64 * states)(*moved), states)
        event, _ = unit.completedIntegratorStep()
        z = _vector(stepping, "EventIndicators", indicators)
        if event or [value > 0 for value in z] != signs:
            unit.enterEventMode()
            stepping.settle()
        signs = [value > 0 for value in _vector(stepping, "EventIndicators", indicators)]
        rows.append([*_vector(stepping, "ContinuousStates", states), *rates, *z])
    return rows
