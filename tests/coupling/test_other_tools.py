"""Systems as other tools write them: what they leave to the reader, and what their FMUs do not do."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from by_hand import SOURCE, XML, by_hand
from lxml import etree
from train import CAR, WAGON_ALONE, wagon_in_one_piece

import lag2fmu
from lag2fmu.errors import LoadError, SimulationError

pytestmark = pytest.mark.fmu

CONNECT = ("wagon.x:cart.y", "cart.f:wagon.F")
VALUES = {f"wagon.{name}": value for name, value in WAGON_ALONE.items()}
PRECISE = {"tolerance": 1e-11, "stop_time": 1.0}


def rewritten(path: Path, to: Path, *changes: tuple[str, str]) -> Path:
    """The archive ``path`` as ``to``, whose description has each of the ``changes`` (before, after)."""
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(to, "w") as out:
        for name in whole.namelist():
            content = whole.read(name)
            if name in ("modelDescription.xml", "SystemStructure.ssd"):
                for before, after in changes:
                    assert before.encode() in content, before
                    content = content.replace(before.encode(), after.encode())
            out.writestr(name, content)
    return to


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def train(request, exported, tmp_path_factory) -> Path:
    """Cart and wagon as one archive."""
    car = exported(CAR, fmi=request.param)
    path = tmp_path_factory.mktemp("systems") / "train.ssp"
    return lag2fmu.ssp({"cart": car, "wagon": car}, path, connect=CONNECT, values=VALUES, stop_time=1.0)


def test_start_and_end_of_a_connection_are_words_alone(train: Path, tmp_path) -> None:
    """The kinds of the connectors tell where a value goes: SSP 2.0, section 5.3.2."""
    ends = 'startElement="wagon" startConnector="x" endElement="cart" endConnector="y"'
    turned = 'startElement="cart" startConnector="y" endElement="wagon" endConnector="x"'
    other = rewritten(train, tmp_path / "turned.ssp", (ends, turned))
    found, before = (lag2fmu.simulate(path, step=0.01, **PRECISE) for path in (other, train))
    assert found.values.tobytes() == before.values.tobytes()


def test_a_connection_that_passes_nothing_on(train: Path, tmp_path) -> None:
    end = 'endElement="cart" endConnector="{}"'
    path = rewritten(train, tmp_path / "two.ssp", (end.format("y"), end.format("x")))
    told = "'wagon.x' is of kind output and 'cart.x' is of kind output; one end has to give what the other one hears"
    with pytest.raises(LoadError, match=re.escape(told)):
        lag2fmu.simulate(path)


def test_inputs_of_other_tools_go_on_by_first_derivatives(exported, tmp_path) -> None:
    """FMUs of Dymola and OpenModelica end the run at a second derivative, which FMI 2.0 gives them no word for.

    The order is then 2, and not the 3 of the FMUs of lag2fmu.
    """
    tool = 'generationTool="lag2fmu'
    path = rewritten(exported(CAR).path, tmp_path / "other.fmu", (tool, 'generationTool="Other'))
    errors = []
    for step, every in ((0.01, 10), (0.001, 1)):
        run = lag2fmu.simulate({"cart": path, "wagon": path}, step=step, connect=CONNECT, values=VALUES, **PRECISE)
        errors.append(float(np.abs(run["wagon.x"] - wagon_in_one_piece()[::every]).max()))
    assert np.log10(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)
    signal = {"time": [0.0, 1.0], "F": [0.0, 1.0]}
    alone, own = (
        lag2fmu.simulate(p, inputs=signal, values={"k": 0.0}, step=0.1, **PRECISE) for p in (path, exported(CAR))
    )
    assert alone["x"] == pytest.approx(own["x"], abs=1e-12), "a signal that is linear needs no second derivative"


def test_repeated_steps_of_an_fmu_that_goes_back_by_itself(tmp_path) -> None:
    """Some FMUs take noSetFMUStatePriorToCurrentPoint = false for a step that is to be made again."""
    back = SOURCE.replace("    (void)no_set;\n", "    if (!no_set) return fmi2OK;\n", 1)
    part = by_hand(tmp_path / "a.fmu", back)
    run = lag2fmu.simulate({"a": part, "b": part}, connect=["a.x:b.u"], step=0.125, stop_time=1.0, coupling="iterated")
    assert run["a.x"] == pytest.approx(1 + 2 * run.time, abs=1e-12)
    assert run["b.x"] == pytest.approx(1 + 3 * run.time + run.time**2, abs=1e-6), "held at the mean of both ends"


def by_exchange(train: Path, to: Path) -> Path:
    return rewritten(train, to, ('implementation="CoSimulation"', 'implementation="ModelExchange"'))


@pytest.mark.parametrize("apart", [False, True])
def test_components_by_model_exchange(apart: bool, train: Path, tmp_path) -> None:
    """CVode integrates them, and inputs go on as they did, for no outputs are differentiated: order 2."""
    path, errors = by_exchange(train, tmp_path / "exchange.ssp"), []
    for step, every in ((0.02, 20), (0.01, 10)):
        run = lag2fmu.simulate(path, step=step, stop_time=1.0, tolerance=1e-7, apart=apart)
        errors.append(float(np.abs(run["wagon.x"] - wagon_in_one_piece()[::every]).max()))
    assert errors[1] < 4e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.2)


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_events_of_components_by_model_exchange(fmi: str, exported, tmp_path) -> None:
    """A ball bounces as it does alone, also where impacts lie within a step."""
    ball = exported("bouncing_ball", fmi=fmi)
    path = by_exchange(lag2fmu.ssp({"ball": ball}, tmp_path / "b.ssp"), tmp_path / "exchange.ssp")
    run = lag2fmu.simulate(path, stop_time=1.5, step=0.05, tolerance=1e-9)
    alone = lag2fmu.simulate(ball, stop_time=1.5, step=0.05, tolerance=1e-9)
    assert run["ball.y"] == pytest.approx(alone["y"], abs=1e-6)


def test_an_fmu_that_offers_model_exchange_alone(exported, tmp_path) -> None:
    """It runs alone and in a system, though nobody asks for that kind."""
    ball = exported("bouncing_ball")
    with zipfile.ZipFile(ball.path) as whole:
        text = whole.read("modelDescription.xml").decode()
    element = text[text.index("<CoSimulation") : text.index("</CoSimulation>") + len("</CoSimulation>")]
    path = rewritten(ball.path, tmp_path / "ball.fmu", (element, ""))
    runs = lag2fmu.simulate(path, stop_time=1.5, step=0.05), lag2fmu.simulate({"b": path}, stop_time=1.5, step=0.05)
    expected = lag2fmu.simulate(ball, stop_time=1.5, step=0.05)["y"]
    assert runs[0]["y"] == pytest.approx(expected, abs=1e-4)
    assert runs[1]["b.y"] == pytest.approx(expected, abs=1e-4)


def test_a_run_begins_where_the_fmu_says(tmp_path) -> None:
    """The default experiment may begin after 0."""
    other = by_hand(
        tmp_path / "a.fmu", description=XML.replace('startTime="0" stopTime="1"', 'startTime="2" stopTime="3"')
    )
    run = lag2fmu.simulate(other)
    assert run.time == pytest.approx(np.arange(2, 3.1, 0.125))
    assert run["x"] == pytest.approx(1 + 2 * (run.time - 2))
    with pytest.raises(LoadError, match=r"the stop time 1 s is not after the start time 2 s"):
        lag2fmu.simulate(other, stop_time=1.0)


def test_a_kind_that_an_fmu_does_not_offer(tmp_path) -> None:
    path = lag2fmu.ssp({"a": by_hand(tmp_path / "a.fmu")}, tmp_path / "s.ssp")
    with pytest.raises(LoadError, match="is to run by ModelExchange; it can run here by CoSimulation"):
        lag2fmu.simulate(by_exchange(path, tmp_path / "exchange.ssp"))


SWITCH = """<ScalarVariable name="gear" valueReference="{r}" causality="{c}" {v}><Enumeration declaredType="Gear" {s}/>
    </ScalarVariable>"""
TYPES = """<TypeDefinitions><SimpleType name="Gear"><Enumeration><Item name="park" value="1"/>
  <Item name="drive" value="4"/></Enumeration></SimpleType></TypeDefinitions>"""
INTEGERS = """
EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[])
{
    (void)vr;
    for (size_t i = 0; i < n; i++) value[i] = (fmi2Integer)((Instance *)c)->value[2];
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[])
{
    (void)vr;
    for (size_t i = 0; i < n; i++) ((Instance *)c)->value[2] = value[i];
    return fmi2OK;
}
"""


def with_gear(path: Path, causality: str, shown: int = 2) -> Path:
    """x' = gear, an enumeration that is the parameter, input or output of an FMU, which is ``shown`` there."""
    start = 'start="1"' if causality != "output" else ""
    gear = SWITCH.format(r=2, c=causality, v='variability="tunable"' if causality == "parameter" else "", s=start)
    old = XML[XML.index('<ScalarVariable name="k"') : XML.index("  </ModelVariables>")]
    text = XML.replace(old, gear).replace("  <LogCategories>", f"  {TYPES}\n  <LogCategories>")
    if causality == "output":
        text = text.replace('<Outputs><Unknown index="1"/>', '<Outputs><Unknown index="1"/><Unknown index="3"/>')
    source = SOURCE.replace("value[2] = 2.0;", f"value[2] = {shown};").replace("NO_VARIABLES(Integer)", INTEGERS)
    return by_hand(path, source, text)


def test_enumerations_are_set_and_connected(tmp_path) -> None:
    """By number on the command line, by the name of an item in a parameter set, by connection to another FMU."""
    given, heard = with_gear(tmp_path / "given.fmu", "parameter"), with_gear(tmp_path / "heard.fmu", "input")
    shown = with_gear(tmp_path / "shown.fmu", "output")
    path = lag2fmu.ssp(
        {"a": given, "b": heard, "c": shown}, tmp_path / "s.ssp", connect=["c.gear:b.gear"], values={"a.gear": 4.0}
    )
    with zipfile.ZipFile(path) as archive:
        text = archive.read("resources/parameters.ssv").decode()
        assert 'value="drive"' in text
        written = archive.read("SystemStructure.ssd")
        assert b'<ssc:Item name="drive" value="4"' in written
        schema = Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureDescription.xsd"
        etree.XMLSchema(file=str(schema)).assertValid(etree.fromstring(written))
    run = lag2fmu.simulate(path, stop_time=1.0, step=0.125)
    assert run["a.x"][-1] == pytest.approx(1 + 4.0)
    assert run["b.x"][-1] == pytest.approx(1 + 2.0), "the gear that c shows"
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(tmp_path / "wrong.ssp", "w") as out:
        for name in whole.namelist():
            out.writestr(name, whole.read(name).replace(b'value="drive"', b'value="fly"'))
    with pytest.raises(LoadError, match="'fly' is no item of 'Gear': park, drive"):
        lag2fmu.simulate(tmp_path / "wrong.ssp")


def mapped(folder: Path, table: str, shown: int) -> Path:
    """The gear ``shown`` by an FMU c goes to another one, b, through a ``table``."""
    gives, hears = with_gear(folder / "gives.fmu", "output", shown), with_gear(folder / "hears.fmu", "input")
    path = lag2fmu.ssp({"b": hears, "c": gives}, folder / "plain.ssp", connect=["c.gear:b.gear"])
    connection = 'startElement="c" startConnector="gear" endElement="b" endConnector="gear" />'
    return rewritten(path, folder / "mapped.ssp", (connection, f"{connection[:-2]}>{table}</ssd:Connection>"))


def table_of(kind: str, **pairs: str) -> str:
    entries = "".join(f'<ssc:MapEntry source="{x.strip("_")}" target="{y}"/>' for x, y in pairs.items())
    return f"<ssc:{kind}MappingTransformation>{entries}</ssc:{kind}MappingTransformation>"


@pytest.mark.parametrize(
    ("table", "shown", "heard"),
    [
        (table_of("Enumeration", park="drive", drive="park"), 4, 1),
        (table_of("Enumeration", park="drive", drive="park"), 1, 4),
        (table_of("Integer", _4="7", _3="-2"), 3, -2),
        (table_of("Boolean", true="false", false="true"), 1, 0),
    ],
)
def test_tables_map_what_is_connected(table: str, shown: int, heard: int, tmp_path) -> None:
    run = lag2fmu.simulate(mapped(tmp_path, table, shown), stop_time=1.0, step=0.125)
    assert run["b.x"][-1] == pytest.approx(1 + heard)


@pytest.mark.parametrize(
    ("table", "shown", "error", "message"),
    [
        (table_of("Integer", _4="7", _3="1"), 1, SimulationError, "'c.gear' with 'b.gear': the value is 1, which its "
         "table does not map; it maps 4, 3"),
        (table_of("Integer", _4="high"), 4, LoadError, "'high' is no value in a IntegerMapping.* are whole numbers"),
        (table_of("Enumeration", park="fly"), 4, LoadError, "'fly' is no value in a .*; these are park, drive"),
    ],
)  # fmt: skip
def test_tables_that_do_not_fit(table: str, shown: int, error: type, message: str, tmp_path) -> None:
    with pytest.raises(error, match=message):
        lag2fmu.simulate(mapped(tmp_path, table, shown), stop_time=1.0, step=0.125)


def test_a_component_whose_values_become_nan_is_named(tmp_path) -> None:
    """What was recorded until then is kept."""
    broken = SOURCE.replace("    (void)no_set;\n", "    (void)no_set;\n    if (time > 0.45) self->value[0] = NAN;\n", 1)
    path = lag2fmu.ssp({"a": by_hand(tmp_path / "a.fmu", broken)}, tmp_path / "s.ssp")
    with pytest.raises(SimulationError, match=r"the component 'a' gives nan for 'a\.x'; .* until t = 0\.5 s") as caught:
        lag2fmu.simulate(path, stop_time=1.0, step=0.1)
    assert caught.value.reached.time == pytest.approx(np.arange(0, 0.55, 0.1))


def test_a_step_that_another_tool_notes(train: Path, tmp_path) -> None:
    """Annotations of OMSimulator and of the Open Simulation Platform tell the step of a system."""
    noted = '<ssd:Annotations><ssc:Annotation type="o"><o:FixedStepMaster xmlns:o="urn:o" stepSize="0.25"/>'
    end = 'stopTime="1.0" />', f'stopTime="1.0">{noted}</ssc:Annotation></ssd:Annotations></ssd:DefaultExperiment>'
    path = rewritten(train, tmp_path / "noted.ssp", end)
    assert lag2fmu.simulate(path).time == pytest.approx(np.arange(0, 1.1, 0.25))
