"""Running FMUs of FMI 3.0 that are wrong in one way each: the trials find it, and nothing in the one that is right.

The library is compiled once and reads its fault from the environment. The trials are done in this process; that they
survive crashes in one of their own is shown for FMI 2.0, and once here.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from faults import DESCRIPTION, planted, written

from lag2fmu.checking import check_fmu
from lag2fmu.checking.child import findings_of
from lag2fmu.checking.description import read_document
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.description import Description3
from lag2fmu.checking.fmi3.illegal import ANY
from lag2fmu.checking.fmi3.illegal_own import OWN
from lag2fmu.checking.fmi3.rulebook import FMI3
from lag2fmu.checking.illegal import COMMON
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import compile_library
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.fmu.versions import VERSIONS

pytestmark = pytest.mark.fmu

SOURCE = (Path(__file__).parent / "faulty_fmu3.c").read_text("utf-8")
XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="faulty" instantiationToken="{a7b1c4de-0123-4567-89ab-cdef01234567}">
  <ModelExchange modelIdentifier="faulty" canGetAndSetFMUState="true" canSerializeFMUState="true"
    needsCompletedIntegratorStep="true" providesDirectionalDerivatives="true" providesAdjointDerivatives="true"
    providesPerElementDependencies="true"/>
  <CoSimulation modelIdentifier="faulty" canGetAndSetFMUState="true" canSerializeFMUState="true" hasEventMode="true"
    canHandleVariableCommunicationStepSize="true" maxOutputDerivativeOrder="1" mightReturnEarlyFromDoStep="true"
    providesIntermediateUpdate="true" canReturnEarlyAfterIntermediateUpdate="true"
    providesDirectionalDerivatives="true" providesAdjointDerivatives="true" providesPerElementDependencies="true"/>
  <TypeDefinitions>
    <EnumerationType name="Mode"><Item name="above" value="1"/><Item name="below" value="2"/></EnumerationType>
  </TypeDefinitions>
  <LogCategories><Category name="logStatusError"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.125"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="x" valueReference="1" causality="output" initial="exact" start="1 2"><Dimension start="2"/></Float64>
    <Float64 name="der_x" valueReference="2" derivative="1"><Dimension start="2"/></Float64>
    <Float64 name="u" valueReference="3" causality="input" start="0.5"/>
    <Float64 name="k" valueReference="4" causality="parameter" variability="tunable" start="2"/>
    <Float64 name="f" valueReference="5" causality="parameter" start="3"/>
    <Float64 name="y" valueReference="6" causality="output"/>
    <Float64 name="z" valueReference="7"/>
    <Enumeration name="mode" valueReference="8" causality="output" declaredType="Mode"/>
    <Int32 name="count" valueReference="9"/>
    <Float64 name="seven" valueReference="10" variability="constant" start="7"/>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="1" dependencies="1"/>
    <Output valueReference="6" dependencies="1 3"/>
    <Output valueReference="8" dependencies="1"/>
    <ContinuousStateDerivative valueReference="2" dependencies="1 3 4 5"/>
    <InitialUnknown valueReference="2" dependencies="1 3 4 5"/>
    <InitialUnknown valueReference="6" dependencies="1 3"/>
    <InitialUnknown valueReference="8" dependencies="1"/>
    <EventIndicator valueReference="7" dependencies="1"/>
  </ModelStructure>
</fmiModelDescription>
"""

CLOCKED = XML.replace(
    "</ModelVariables>",
    '<Clock name="tick" valueReference="11" causality="output" intervalVariability="triggered"/></ModelVariables>',
).replace("<ContinuousState", '<Output valueReference="11" dependencies="1"/><ContinuousState', 1)

RULES = {
    "version": "VERSION",
    "refused": "NO_INSTANCE REFUSE NOTHING RESET_MODE STATE_MODE NO_EXCHANGE RESET_REFUSED STEP_REFUSED",
    "wrong-guid": "ANY_TOKEN",
    "start-value": "OTHER_START ROUNDED_START",
    "start-instantiated": "LATE_STARTS",
    "read-back": "HALF_SET DROPPED_PARAMETER EARLY_DROPPED SET_ORDER EARLY_INPUT_DROPPED HALF_VALUE "
    "STATES_LIMITED SWAPPED",
    "value-finite": "NOT_A_NUMBER RATE_NAN INDICATOR_NAN LATE_NAN",
    "enumeration-value": "ENUM_VALUE",
    "time-value": "TIME_STANDS TIME_DROPPED OWN_TIME FIXED_CLOCK",
    "instances": "SHARED_STATE",
    "reset": "HALF_RESET RESET_TIME RESET_MODE_VALUE",
    "state": "STATE_VALUES STATE_TIME STATE_COUNT",
    "serialize": "HALF_BLOCK",
    "state-free": "DANGLING",
    "terminated": "FORGETS",
    "log-reason": "SILENT_ERROR SILENT_WHEN_OFF",
    "log-form": "LINE_BREAK",
    "environment-pointer": "LOG_ENVIRONMENT UPDATE_ENVIRONMENT",
    "log-off": "CHATTER",
    "log-category": "CATEGORY",
    "events": "EVENT_LOOP LATE_LOOP",
    "values-changed": "VALUES_CHANGED SILENT_CHANGE VALUES_CHANGED_LATER SILENT_CHANGE_LATER",
    "next-event": "PAST_EVENT PAST_EVENT_LATER",
    "event-run": "OTHER_EVENT",
    "early-return": "EARLY_ANYWAY UPDATE_OFFERS GOES_ON",
    "event-signal": "EVENT_ANYWAY",
    "last-time": "LAST_TIME",
    "intermediate-update": "NO_UPDATE",
    "intermediate-time": "UPDATE_TIME",
    "output-derivatives": "OUTPUT_RATE OUTPUT_NAN",
    "counts": "STATES_BY_REFERENCE NO_INDICATORS",
    "vector-order": "ORDER INDICATOR RATES_LATER STATES_ORDER RATES_ORDER OTHER_RATES ONE_RATE",
    "nominal": "NOMINAL NEGATIVE_NOMINAL",
    "integrator-step": "STEP_MOVES",
    "dependencies-differ": "DEPENDENCIES",
    "dependencies-element": "ELEMENTS",
    "directional": "WRONG_DERIVATIVE NO_PARAMETERS NO_FIXED DIRECTIONAL_REFUSED FIRST_KNOWN DERIVATIVE_OF_START "
    "DERIVATIVE_OF_PARAMETER NO_FEEDTHROUGH SIGN STATE_DROPPED",
    "adjoint": "WRONG_ADJOINT ADJOINT_REFUSED",
    "array": "OVERRUN UNDERRUN UNWRITTEN CHANGES_VALUES OVERRUN_INTEGERS OVERRUN_VECTORS OVERRUN_STATES "
    "OVERRUN_RATES OVERRUN_INDICATORS OVERRUN_NOMINALS OVERRUN_DIRECTIONAL OVERRUN_ADJOINT "
    "OVERRUN_OUTPUTS OVERRUN_COUNTS SHORT_BLOCK UNWRITTEN_STATES UNWRITTEN_RATES "
    "UNWRITTEN_INDICATORS UNWRITTEN_NOMINALS DIRECTIONAL_UNWRITTEN CHANGES_REFERENCES",
    "environment": "CHDIR ROUNDING LOCALE",
    "no-effect": "IGNORED_INPUT IGNORED_PARAMETER IGNORED_FIXED",
    "stale": "STALE_OUTPUT STALE_RATES STALE STALE_RATE_VARIABLE",
    "set-other": "CROSS CROSS_INPUT",
    "read-disturbs": "READ_DISTURBS",
    "step-size": "FIXED_STEP",
    "repeat": "RANDOM SHARED_START",
    "together": "READS_FIRST SETS_FIRST",
}
"""Rule -> the faults that break it."""

ACCEPTED = {
    "ANY_REFERENCE": ("reading a Float64 whose value reference does not exist", "error"),
    "ANY_COUNT": ("reading more values than there are elements", "error"),
    "ANY_TYPE": ("reading a Float64 by fmi3GetInt32", "error"),
    "SET_CONSTANT": ("setting a constant", "error"),
    "SET_FIXED": ("setting a fixed parameter after initialization", "warning"),
    "SET_OUTPUT": ("setting a calculated output", "warning"),
    "SET_TIME": ("setting the independent variable", "warning"),
    "NO_NAME": ("an instance without a name", "warning"),
    "NO_TOKEN": ("an instance whose instantiationToken is a null pointer", "warning"),
    "ANY_BLOCK": ("a serialized state that is none", "warning"),
    "CONFIGURE": ("entering Configuration Mode without structural parameters", "warning"),
    "EVALUATE": ("evaluating discrete states though that is not provided", "warning"),
    "PARTITION": ("activating a model partition", "warning"),
    "INTERVAL": ("the interval of a clock that does not exist", "warning"),
    "ANY_SIZE": ("a seed that is too long for GetDirectionalDerivative", "warning"),
    "ANY_UNKNOWN": ("a derivative of a value reference that does not exist by GetAdjointDerivative", "error"),
    "ANY_ORDER": ("derivatives of outputs of order 0", "warning"),
    "ANY_LENGTH": ("asking for more states than there are", "warning"),
    "ANY_KIND": ("setting the time of a co-simulation", "warning"),
    "EVENTS_ANYWAY": ("Event Mode where eventModeUsed is false", "warning"),
    "STEP_LENGTH": ("a step of no length", "warning"),
    "STEP_ELSEWHERE": ("a step that begins elsewhere", "warning"),
    "STEP_PAST": ("a step past the stop time", "warning"),
    "ANY_STATE": ("a step in Initialization Mode", "warning"),
}
"""Fault -> a forbidden call that is accepted, and how severe that is."""

LISTS = {
    "an output without a state": (
        '<Output valueReference="6" dependencies="1 3"/>',
        '<Output valueReference="6" dependencies="3"/>',
    ),
    "an output without its input": (
        '<Output valueReference="6" dependencies="1 3"/>',
        '<Output valueReference="6" dependencies="1"/>',
    ),
    "an initial unknown without a parameter": (
        '<InitialUnknown valueReference="2" dependencies="1 3 4 5"/>',
        '<InitialUnknown valueReference="2" dependencies="1 3 5"/>',
    ),
}
"""A list of dependencies that is too short -> what stands there, what is written instead."""

Tried = Callable[..., list[Finding]]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library, in a folder as an FMU is unpacked to."""
    platform, folder = host_platform(), tmp_path_factory.mktemp("fmu")
    data = compile_library({"faulty.c": SOURCE}, fmi_headers(VERSIONS["3.0"]), "faulty", platform)
    (folder / "resources").mkdir()
    path = folder / f"faulty{platform.suffix}"
    path.write_bytes(data)
    return path


@pytest.fixture
def searched(library: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Iterator[Finding]]:
    """``searched(fault, forbidden)``: what is found with ``fault`` in both kinds, one after the other, by forbidden
    calls or by all others.
    """

    def run(fault: str, forbidden: bool, xml: str = XML) -> Iterator[Finding]:
        monkeypatch.setenv("FAULT", fault)
        description = Description3(read_document(xml.encode()))
        try:
            for kind in ("ModelExchange", "CoSimulation"):
                for trial in FMI3.trials(kind):
                    if forbidden == (trial in {*COMMON, *ANY, *OWN[kind]}):
                        # a trial that ends gives the process its folder and locale back
                        yield from [*findings_of(FMI3, description, kind, trial, library.parent, library)]
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
    assert tried("", False) + tried("", True) == []


@pytest.mark.parametrize(("fault", "rule"), planted(RULES))
def test_faults_of_a_library(fault: str, rule: str, searched: Callable[..., Iterator[Finding]]) -> None:
    assert any(finding.rule == rule for finding in searched(fault, False))


@pytest.mark.parametrize("derivatives", ["true", "false"])
@pytest.mark.parametrize("what", LISTS)
def test_dependencies_that_are_missing(what: str, derivatives: str, tried: Tried) -> None:
    """Whether or not the FMU gives directional derivatives."""
    written, instead = LISTS[what]
    assert written in XML
    xml = XML.replace(written, instead).replace('providesPerElementDependencies="true"', "")
    xml = xml.replace('Derivatives="true"', f'Derivatives="{derivatives}"')
    assert {f.rule for f in tried("", False, xml)} == {"dependency-missing"}


@pytest.mark.parametrize("fault", ACCEPTED)
def test_calls_that_should_be_refused(fault: str, tried: Tried) -> None:
    what, severity = ACCEPTED[fault]
    found = {f.problem: f.severity for f in tried(fault, True) if f.rule == "illegal-call"}
    assert found.get(f"{what} is answered as if it were right") == severity


def test_clocks(tried: Tried) -> None:
    """An FMU with a clock is run with Event Mode; the clock tells of events, and of nothing else."""
    assert tried("", False, CLOCKED) + tried("", True, CLOCKED) == []
    assert {f.rule for f in tried("CLOCK_STAYS", False, CLOCKED)} == {"clock-active"}
    found = {f.problem for f in tried("SET_CLOCK", True, CLOCKED)}
    assert found == {"setting a clock that is no input is answered as if it were right"}


def test_functions_of_a_library(library: Path, tmp_path: Path) -> None:
    """Every function of the standard is exported, also those of features that the FMU lacks."""
    (folder,) = FMI3.hosts()
    data = library.read_bytes().replace(b"fmi3GetShiftDecimal", b"fmi3GetShiftDecimaX")
    files = {DESCRIPTION: XML.encode(), "documentation/index.html": b"<p>", f"binaries/{folder}/{library.name}": data}
    found = check_fmu(written(files, tmp_path / "faulty.fmu"), run=False).findings
    assert {f.rule for f in found} == {"binary-functions", "binary-exports"}
    assert any("does not export fmi3GetShiftDecimal of" in f.problem for f in found)


def test_in_a_process_of_its_own(library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The whole check finds nothing in the FMU that is right, and names the trial in which another one crashes."""
    (folder,) = FMI3.hosts()
    files = {DESCRIPTION: XML.encode(), "documentation/index.html": b"<p>"}
    files[f"binaries/{folder}/{library.name}"] = library.read_bytes()
    path = written(files, tmp_path / "faulty.fmu")
    monkeypatch.setenv("FAULT", "CRASH")
    found = check_fmu(path).findings
    assert {f.rule for f in found} == {"crash"}
    assert any("a Float64 whose value reference does not exist" in f.problem for f in found)
    assert {f.rule for f in check_fmu(path, run=False).findings} == set()


def test_steps_of_an_fmu_with_small_steps_of_its_own(library: Path) -> None:
    """A hundredth of a long experiment would be a thousand million of its own steps: a false alarm of a hang."""
    xml = XML.replace('stopTime="1" stepSize="0.125"', 'stopTime="1e8"').replace(
        'hasEventMode="true"', 'hasEventMode="true" fixedInternalStepSize="0.001"'
    )
    description = Description3(read_document(xml.encode()))
    assert FMI3.model(description, "CoSimulation", library.parent, library).step == pytest.approx(1.0)
