"""A Python function on its way through the run of a system: it runs when it is due, and its outputs are held."""

from __future__ import annotations

import math
import signal
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from inspect import isclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.systems.components import Component
from lag2fmu.systems.controller import Controller
from lag2fmu.systems.controllers import loaded, parameters_of
from lag2fmu.systems.member import ORDERS, Member
from lag2fmu.verify.channels import Channel
from lag2fmu.verify.run import Floats, Scalar


class _Values:
    """The numbers of a function, read and set as those of an FMU are."""

    def __init__(self) -> None:
        self.numbers: list[float] = []

    def getFloat64(self, references: Sequence[int], _: int) -> list[float]:
        return [self.numbers[i] for i in references]

    def setFloat64(self, references: Sequence[int], values: Sequence[float]) -> None:
        for i, value in zip(references, values, strict=True):
            self.numbers[i] = value


class SampledFunction(Member):
    """The function of a ``component``. Within steps its outputs are constant, which is exact."""

    samples = ticks = True
    warnings: Sequence[str] = ()

    def __init__(
        self, component: Component, controller: Controller, begin: Callable[[], None], patience: float | None = None
    ) -> None:
        """``begin`` is called before the function, which may not come back; ``patience``: its longest time (s)."""
        self._values, self._scalars = _Values(), dict[str, Scalar]()
        super().__init__(component.name, self._values, self._scalars, third=True)
        self._begin, self._controller, self._patience = begin, controller, patience
        self._inputs: dict[str, int] = {}
        self._outputs: dict[str, int] = {}
        for connector in component.connectors.values():
            if connector.causality == "input":
                self._add(connector.name, self._inputs)
            elif connector.causality == "output":
                self._add(connector.name, self._outputs)
        self._function: Callable[..., Any] = dict
        self._start, self._count = 0.0, 0

    def _add(self, name: str, among: dict[str, int]) -> None:
        reference = among[name] = len(self._values.numbers)
        self._values.numbers.append(0.0)
        variable = SimpleNamespace(name=name, type="Float64", valueReference=reference, shape=())
        self._scalars[name] = Scalar(name, variable, 0, None)

    def elements(self, name: str) -> list[Scalar]:
        """The number ``name``; a new name is an output that the function has to return."""
        if name not in self._scalars:
            self._add(name, self._outputs)
        return [self._scalars[name]]

    def initialize(self, values: Mapping[str, float | str], tolerance: float | None, span: tuple[float, float]) -> None:
        """Load the function and give it the parameters in ``values``; it is due at the start. Raises LoadError."""
        try:
            function = loaded(self._controller)
            defaults = parameters_of(function, self._controller.label)
        except LoadError as error:
            raise LoadError(f"the component '{self.name}': {error}") from error
        given = {name: type(defaults[name])(value) for name, value in values.items()}
        self._function = partial(function, **given) if given else function
        if isclass(function):
            try:
                with _within(self._patience):
                    self._function = self._function()
            except Exception as error:  # of the user's program
                raise self.failure("while it is made", error) from error
        self._start = self.due = span[0]

    def sample(self, t: float) -> None:
        """Run the function at ``t`` (s). Raises SimulationError if it fails or does not return what is heard."""
        self._begin()
        numbers = self._values.numbers
        try:
            with _within(self._patience):
                found = self._function(t, {name: numbers[i] for name, i in self._inputs.items()})
        except (Exception, SystemExit) as error:
            raise self.failure(f"at t = {t:g} s", error) from error
        try:
            for name, i in self._outputs.items():
                numbers[i] = float(found[name])
        except (TypeError, KeyError, ValueError, IndexError):
            raise SimulationError(f"{self._place()}, at t = {t:g} s, {self._wrong(found)}") from None
        if not all(map(math.isfinite, numbers)):
            name = next(name for name, i in self._outputs.items() if not math.isfinite(numbers[i]))
            raise SimulationError(f"{self._place()}, at t = {t:g} s, returns {name} = {found[name]!r}, not finite")
        self._count += 1
        self.due = self._start + self._count * self._controller.sample_time

    def _wrong(self, found: Any) -> str:
        """What is wrong with what the function returned, as a phrase."""
        if not isinstance(found, Mapping):
            return f"returns {found!r:.60}; it has to return {{output: value}} for {', '.join(self._outputs)}"
        missing = [name for name in self._outputs if name not in found]
        if missing:
            return f"returns no '{missing[0]}', which is heard or recorded; it returns {', '.join(map(str, found))}"
        wrong = {name: found[name] for name in self._outputs if not isinstance(found[name], (int, float))}
        return "returns what are no numbers: " + ", ".join(f"{name} = {value!r:.60}" for name, value in wrong.items())

    def _place(self, line: str = "") -> str:
        file = self._controller.file
        where = f"{file.name}{line}: " if file is not None else ""
        return f"the component '{self.name}', {where}'{self._controller.label}'"

    def failure(self, doing: str, error: BaseException) -> SimulationError:
        """The error of the component: its name, file and line, what it was ``doing``, and the words of the error."""
        own = traceback.extract_tb(error.__traceback__)[1:]  # the first place is the call here
        lines = [(Path(frame.filename).name, frame.lineno) for frame in own if frame.filename == own[0].filename]
        where = ", {}, line {}".format(*lines[-1]) if lines else ""
        words = f"{type(error).__name__}: {error}"
        if isinstance(error, KeyError):
            words += f"; its inputs are {', '.join(self._inputs) or 'none'}"
        return SimulationError(f"the component '{self.name}'{where}, in '{self._controller.label}' {doing}: {words}")

    def exit_initialization(self) -> None:
        """Nothing: there is no such mode."""

    def depends(self, outputs: Channel, inputs: Channel) -> bool:
        """No output changes between samples."""
        return False

    def drive(self, inputs: Channel, values: Floats, derivatives: Floats) -> None:
        """Nothing: the inputs (k,) are read when the function is due."""

    def derivatives(self, outputs: Channel) -> Floats:
        """Zeros, (orders, k)."""
        return np.zeros((ORDERS, len(outputs)))

    def slopes(self, outputs: Channel, inputs: Channel) -> Floats:
        """Zeros, (k, m)."""
        return np.zeros((len(outputs), len(inputs)))

    def save(self) -> None:
        """Nothing changes until the function is due."""

    def restore(self, state: Any) -> None:
        """See ``save``."""

    def forget(self, state: Any) -> None:
        """See ``save``."""

    def step(self, t: float, h: float) -> None:
        """Nothing: the outputs are held."""


@contextmanager
def _within(seconds: float | None) -> Iterator[None]:
    """End the code inside by a TimeoutError where it takes longer than ``seconds`` (s); None: it may take any time.

    Signals reach the main thread alone, and Windows has no such one: elsewhere the code may take any time.
    """
    if seconds is None or not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(*_: object) -> None:
        raise TimeoutError(f"it does not come back within {seconds:g} s and is ended")

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
