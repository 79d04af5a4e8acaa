"""The slave, whose methods PythonFMU's library calls, for any mechanism.

The library knows fmi2OK, fmi2Discard (only of fmi2DoStep) and, for an exception, fmi2Fatal. So a wrong call ends as
fmi2Fatal with a sentence in the log.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from sys import float_info
from typing import Any, ClassVar, NoReturn

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

from .equations import accelerations, further_rates
from .integrator import LEAST_TOLERANCE, Derivative, Integrator
from .legal_calls import CALLS, SETTABLE, legal_modes, verdict
from .library import hold, release_at_exit
from .model import ACCELERATION, DEPENDENT, FURTHER_RATE, LOCAL, TIME, Model, Unsolvable, Variable, Vector
from .state import ERROR, INITIALIZATION, STEP_COMPLETE, STEP_FAILED, TERMINATED, State, restore, save

# Importers compute times in many ways. A time may differ from the expected one, and exceed the stop time, by this part
# of the communication step.
TIME_TOLERANCE, STOP_TIME_TOLERANCE = 1e-3, 1e-6


class RefusedError(Exception):
    """A call that failed; the log says why, because PythonFMU's library loses the text of an exception."""


class MechanismSlave(Fmi2Slave):  # type: ignore[misc]  # pythonfmu has no types
    """A mechanism in co-simulation; a subclass names its ``model``."""

    model: ClassVar[Model]

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.state = State.at_start(self.model)
        self._calculated: dict[str, list[float]] = {}
        self._noted: set[str] = set()
        self._experiment_defined = False
        if sys.platform == "linux" and self.resources:
            release_at_exit(self.resources)
        if not self.instance_name:
            raise ValueError("fmi2Instantiate: the instance name is empty; expected a name")

    # -------------------------------------------------------------------------------------------- life of an instance

    def setup_experiment(self, start_time: float, stop_time: float | None, tolerance: float | None) -> None:
        """fmi2SetupExperiment; times in s."""
        self._enter("SetupExperiment")
        if tolerance is not None and not LEAST_TOLERANCE <= tolerance < 1.0:
            least = f"at least {LEAST_TOLERANCE:g}, which rounding allows, and below 1"
            expected = f"expected a relative tolerance of {least}"
            self._fail("SetupExperiment", f"the tolerance is {tolerance:g}; {expected}")
        if not math.isfinite(start_time):
            self._fail("SetupExperiment", f"the start time is {start_time:.17g}; expected a finite number")
        if stop_time is not None and not stop_time >= start_time:
            expected = f"expected a time after the start time {start_time:.17g}"
            self._fail("SetupExperiment", f"the stop time is {stop_time:.17g}; {expected}")
        state = self.state
        state.time = state.start_time = start_time
        state.stop_time = math.inf if stop_time is None else stop_time
        state.tolerance = tolerance or 0.0
        self._forget()
        self._experiment_defined = True

    def enter_initialization_mode(self) -> None:
        """fmi2EnterInitializationMode"""
        self._enter("EnterInitializationMode")
        if not self._experiment_defined:
            self._note("EnterInitializationMode", "fmi2SetupExperiment was not called; the start time is 0")
        self.state.mode = INITIALIZATION

    def exit_initialization_mode(self) -> None:
        """fmi2ExitInitializationMode"""
        self._enter("ExitInitializationMode")
        self.state.mode = STEP_COMPLETE

    def terminate(self) -> None:
        """fmi2Terminate"""
        self._enter("Terminate")
        self.state.mode = TERMINATED

    # ---------------------------------------------------------------------------------------------------------- steps

    def do_step(self, current_time: float, step_size: float) -> bool:
        """fmi2DoStep; times in s. A step that fails is undone: fmi2LastSuccessfulTime is its start."""
        self._enter("DoStep")
        self._check_step(current_time, step_size)
        before, start = self.state.copy(), self.state.time
        try:
            Integrator(self.model, self.state, self._derivative_from(start)).advance(current_time + step_size)
            self.state.inputs = self.model.moved(self.state.inputs, self.state.time - start)
        except Unsolvable as reason:
            self.state = before
            self.state.mode = STEP_FAILED
            category = "logSingularLinearSystems" if reason.singular else "logStatusDiscard"
            self._say("DoStep", str(reason), Fmi2Status.discard, category)
            return False
        finally:
            self._calculated.clear()
        return True

    def _check_step(self, point: float, step: float) -> None:
        state = self.state
        if not 0.0 < step < math.inf:
            self._fail("DoStep", f"the communication step is {step:.17g} s; expected a positive number")
        if not abs(point - state.time) <= TIME_TOLERANCE * step + _rounding(state.time):
            self._fail(
                "DoStep",
                f"the communication point is {point:.17g} s; expected the end of the last step, {state.time:.17g} s, "
                f"to within {TIME_TOLERANCE:g} of the communication step {step:.17g} s",
            )
        if point + step > state.stop_time + STOP_TIME_TOLERANCE * step + _rounding(state.stop_time):
            self._fail(
                "DoStep",
                f"the communication step would end at {point + step:.17g} s; expected no time after the stop time "
                f"{state.stop_time:.17g} s of fmi2SetupExperiment",
            )

    # ------------------------------------------------------------------------------------------------------ variables

    def get_real(self, vrs: Sequence[int]) -> list[float]:
        """fmi2GetReal: the values of the variables with these value references, SI."""
        self._enter("GetReal")
        return [self._value(self._variable("GetReal", reference)) for reference in vrs]

    def set_real(self, vrs: Sequence[int], values: Vector) -> None:
        """fmi2SetReal: sets all values or, if one is wrong, none."""
        self._enter("SetReal")
        variables = [self._variable("SetReal", reference) for reference in vrs]
        for variable, value in zip(variables, values, strict=True):
            self._check_settable(variable)
            if not math.isfinite(value) or not variable.minimum <= value <= variable.maximum:
                self._fail(
                    "SetReal",
                    f"variable {variable.name} cannot be set to {value:.17g}; expected a finite number from "
                    f"{variable.minimum:.17g} to {variable.maximum:.17g}, and nothing was set",
                )
        for variable, value in zip(variables, values, strict=True):
            vector: list[float] = getattr(self.state, f"{variable.kind}s")
            if vector[variable.index].hex() != value.hex():  # the same bits once more change nothing
                vector[variable.index] = value
                self._forget()

    def _variable(self, call: str, reference: int) -> Variable:
        if not 0 <= reference < len(self.model.variables):
            last = len(self.model.variables) - 1
            self._fail(call, f"there is no Real variable with value reference {reference}; expected 0 to {last}")
        return self.model.variables[reference]

    def _check_settable(self, variable: Variable) -> None:
        row, mode, name = SETTABLE[variable.kind], self.state.mode, variable.name
        legal = verdict(row, mode)
        if legal == "o":
            self._note("SetReal", f'setting {name} and others of its kind in state "{mode}" is beyond the standard')
        if legal != ".":
            return
        if variable.kind == TIME:
            self._fail("SetReal", f"{name} is the independent variable; it is changed by fmi2DoStep only")
        if not legal_modes(row):
            self._fail("SetReal", f"variable {name} is calculated from the others and cannot be set")
        self._fail("SetReal", f'variable {name} is fixed in state "{mode}"; set it before fmi2ExitInitializationMode')

    def _value(self, variable: Variable) -> float:
        """The present value of a variable; calculated values are kept until something changes."""
        state = self.state
        if variable.kind == TIME:
            return state.time
        if variable.kind not in (ACCELERATION, DEPENDENT, FURTHER_RATE, LOCAL):
            stored: list[float] = getattr(state, f"{variable.kind}s")
            return stored[variable.index]
        try:
            value = self._vector(variable.kind)[variable.index]
        except Unsolvable as reason:
            self._fail("GetReal", f"variable {variable.name} has no value: {reason}")
        except Exception as reason:  # whatever a user's own equations may raise
            self._fail("GetReal", f"variable {variable.name} has no value ({type(reason).__name__}: {reason})")
        if not math.isfinite(value):
            undefined = "its expression is not defined for the present states and inputs"
            self._fail("GetReal", f"variable {variable.name} is {value:g} at time {state.time:.17g}; {undefined}")
        return value

    def _vector(self, kind: str) -> list[float]:
        if kind not in self._calculated:
            state = self.state
            known = (state.time, state.states, state.inputs, state.parameters)
            if kind == ACCELERATION:
                found: Vector = accelerations(self.model, *known)
            elif kind == DEPENDENT:
                found = self.model.follow(state.parameters)
            elif kind == FURTHER_RATE:
                found = further_rates(self.model, *known, self._vector(ACCELERATION))
            else:
                found = self.model.calculate(*known, self._vector(ACCELERATION))
            self._calculated[kind] = [float(x) for x in found]
        return self._calculated[kind]

    def get_integer(self, vrs: Sequence[int]) -> list[int]:
        """fmi2GetInteger, and of the other types: only an empty list is right."""
        if vrs:
            self._fail("GetInteger", f"this FMU has variables of type Real only; expected none, but got {len(vrs)}")
        return []

    def set_integer(self, vrs: Sequence[int], values: Sequence[object]) -> None:
        """fmi2SetInteger, and of the other types."""
        self.get_integer(vrs)

    get_boolean = get_string = get_integer
    set_boolean = set_string = set_integer

    # ------------------------------------------------------------------------------------------------------ equations

    def _derivative_from(self, start: float) -> Derivative:
        """dx/dt = (qd, qdd, dz) in a communication step that begins at ``start`` (s); raises Unsolvable."""
        n = len(self.model.nominal)

        def derivative(t: float, states: Vector) -> list[float]:
            known = (t, states, self.model.moved(self.state.inputs, t - start), self.state.parameters)
            qdd = accelerations(self.model, *known)
            return [*states[n : 2 * n], *qdd, *further_rates(self.model, *known, qdd)]

        return derivative

    def _forget(self) -> None:
        """Forget the calculated values, because the state has changed."""
        self._calculated.clear()
        self.state.first_stage = []

    # -------------------------------------------------------------------------------------------------- saved states

    def _get_fmu_state(self) -> bytes:
        """fmi2GetFMUstate: the whole state as bytes, which are its serialized form too."""
        self._enter("GetFMUstate")
        return save(self.state, self.model)

    def _set_fmu_state(self, state: object) -> None:
        """fmi2SetFMUstate: a state of this FMU; another one changes nothing."""
        self._enter("SetFMUstate")
        try:
            restored = restore(state, self.model)
        except ValueError as fault:
            self._fail("SetFMUstate", f"the given state {fault}; nothing was changed")
        self.state = restored
        self._calculated.clear()

    @staticmethod
    def _fmu_state_to_bytes(state: bytes) -> bytes:
        """fmi2SerializeFMUstate"""
        return state

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> bytes:
        """fmi2DeSerializeFMUstate; what is no state of this FMU is refused when it is set."""
        return state

    # ------------------------------------------------------------------------------------------------------- messages

    def _enter(self, call: str) -> None:
        """The start of every function: refuse it where it is illegal."""
        row, mode = CALLS[call], self.state.mode
        legal = verdict(row, mode)
        if legal == "o":
            self._note(
                call, f'this call in state "{mode}" is accepted, although the standard does not foresee it there'
            )
        if legal == ".":
            self._fail(call, f'illegal in state "{mode}"; expected one of the states: {legal_modes(row)}')

    def _note(self, call: str, sentence: str) -> None:
        """Say once that something was tolerated."""
        if sentence not in self._noted:
            self._noted.add(sentence)
            self._say(call, sentence, Fmi2Status.ok, "logAll")

    def _fail(self, call: str, sentence: str) -> NoReturn:
        """Refuse a call; the library turns the exception into fmi2Fatal."""
        self.state.mode = ERROR
        self._say(call, sentence, Fmi2Status.fatal, "logStatusFatal")
        hold(self, type(self), self.log_queue)
        raise RefusedError

    def _say(self, call: str, sentence: str, status: Fmi2Status, category: str) -> None:
        """Log a sentence; the importer takes it as a format of printf in which #r1# would be a variable."""
        self.log(f"fmi2{call}: {sentence}".replace("%", "%%").replace("#", "##"), status, category)


def _rounding(time: float) -> float:
    """64 units in the last place of a time, s."""
    return 64.0 * float_info.epsilon * abs(time) if math.isfinite(time) else 0.0
