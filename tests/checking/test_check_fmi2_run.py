"""Running FMUs of FMI 2.0 that are wrong in one way each: the trials find it, and nothing in the one that is right.

The library is compiled once and reads its fault from the environment. The trials are done in this process; that they
survive crashes in one of their own is shown in test_isolated_run.py.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from faults import planted

from lag2fmu.checking.child import findings_of
from lag2fmu.checking.description import read_document
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi2.description import Description2
from lag2fmu.checking.fmi2.illegal import ANY, OWN
from lag2fmu.checking.fmi2.rulebook import FMI2
from lag2fmu.checking.illegal import COMMON
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import compile_library
from lag2fmu.fmu.platforms import host_platform

pytestmark = pytest.mark.fmu

SOURCE = (Path(__file__).parent / "faulty_fmu2.c").read_text("utf-8")
XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="faulty" guid="{a7b1c4de-0123-4567-89ab-cdef01234567}"
  numberOfEventIndicators="1">
  <ModelExchange modelIdentifier="faulty" canGetAndSetFMUstate="true" canSerializeFMUstate="true"
    providesDirectionalDerivative="true"/>
  <CoSimulation modelIdentifier="faulty" canGetAndSetFMUstate="true" canSerializeFMUstate="true"
    canHandleVariableCommunicationStepSize="true" canInterpolateInputs="true" maxOutputDerivativeOrder="1"
    providesDirectionalDerivative="true"/>
  <TypeDefinitions>
    <SimpleType name="Mode"><Enumeration><Item name="above" value="1"/><Item name="below" value="2"/></Enumeration>
    </SimpleType>
  </TypeDefinitions>
  <LogCategories><Category name="logStatusError"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.125"/>
  <ModelVariables>
    <ScalarVariable name="time" valueReference="0" causality="independent" variability="continuous"><Real/>
    </ScalarVariable>
    <ScalarVariable name="x0" valueReference="1" causality="output" initial="exact"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="x1" valueReference="2" causality="output" initial="exact"><Real start="2"/></ScalarVariable>
    <ScalarVariable name="der_x0" valueReference="3"><Real derivative="2"/></ScalarVariable>
    <ScalarVariable name="der_x1" valueReference="4"><Real derivative="3"/></ScalarVariable>
    <ScalarVariable name="u" valueReference="5" causality="input"><Real start="0.5"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="6" causality="parameter" variability="tunable"><Real start="2"/>
    </ScalarVariable>
    <ScalarVariable name="f" valueReference="7" causality="parameter" variability="fixed"><Real start="3"/>
    </ScalarVariable>
    <ScalarVariable name="y" valueReference="8" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="seven" valueReference="9" variability="constant"><Real start="7"/></ScalarVariable>
    <ScalarVariable name="mode" valueReference="20" causality="output" variability="discrete">
      <Enumeration declaredType="Mode"/></ScalarVariable>
    <ScalarVariable name="count" valueReference="21" variability="discrete"><Integer/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs>
      <Unknown index="2" dependencies="2"/><Unknown index="3" dependencies="3"/>
      <Unknown index="9" dependencies="2 3 6"/><Unknown index="11"/>
    </Outputs>
    <Derivatives><Unknown index="4" dependencies="2 6"/><Unknown index="5" dependencies="2 3"/></Derivatives>
    <InitialUnknowns>
      <Unknown index="4" dependencies="2 6 7"/><Unknown index="5" dependencies="2 3 8"/>
      <Unknown index="9" dependencies="2 3 6"/><Unknown index="11"/>
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""

RULES = {
    "version": "VERSION PLATFORM",
    "refused": "NO_INSTANCE NO_EXCHANGE REFUSE STEP_REFUSED INPUT_DERIVATIVES",
    "wrong-guid": "ANY_TOKEN",
    "environment": "CHDIR LOCALE ROUNDING",
    "start-value": "OTHER_START ROUNDED_START",
    "value-finite": "NOT_A_NUMBER LATE_NAN RATE_NAN INDICATOR_NAN",
    "enumeration-value": "ENUM_VALUE",
    "time-value": "TIME_STANDS TIME_DROPPED OWN_TIME FIXED_CLOCK",
    "read-back": "DROPPED_INPUT DROPPED_PARAMETER EARLY_DROPPED EARLY_INPUT_DROPPED HALF_VALUE SWAPPED STATES_LIMITED "
    "SET_ORDER",
    "no-effect": "IGNORED_INPUT IGNORED_PARAMETER IGNORED_FIXED",
    "stale": "STALE STALE_OUTPUT STALE_RATE_VARIABLE STALE_RATES",
    "set-other": "CROSS CROSS_INPUT",
    "array": "OVERRUN UNDERRUN UNWRITTEN CHANGES_REFERENCES CHANGES_VALUES OVERRUN_INTEGERS OVERRUN_STATES "
    "OVERRUN_RATES OVERRUN_INDICATORS OVERRUN_NOMINALS OVERRUN_DIRECTIONAL OVERRUN_OUTPUTS SHORT_BLOCK "
    "UNWRITTEN_RATES UNWRITTEN_INDICATOR DIRECTIONAL_UNWRITTEN",
    "vector-order": "ORDER STATES_ORDER OTHER_RATES OTHER_RATES_LATER ONE_RATE",
    "nominal": "NOMINAL NEGATIVE_NOMINAL",
    "next-event": "PAST_EVENT PAST_EVENT_LATER",
    "events": "EVENT_LOOP LATE_LOOP",
    "values-changed": "VALUES_CHANGED VALUES_CHANGED_LATER SILENT_CHANGE SILENT_CHANGE_LATER",
    "integrator-step": "STEP_MOVES",
    "step-size": "FIXED_STEP",
    "directional": "WRONG_DERIVATIVE DERIVATIVE_OF_START DERIVATIVE_OF_PARAMETER SIGN NO_FEEDTHROUGH FIRST_KNOWN "
    "STATE_DROPPED "
    "DIRECTIONAL_REFUSED",
    "output-derivatives": "OUTPUT_NAN",
    "instances": "SHARED_STATE",
    "repeat": "RANDOM SHARED_START",
    "reset": "HALF_RESET RESET_MODE RESET_TIME RESET_REFUSED",
    "read-disturbs": "READ_DISTURBS",
    "state": "STATE_VALUES STATE_COUNT STATE_TIME",
    "together": "READS_FIRST SETS_FIRST",
    "serialize": "HALF_BLOCK",
    "state-free": "DANGLING",
    "log-category": "CATEGORY",
}
"""Rule -> the faults that break it."""

ACCEPTED = {
    "ANY_REFERENCE": "reading a value reference that does not exist",
    "SET_CONSTANT": "setting a constant",
    "SET_FIXED": "setting a fixed parameter after initialization",
    "INITIALIZE_TWICE": "entering Initialization Mode twice",
    "EXIT_SOON": "leaving Initialization Mode before it was entered",
    "TERMINATE_SOON": "terminating before initialization",
    "TERMINATE_TWICE": "terminating twice",
    "ANY_BLOCK": "a serialized state that is none",
    "EVENTS_SOON": "an event iteration before initialization",
    "ANY_LENGTH": "asking for more derivatives than there are",
    "STEP_SOON": "a step before initialization",
    "STEP_BACK": "a step back in time",
    "STEP_ZERO": "a step of no length",
    "STEP_PAST": "a step past the stop time",
}
"""Fault -> a forbidden call that is accepted."""

LISTS = {
    "an output without a state": (
        '<Unknown index="9" dependencies="2 3 6"/><Unknown index="11"/>\n    </Outputs>',
        '<Unknown index="9" dependencies="3 6"/><Unknown index="11"/>\n    </Outputs>',
    ),
    "an output without its input": (
        '<Unknown index="9" dependencies="2 3 6"/><Unknown index="11"/>\n    </Outputs>',
        '<Unknown index="9" dependencies="2 3"/><Unknown index="11"/>\n    </Outputs>',
    ),
    "a derivative without a state": (
        '<Unknown index="5" dependencies="2 3"/>',
        '<Unknown index="5" dependencies="2"/>',
    ),
    "a derivative at the start without its input": (
        '<Unknown index="4" dependencies="2 6 7"/>',
        '<Unknown index="4" dependencies="2 7"/>',
    ),
}
"""A list of dependencies that is too short -> what stands there, what is written instead."""

Tried = Callable[..., list[Finding]]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library, in a folder as an FMU is unpacked to."""
    platform, folder = host_platform(), tmp_path_factory.mktemp("fmu")
    data = compile_library({"faulty.c": SOURCE}, fmi_headers(), "faulty", platform)
    (folder / "resources").mkdir()
    path = folder / f"faulty{platform.suffix}"
    path.write_bytes(data)
    return path


@pytest.fixture
def searched(library: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Iterator[Finding]]:
    """``searched(fault, forbidden)``: what is found with ``fault`` in both kinds, one after the other, by forbidden
    calls or by all others.
    """

    def run(fault: str, forbidden: bool = False, xml: str = XML) -> Iterator[Finding]:
        monkeypatch.setenv("FAULT", fault)
        description = Description2(read_document(xml.encode()))
        try:
            for kind in ("ModelExchange", "CoSimulation"):
                for trial in FMI2.trials(kind):
                    if forbidden == (trial in {*COMMON, *ANY, *OWN[kind]}):
                        # a trial that ends gives the process its folder and locale back
                        yield from [*findings_of(FMI2, description, kind, trial, library.parent, library)]
        finally:
            ctypes.CDLL(None).fesetround(0)  # what a fault has changed

    return run


@pytest.fixture
def tried(searched: Callable[..., Iterator[Finding]]) -> Tried:
    """All that ``searched`` finds."""
    return lambda *arguments, **options: list(searched(*arguments, **options))


def test_a_hundred_faults_are_planted() -> None:
    assert len({fault for faults in RULES.values() for fault in faults.split()} | ACCEPTED.keys()) >= 100


def test_nothing_is_found_in_what_is_right(tried: Tried) -> None:
    assert tried("") + tried("", forbidden=True) == []


@pytest.mark.parametrize(("fault", "rule"), planted(RULES))
def test_faults_of_a_library(fault: str, rule: str, searched: Callable[..., Iterator[Finding]]) -> None:
    assert any(finding.rule == rule for finding in searched(fault))


@pytest.mark.parametrize("fault", ACCEPTED)
def test_calls_that_should_be_refused(fault: str, tried: Tried) -> None:
    found = {f.problem for f in tried(fault, forbidden=True) if f.rule == "illegal-call"}
    assert f"{ACCEPTED[fault]} is answered as if it were right" in found


@pytest.mark.parametrize("derivatives", ["true", "false"])
@pytest.mark.parametrize("what", LISTS)
def test_dependencies_that_are_missing(what: str, derivatives: str, tried: Tried) -> None:
    """Whether or not the FMU gives directional derivatives."""
    written, instead = LISTS[what]
    assert written in XML
    xml = XML.replace(written, instead).replace('Derivative="true"', f'Derivative="{derivatives}"')
    assert {f.rule for f in tried("", xml=xml)} == {"dependency-missing"}
