"""An FMU of any tool that its user steps, so that a controller closes the loop."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from ctypes import c_double, c_int, c_void_p
from numbers import Real
from types import TracebackType
from typing import Any, Literal, overload
from weakref import WeakSet, finalize

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.verify.channels import Channel, Commands, Settables, direct, is_direct, names_in
from lag2fmu.verify.co_simulation import step_to
from lag2fmu.verify.instances import Instance, is_fmi3
from lag2fmu.verify.plan import check_known
from lag2fmu.verify.run import Feedback, Floats, Plan, Scalar


class SavedState:
    """The state of an FMU at a ``time`` (s), from ``Simulation.save``; its memory is freed with the last reference."""

    def __init__(self, fmu: Any, time: float) -> None:
        """Keep the present state of ``fmu``, an instance of fmpy, at ``time`` (s)."""
        self.time, self.kept = time, fmu.getFMUState()
        self.free = finalize(self, fmu.freeFMUState, self.kept)


class Simulation:
    """An FMU that is stepped by its user; see ``lag2fmu.start``."""

    def __init__(self, instance: Instance, scalars: Mapping[str, Scalar], time: float = 0.0) -> None:
        """Step the ``instance``, which has been initialized at ``time`` (s); ``scalars`` are its numbers by name."""
        self._instance, self._scalars, self._time = instance, scalars, time
        # where equal steps began, their length and their number: their times do not add up roundings
        self._grid = time, math.nan, 0
        self._third = is_fmi3(instance.description)
        self._saves = bool(instance.description.coSimulation.canGetAndSetFMUstate)
        self._go = _stepper(instance.fmu, third=self._third, last=not self._saves)
        self._readers: dict[tuple[str, ...], Callable[[], Floats]] = {}
        self._last: tuple[str | Sequence[str], Callable[[], Floats]] = (), lambda: np.empty(0)
        self._settables: dict[tuple[Any, ...], Settables] = {}
        self._commanded: tuple[list[Any], Callable[[Commands], None]] = [], lambda inputs: None
        self._states: WeakSet[SavedState] = WeakSet()
        self._open: ExitStack | None = ExitStack()
        self.inputs = tuple(_of_causality(scalars, "input"))
        self.outputs = tuple(_of_causality(scalars, "output"))

    @property
    def time(self) -> float:
        """The time reached, in s."""
        return self._time

    def step(self, h: float, inputs: Commands | None = None) -> None:
        """Go on by ``h`` (s), with ``inputs`` {name: SI value} that are constant until they are set anew.

        Parameters that may change during a run can be set too. An array takes all its values, in C order. A tuple of
        names takes an array of their values, which is the fastest way.
        Raises LoadError for a step or values that cannot be, SimulationError if the FMU cannot make the step, or if it
        is closed. After such a failure ``restore`` goes back, if the FMU allows it.
        """
        if self._open is None:
            self._check_open()
        begun, length, count = self._grid if type(h) is float and h == self._grid[1] else self._grid_of(h)
        if inputs:
            self._set(inputs)
        end = begun + (count + 1) * length
        try:
            self._go(self._time, end)
        except Exception as error:  # fmpy raises bare exceptions
            raise self._failed(f"step by {h:g} s", error) from error
        self._time, self._grid = end, (begun, length, count + 1)

    def _grid_of(self, h: float) -> tuple[float, float, int]:
        """Where steps of ``h`` (s) began, their length and their number so far; raises LoadError for another one."""
        if not (isinstance(h, Real) and math.isfinite(h) and h > 0):
            raise LoadError(f"the step h = {h!r} s is not positive and finite; give its length in s, such as 1e-3")
        return self._grid if self._grid[1] == h else (self._time, float(h), 0)

    def advance(self, end: float) -> None:
        """Go on until ``end`` (s), with the inputs as they are; raises what fmpy raises."""
        self._go(self._time, end)
        self._time = end

    def set(self, inputs: Commands) -> None:
        """Set ``inputs`` {name: SI value} now; outputs that depend on them directly change at once.

        Raises LoadError for names that are no inputs, and for values that are no finite numbers.
        """
        self._check_open()
        self._set(inputs)

    def _set(self, inputs: Commands) -> None:
        """As ``set``, once it is known that the FMU is open."""
        if type(inputs) is not dict and not isinstance(inputs, Mapping):  # the usual type comes first, as below
            raise LoadError(f"the inputs are {inputs!r}; give a mapping {{name: value}}")
        if [*inputs] != self._commanded[0]:
            self._commanded = self._writer(tuple(inputs))
        try:
            self._commanded[1](inputs)
        except LoadError:
            raise
        except Exception as error:  # fmpy raises bare exceptions
            raise LoadError(f"the FMU refuses inputs: {error}; {self._instance.log.tail()}") from error

    def _writer(self, keys: tuple[Any, ...]) -> tuple[list[Any], Callable[[Commands], None]]:
        """The ``keys``, by which they are known again, and what sets the inputs or tunable parameters they name."""
        if keys not in self._settables:
            known = [s for s in self._scalars.values() if _is_settable(s)]
            allowed = [*dict.fromkeys([*(s.name for s in known), *(s.variable.name for s in known)])]
            check_known([name for key in keys for name in names_in(key)], allowed, "input")
            groups = [[s for name in names_in(key) for s in self._elements(name)] for key in keys]
            channel = Channel(self._instance.fmu, [s for group in groups for s in group], third=self._third)
            self._settables[keys] = Settables(channel, [*map(len, groups)])
        return [*keys], self._settables[keys].write

    @overload
    def __getitem__(self, name: str) -> Any: ...
    @overload
    def __getitem__(self, name: Sequence[str]) -> Floats: ...
    def __getitem__(self, name: str | Sequence[str]) -> Any:
        """The present value of the variable ``name`` in SI units: a number, of an array an array of its shape.

        For a sequence of k names it is an array (k,), by one call of the FMU; arrays among them give all their numbers.
        Raises LoadError for an unknown name, SimulationError after closing.
        """
        if self._open is None:
            self._check_open()
        if type(name) is not type(self._last[0]) or name != self._last[0]:
            self._last = self._reader(name)
        try:
            values = self._last[1]()
        except Exception as error:  # fmpy raises bare exceptions
            raise self._failed(f"give {name if isinstance(name, str) else ', '.join(name)}", error) from error
        if not isinstance(name, str):
            return values
        return float(values[0]) if name in self._scalars else values.reshape(self._shape(name))

    def _reader(self, name: str | Sequence[str]) -> tuple[str | Sequence[str], Callable[[], Floats]]:
        """A copy of ``name``, by which it is known again, and what reads it."""
        names = (name,) if isinstance(name, str) or not isinstance(name, Iterable) else tuple(name)
        read = self._readers.get(names)
        if read is None:
            channel = Channel(self._instance.fmu, [s for x in names for s in self._elements(x)], third=self._third)
            read = self._readers[names] = (channel.doubles or channel).read
        return name[:] if type(name) in (list, tuple, str) else names, read

    def _elements(self, name: str) -> list[Scalar]:
        """The scalars of the variable ``name``, or the one of this name."""
        if name in self._scalars:
            return [self._scalars[name]]
        found = [s for s in self._scalars.values() if s.variable.name == name]
        if not found:
            check_known([str(name)], list(self._scalars), "variable")
        return found

    def _shape(self, name: str) -> tuple[int, ...]:
        return tuple(int(n) for n in self._elements(name)[0].variable.shape)

    def save(self) -> SavedState:
        """The present state, to go back to by ``restore``.

        Raises SimulationError for an FMU that cannot save its state, and after closing.
        """
        self._check_open()
        if not self._saves:
            raise SimulationError("this FMU cannot save its state (canGetAndSetFMUstate is false); start another one")
        try:
            state = SavedState(self._instance.fmu, self._time)
        except Exception as error:  # fmpy raises bare exceptions
            raise self._failed("save its state", error) from error
        self._states.add(state)
        return state

    def restore(self, state: SavedState) -> None:
        """Go back to a ``state`` that ``save`` of the same simulation returned, as often as wanted.

        Raises LoadError for a state of another simulation, SimulationError after closing.
        """
        self._check_open()
        if state not in self._states:
            raise LoadError("this state was not saved by this simulation; give what its method 'save' returned")
        try:
            self._instance.fmu.setFMUState(state.kept)
        except Exception as error:  # fmpy raises bare exceptions
            raise self._failed(f"go back to t = {state.time:.9g} s", error) from error
        self._time, self._grid = state.time, (state.time, math.nan, 0)

    def close(self) -> None:
        """Free the FMU; it cannot be used any longer. To close it once more does nothing."""
        self.__exit__(None, None, None)

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> Literal[False]:
        """Close it; after an error that left the block the instance is not used for another run."""
        opened, self._open = self._open, None
        for state in list(self._states):
            state.free()
        if opened is not None:
            opened.__exit__(kind, error, trace)
        return False

    def owning(self, opened: ExitStack) -> Simulation:
        """Let it close what was ``opened`` for it when it is closed."""
        self._open = opened
        return self

    def _failed(self, doing: str, error: Exception) -> SimulationError:
        """The error that the FMU cannot do something, in its own words."""
        return SimulationError(
            f"the FMU cannot {doing} at t = {self._time:.9g} s: {error}; {self._instance.log.tail()}"
        )

    def _check_open(self) -> None:
        if self._open is None:
            raise SimulationError("this simulation is closed; start another one by lag2fmu.start")


def sampled(sim: Simulation, feedback: Feedback, plan: Plan, progress: Callable[[float], None] | None) -> Floats:
    """The values recorded on the grid of the ``plan``, (k, names), of a run in which ``feedback`` computes the inputs.

    The law is asked at multiples of its sample time after the start, before values are recorded there. Raises
    SimulationError if the law fails, LoadError for inputs that cannot be set.
    """
    names = [*dict.fromkeys((*sim.outputs, *plan.names))]
    h, start, stop = feedback.sample_time, float(plan.grid[0]), float(plan.grid[-1])
    samples: Floats = start + np.arange(0.0, math.floor((stop - start) / h * (1 + 1e-9)) + 1) * h
    near = 1e-9 * h
    times = np.union1d(plan.grid, samples)
    times = times[np.append(np.diff(times) > near, True)]  # of two that differ by rounding the later
    asked, recorded = (np.abs(times - _nearest(grid, times)) <= near for grid in (samples, plan.grid))
    values, row = np.empty((len(plan.grid), len(plan.names))), 0
    for i, t in enumerate(times.tolist()):
        if asked[i]:
            sim.set(_commands(feedback, t, dict(zip(names, sim[names].tolist(), strict=True))))
        if recorded[i]:
            values[row], row = sim[plan.names], row + 1
            if progress is not None:
                progress(t)
        if i + 1 < len(times):
            sim.advance(float(times[i + 1]))
    return values


def _stepper(fmu: Any, *, third: bool, last: bool) -> Callable[[float, float], None]:
    """What steps from one time (s) to another: for FMI 2.0 in this process by a call that is prepared once.

    ``third``: by FMI 3.0; ``last``: no earlier state is returned to.
    """
    if third:
        return lambda time, end: step_to(fmu, time, end, final=last)
    if not is_direct(fmu) or not hasattr(fmu, "fmi2DoStep"):
        return lambda time, end: fmu.doStep(time, end - time, int(last))
    point, length = c_double(), c_double()
    arguments = c_void_p.from_param(fmu.component), point, length, c_int.from_param(int(last))
    call = direct(fmu, "fmi2DoStep", arguments)

    def stepped(time: float, end: float) -> None:
        point.value, length.value = time, end - time
        call()

    return stepped


def _nearest(grid: Floats, times: Floats) -> Floats:
    """The points of the sorted ``grid`` (k,) that are nearest to ``times`` (m,), (m,)."""
    found: Floats = grid[np.searchsorted((grid[1:] + grid[:-1]) / 2, times)]
    return found


def _commands(feedback: Feedback, t: float, y: Mapping[str, float]) -> Commands:
    """What the law gives at ``t`` (s) for the outputs ``y``."""
    try:
        found = feedback.law(t, y)
    except Exception as error:  # whatever the user's function meets
        words = f"the function of the inputs failed at t = {t:.9g} s: {type(error).__name__}: {error}"
        raise SimulationError(words) from error
    if not isinstance(found, Mapping):
        raise LoadError(f"the function of the inputs gave {found!r} at t = {t:.9g} s; it must give {{name: value}}")
    return found


def _of_causality(scalars: Mapping[str, Scalar], causality: str) -> list[str]:
    return [s.name for s in scalars.values() if s.variable.causality == causality and not s.variable.alias]


def _is_settable(scalar: Scalar) -> bool:
    """Whether a number may be set between steps: an input, or a tunable parameter."""
    v = scalar.variable
    return bool(v.causality == "input" or (v.causality == "parameter" and v.variability == "tunable"))
