"""What the gate of FMI 3.0 refuses, in which words, and what it logs."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3ScheduledExecution
from stepping3 import Stepping3

pytestmark = pytest.mark.fmu


@pytest.fixture
def ball(exported):
    """The FMU of a bouncing ball."""
    return exported("bouncing_ball", fmi="3.0").path


WRONG: dict[str, tuple[Callable[[Stepping3], object], str]] = {
    "type": (
        lambda u: u.unit.getFloat64([u.references["floor_mode"]]),
        "fmi3GetFloat64: variable floor_mode is of type Int64; expected one of type Float64",
    ),
    "reference": (lambda u: u.unit.getFloat64([999]), "no variable with value reference 999"),
    "size": (lambda u: u.unit.getFloat64([1], 2), "2 elements; the 1 variables have 1 in all"),
    "no such type": (lambda u: u.unit.getBoolean([1]), "this FMU has no variables of type Boolean"),
    "calculated": (lambda u: u.set({"y_ddot": 1.0}), "y_ddot is calculated from the others"),
    "a count": (lambda u: u.unit.setInt32([u.references["floor_impacts"]], [0]), "floor_impacts is calculated"),
    "a clock": (lambda u: u.unit.setClock([u.references["floor_impact"]], [True]), 'illegal in state "step mode"'),
    "a clock between events": (
        lambda u: u.unit.getClock([u.references["floor_impact"]]),
        "fmi3GetClock: illegal in state.*expected one of the states: initialization mode, event mode",
    ),
    "state": (lambda u: u.set({"y": 1.0}), 'y is fixed in state "step mode"; set it before fmi3ExitInitialization'),
    "mode": (lambda u: u.unit.enterEventMode(), "the instance was made without eventModeUsed"),
    "configuration": (lambda u: u.unit.enterConfigurationMode(), "has no use for this function in any state"),
    "update": (lambda u: u.unit.updateDiscreteStates(), 'illegal in state "step mode".*expected.*: event mode'),
    "time": (lambda u: u.unit.doStep(1.0, 0.1), "the communication point is 1 s; expected the end of the last step"),
    "known": (
        lambda u: u.unit.getDirectionalDerivative([u.references["y_ddot"]], [u.references["floor_gap"]], [1.0]),
        "floor_gap is not a known",
    ),
    "unknown": (
        lambda u: u.unit.getAdjointDerivative([u.references["g"]], [u.references["y"]], [1.0]),
        "g is not an unknown",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_errors_are_said_with_logging_off_too(ball, case: str) -> None:
    """And they end the run: of a terminated instance values can be read, and it can be reset."""
    call, sentence = WRONG[case]
    with Stepping3(ball, logging=False) as unit:
        unit.start()
        with pytest.raises(FMICallException, match="error"):
            call(unit)
        [(status, category, said)] = unit.log
        assert (status, category) == (3, "logStatusError")
        assert re.search(sentence, said), said
        assert unit.get(["y"]) == [1.0]
        with pytest.raises(FMICallException, match="error"):
            unit.unit.doStep(0.0, 0.1)
        unit.unit.reset()
        unit.start().unit.doStep(0.0, 0.1)


def test_categories_are_switched_one_by_one(ball) -> None:
    """A note on a tolerated call is in category logAll."""

    def tolerated(unit: Stepping3) -> None:
        unit.unit.enterInitializationMode()
        unit.unit.getOutputDerivatives([unit.references["y"]], [1])

    with Stepping3(ball) as unit, Stepping3(ball) as other:
        other.unit.setDebugLogging(False, ["logStatusWarning"])
        for each in (unit, other):
            tolerated(each)
        assert [entry[:2] for entry in unit.log] == [(0, "logAll")] == [entry[:2] for entry in other.log]
        unit.unit.reset()
        unit.unit.setDebugLogging(False, ["logAll"])
        tolerated(unit)
        assert len(unit.log) == 1


INSIDE: dict[str, Callable[[Stepping3], object]] = {
    "fmi3FreeInstance": lambda u: u.unit.fmi3FreeInstance(u.unit.component),
    "fmi3Reset": lambda u: u.unit.reset(),
    "fmi3Terminate": lambda u: u.unit.terminate(),
    "fmi3DoStep": lambda u: u.unit.doStep(0.0, 0.1),
    "fmi3EnterEventMode": lambda u: u.unit.enterEventMode(),
    "fmi3UpdateDiscreteStates": lambda u: u.unit.updateDiscreteStates(),
    "fmi3EnterStepMode": lambda u: u.unit.enterStepMode(),
    "fmi3GetClock": lambda u: u.unit.getClock([u.references["floor_impact"]]),
    "fmi3SetFMUState": lambda u: u.unit.setFMUState(u.unit.getFMUState()),
}


def attempt(call: Callable[[Stepping3], object], unit: Stepping3) -> None:
    """Make a call that answers an error, or nothing."""
    try:
        call(unit)
    except FMICallException:
        return
    assert call is INSIDE["fmi3FreeInstance"], "accepted"


@pytest.mark.parametrize("first", INSIDE)
def test_no_call_in_an_intermediate_update_takes_the_instance_away(ball, first: str) -> None:
    """Nor does one that follows an error in the same update, which would be legal in the state that errors lead to."""
    made: list[str] = []

    def update(time: float, sets: bool, may: bool) -> None:
        for name in () if made else (first, *INSIDE):
            made.append(name)
            attempt(INSIDE[name], unit)

    with Stepping3(ball, events=True, update=update, intermediate=["y"], logging=False) as unit:
        unit.start()
        with pytest.raises(FMICallException, match="error"):
            unit.unit.doStep(0.0, 1.0)
        said = [sentence.split(":")[0] for status, _, sentence in unit.log if status == 3]
        assert said == made
        assert all('illegal in state "intermediate update mode"' in sentence for *_, sentence in unit.log)
        unit.unit.reset()
        unit.start().unit.doStep(0.0, 0.1)


def test_a_logger_that_calls_the_fmu_is_refused(ball, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is told so by one more message; neither its calls nor those in the answer to it do anything."""
    hear = Stepping3._hear
    calls = [INSIDE["fmi3FreeInstance"], INSIDE["fmi3Reset"], lambda u: u.get(["y"])]

    def call_back(self: Stepping3, *message: object) -> None:
        hear(self, *message)  # type: ignore[arg-type]
        for call in calls:
            attempt(call, self)

    monkeypatch.setattr(Stepping3, "_hear", call_back)
    with Stepping3(ball) as unit:
        unit.start()
        with pytest.raises(FMICallException, match="error"):
            unit.unit.enterEventMode()
        calls.clear()
        assert [sentence.split(":")[0] for *_, sentence in unit.log] == ["fmi3EnterEventMode", "fmi3GetFloat64"]
        assert "illegal in the importer's logger" in unit.log[1][2]
        assert unit.get(["y"]) == [1.0]


def test_there_is_no_scheduled_execution_and_no_other_token(ball) -> None:
    said: list[str] = []
    with Stepping3(ball) as unit:
        made = FMU3ScheduledExecution(
            guid=unit.description.guid,
            unzipDirectory=str(unit.unit.unzipDirectory),
            modelIdentifier="bouncing_ball",
            instanceName="it",
        )
        with pytest.raises(Exception, match="Failed to instantiate"):
            made.instantiate(logMessage=lambda *message: said.append(message[3].decode()))
        unit.unit.freeInstance()
        unit.unit.guid = "{another}"
        with pytest.raises(Exception, match="Failed to instantiate"):
            unit.unit.instantiate(logMessage=unit._hear)
        unit.unit.guid = unit.description.guid
        unit.unit.instantiate()
    assert said == ["fmi3Instantiate: this FMU has no scheduled execution; expected model exchange or co-simulation"]
    assert 'the instantiation token is "{another}", but this binary of bouncing_ball has' in unit.log[-1][2]
