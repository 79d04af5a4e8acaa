"""Systems of FMUs run here: against the mechanism in one piece, closed forms, and what the standard says of files."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from by_hand import SOURCE, by_hand
from click.testing import CliRunner
from train import CAR, WAGON_ALONE, K, M, W, wagon_in_one_piece

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import Lag2FmuError, LoadError, SimulationError
from lag2fmu.fmu import Fmu
from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter, signal
from lag2fmu.verify import apart

pytestmark = pytest.mark.fmu

CONNECT = ("wagon.x:cart.y", "cart.f:wagon.F")
VALUES = {f"wagon.{name}": value for name, value in WAGON_ALONE.items()}
PRECISE = {"tolerance": 1e-11, "stop_time": 1.0}


def amplifier() -> Mechanism:
    """An output y = gain (u + bias) that follows its input at once, beside a mass that rests."""
    x, u = coordinate("x", "m"), signal("u", "m")
    gain, bias, m = parameter("gain", 1.0, "1"), parameter("bias", 0.0, "m"), parameter("m", 1.0, "kg")
    return Mechanism(
        "amplifier",
        coordinates=[x],
        inputs=[u],
        parameters=[gain, bias, m],
        bodies=[Body("mass", m, (x, 0))],
        outputs=[Output("y", gain * (u + bias), "m")],
    )


AMPLIFIER = amplifier()


@pytest.fixture(scope="module")
def train(exported, tmp_path_factory) -> Path:
    """Cart and wagon as one archive."""
    car = exported(CAR)
    path = tmp_path_factory.mktemp("systems") / "train.ssp"
    return lag2fmu.ssp({"cart": car, "wagon": car}, path, connect=CONNECT, values=VALUES, stop_time=1.0)


@pytest.mark.parametrize(("fmi", "hold", "bar"), [("2.0", True, 5.8e-2), ("2.0", False, 8e-5), ("3.0", False, 3e-4)])
def test_the_order_of_the_coupling(fmi: str, hold: bool, bar: float, exported, tmp_path) -> None:
    """Order 1 with held inputs, the error as theory says; order 3 where inputs go on by two derivatives."""
    car = exported(CAR, fmi=fmi)
    path = lag2fmu.ssp({"cart": car, "wagon": car}, tmp_path / "train.ssp", connect=CONNECT, values=VALUES)
    errors = []
    for step, every in ((0.01, 10), (0.001, 1)):
        run = lag2fmu.simulate(path, step=step, hold=hold, **PRECISE)
        errors.append(float(np.abs(run["wagon.x"] - wagon_in_one_piece()[::every]).max()))
    assert errors[0] < bar
    assert np.log10(errors[0] / errors[1]) == pytest.approx(1 if hold else 3, abs=0.1)


@pytest.mark.parametrize(
    ("coupling", "fmi", "hold", "order", "better"),
    [
        ("gauss-seidel", "2.0", False, 3, 2),
        ("gauss-seidel", "3.0", False, 3, 4),
        ("gauss-seidel", "3.0", True, 1, 1.05),
        ("iterated", "2.0", False, 3, 2.9),
        ("iterated", "3.0", False, 3, 20),
    ],
)
def test_other_ways_of_coupling(
    coupling: str, fmi: str, hold: bool, order: int, better: float, exported, tmp_path
) -> None:
    """They have the order of steps side by side, and smaller errors; iterated steps make no energy in the bond."""
    car = exported(CAR, fmi=fmi)
    path = lag2fmu.ssp({"cart": car, "wagon": car}, tmp_path / "train.ssp", connect=CONNECT, values=VALUES)
    errors, exact = [], wagon_in_one_piece()
    for step, every in ((0.004, 4), (0.002, 2)):
        run = lag2fmu.simulate(path, step=step, hold=hold, coupling=coupling, **PRECISE)
        errors.append(float(np.abs(run["wagon.x"] - exact[::every]).max()))
    beside = lag2fmu.simulate(path, step=0.002, hold=hold, **PRECISE)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)
    assert errors[1] < np.abs(beside["wagon.x"] - exact[::2]).max() / better
    if coupling == "iterated":
        assert abs(run.coupling.bonds[0].made) < 1e-9
        assert run.coupling.repeated < 2.1 * run.coupling.steps


def test_components_in_turn_follow_their_connections(exported, tmp_path) -> None:
    """In a chain without a way back no input is extrapolated, whatever the order in which components are named."""
    car = exported(CAR)
    chain = ("first.x:second.y", "second.x:third.y")
    path = lag2fmu.ssp({"third": car, "second": car, "first": car}, tmp_path / "chain.ssp", connect=chain)
    side_by_side, in_turn = (
        lag2fmu.simulate(path, step=0.01, coupling=coupling, values={"first.x": 1.0}, **PRECISE)
        for coupling in ("jacobi", "gauss-seidel")
    )
    assert in_turn.coupling.error < 1e-14
    assert side_by_side.coupling.error > 1e-6


def test_iterated_steps_of_what_takes_no_derivatives(exported, tmp_path) -> None:
    """Inputs held at the mean of both ends: order 2, where held inputs have order 1."""
    path = described_as(exported(CAR), b'canInterpolateInputs="true"', b'canInterpolateInputs="false"', tmp_path)
    asked = {"connect": CONNECT, "values": VALUES, "coupling": "iterated", **PRECISE}
    errors = []
    for step, every in ((0.004, 4), (0.002, 2)):
        run = lag2fmu.simulate({"cart": path, "wagon": path}, step=step, **asked)
        errors.append(float(np.abs(run["wagon.x"] - wagon_in_one_piece()[::every]).max()))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)


@pytest.mark.parametrize(
    ("coupling", "hold", "why"),
    [("iterated", True, "no input changes within steps"), ("waveform", False, "jacobi, gauss-seidel or iterated")],
)
def test_a_coupling_that_is_not_possible(coupling: str, hold: bool, why: str, train: Path) -> None:
    with pytest.raises(LoadError, match=why):
        lag2fmu.simulate(train, coupling=coupling, hold=hold, step=0.01)


def described_as(fmu: Fmu, words: bytes, others: bytes, folder: Path) -> Path:
    """The FMU with ``others`` for ``words`` in its description."""
    path = folder / "other.fmu"
    with zipfile.ZipFile(fmu.path) as whole, zipfile.ZipFile(path, "w") as out:
        for name in whole.namelist():
            content = whole.read(name)
            out.writestr(name, content.replace(words, others) if name == "modelDescription.xml" else content)
    return path


@pytest.fixture
def car_without_derivatives(exported, tmp_path) -> Path:
    """As most tools write FMUs: it takes derivatives of inputs, and gives none of outputs."""
    words = b'maxOutputDerivativeOrder="2"', b'maxOutputDerivativeOrder="0"'
    return described_as(exported(CAR), *words, tmp_path)


def test_inputs_go_on_as_they_did(car_without_derivatives: Path) -> None:
    """By their last change: order 2, some fifty times as exact as held inputs at 10 ms; a tolerance is met too.

    The energy that the coupling makes is counted to the leading order.
    """
    parts, errors = {"cart": car_without_derivatives, "wagon": car_without_derivatives}, []
    asked = {"connect": CONNECT, "values": VALUES}
    for step, every in ((0.01, 10), (0.001, 1)):
        run = lag2fmu.simulate(parts, step=step, **asked, **PRECISE)
        errors.append(float(np.abs(run["wagon.x"] - wagon_in_one_piece()[::every]).max()))
    assert errors[0] < 3e-3
    assert np.log10(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)
    stretched = run["cart.x"] - run["wagon.x"]
    energy = M / 2 * run["cart.x_dot"] ** 2 + W / 2 * run["wagon.x_dot"] ** 2 + K / 2 * stretched**2
    assert run.coupling.bonds[0].made == pytest.approx(energy[-1] - energy[0], rel=0.1)
    run = lag2fmu.simulate(parts, stop_time=1.0, tolerance=1e-6, **asked)
    assert run.coupling.unjudged == ()
    assert np.abs(run["wagon.x"] - wagon_in_one_piece()[::2]).max() < 3e-6


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_the_error_of_the_coupling_chooses_the_steps(fmi: str, exported, tmp_path) -> None:
    """Nobody gives a step: the error follows the tolerance, 1 m being the size of the motion."""
    car = exported(CAR, fmi=fmi)
    path = lag2fmu.ssp(
        {"cart": car, "wagon": car}, tmp_path / "train.ssp", connect=CONNECT, values=VALUES, stop_time=1.0
    )
    exact = wagon_in_one_piece()[::2]
    errors = {}
    for tolerance in (1e-6, 1e-8):
        run = lag2fmu.simulate(path, tolerance=tolerance)
        errors[tolerance] = float(np.abs(run["wagon.x"] - exact).max())
        assert errors[tolerance] < 3 * tolerance
    assert errors[1e-8] < errors[1e-6] / 20


def test_steps_end_where_an_input_jumps(exported, tmp_path) -> None:
    """The rate of a ball's height jumps at each impact: the steps pass it, and the ball bounces as it does alone."""
    ball, one = exported("bouncing_ball"), exported(AMPLIFIER)
    path = lag2fmu.ssp({"amp": one, "ball": ball}, tmp_path / "b.ssp", connect=["ball.y:amp.u"])
    run = lag2fmu.simulate(path, stop_time=1.0)
    alone = lag2fmu.simulate(ball, stop_time=1.0, step=float(run.time[1]))
    assert run["ball.y"] == pytest.approx(alone["y"], abs=1e-5)
    assert run["amp.y"] == pytest.approx(run["ball.y"], abs=1e-12)


SSC = 'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"'
UNITS = """<{p}:Units>
<ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="1e-3"/></ssc:Unit><ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>
<ssc:Unit name="N"><ssc:BaseUnit kg="1" m="1" s="-2"/></ssc:Unit>
<ssc:Unit name="g"><ssc:BaseUnit kg="1" factor="1e-3"/></ssc:Unit>
</{p}:Units>"""


def described(system: str, version: str = "1.0", more: str = "") -> str:
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription name="s" version="{version}" {SSC}
 xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
 xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
 xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
 xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary">
<ssd:System name="s">{system}</ssd:System>{UNITS.format(p="ssd")}{more}
<ssd:DefaultExperiment startTime="0" stopTime="1"/></ssd:SystemStructureDescription>"""


def connector(name: str, kind: str, unit: str = "") -> str:
    declared = f' unit="{unit}"' if unit else ""
    return f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Real{declared}/></ssd:Connector>'


def component(name: str, *connectors: str, source: str = "car.fmu", more: str = "") -> str:
    listed = f"<ssd:Connectors>{''.join(connectors)}</ssd:Connectors>"
    return f'<ssd:Component name="{name}" source="{source}">{listed}{more}</ssd:Component>'


def wire(start: str, end: str, attributes: str = "", more: str = "") -> str:
    words = []
    for side, text in (("start", start), ("end", end)):
        element, _, name = text.rpartition(".")
        words.append((f'{side}Element="{element}" ' if element else "") + f'{side}Connector="{name}"')
    return f"<ssd:Connection {' '.join(words)} {attributes}>{more}</ssd:Connection>"


def archive(path: Path, text: str, **files: bytes) -> Path:
    with zipfile.ZipFile(path, "w") as out:
        out.writestr("SystemStructure.ssd", text)
        for name, content in files.items():
            out.writestr(name.replace("__", "."), content)
    return path


CART = component("cart", connector("y", "input", "m"), connector("f", "output", "N"), connector("F", "input", "N"))
WAGON = component("wagon", connector("F", "input", "N"), connector("x", "output", "mm"))


@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_nested_systems_dictionaries_units_and_mappings(version: str, train: Path, exported, tmp_path) -> None:
    """The wagon in a system of its own, in mm there; its force goes through a signal dictionary.

    The parameters come from a file in grams, with other names and a mapping. The run is that of the flat system.
    """
    inner = f"""<ssd:Connectors>{connector("place", "output", "mm")}{connector("pull", "input", "N")}</ssd:Connectors>
<ssd:Elements>{WAGON}</ssd:Elements>
<ssd:Connections>{wire("wagon.x", "place")}{wire("pull", "wagon.F")}</ssd:Connections>"""
    mapping = """<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">
<ssm:MappingEntry source="in.mass" target="trailer.wagon.m"/>
<ssm:MappingEntry source="in.minus_x" target="trailer.wagon.x"><ssc:LinearTransformation factor="-1"/>
</ssm:MappingEntry>
<ssm:MappingEntry source="in.k" target="trailer.wagon.k"/></ssm:ParameterMapping></ssd:ParameterMapping>"""
    whole = f"""<ssd:ParameterBindings><ssd:ParameterBinding source="p.ssv" prefix="in.">{mapping}
</ssd:ParameterBinding></ssd:ParameterBindings>
<ssd:Elements>{CART}<ssd:System name="trailer">{inner}</ssd:System>
<ssd:SignalDictionaryReference name="bus" dictionary="forces"/></ssd:Elements>
<ssd:Connections>{wire("trailer.place", "cart.y")}{wire("cart.f", "bus.tow")}{wire("bus.tow", "trailer.pull")}
</ssd:Connections>
<ssd:SignalDictionaries><ssd:SignalDictionary name="forces"><ssb:SignalDictionary version="1.0">
<ssb:DictionaryEntry name="tow"><ssc:Real unit="N"/></ssb:DictionaryEntry></ssb:SignalDictionary></ssd:SignalDictionary>
</ssd:SignalDictionaries>"""
    parameters = f"""<ssv:ParameterSet version="1.0" name="p" {SSC}
 xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"><ssv:Parameters>
<ssv:Parameter name="mass"><ssv:Real value="2000" unit="g"/></ssv:Parameter>
<ssv:Parameter name="minus_x"><ssv:Real value="100" unit="mm"/></ssv:Parameter>
<ssv:Parameter name="k"><ssv:Real value="0"/></ssv:Parameter></ssv:Parameters>{UNITS.format(p="ssv")}
</ssv:ParameterSet>"""
    car = exported(CAR).path.read_bytes()
    path = archive(tmp_path / "nested.ssp", described(whole, version), car__fmu=car, p__ssv=parameters.encode())
    found, flat = (lag2fmu.simulate(p, step=0.01, **PRECISE) for p in (path, train))
    assert found["trailer.wagon.x"] == pytest.approx(flat["wagon.x"], abs=1e-12)
    assert found["cart.f"] == pytest.approx(flat["cart.f"], abs=1e-10)


def test_outputs_and_inputs_of_the_system(exported, tmp_path) -> None:
    """A force in mN that grows with time pushes a car without a spring: x = x0 + t^3/6, shown as 2 x + 1 in mm."""
    free = component("cart", connector("F", "input", "N"), connector("x", "output", "m"))
    whole = f"""<ssd:Connectors>{connector("push", "input")}{connector("place", "output", "mm")}</ssd:Connectors>
<ssd:Elements>{free}</ssd:Elements><ssd:Connections>
{wire("push", "cart.F", more='<ssc:LinearTransformation factor="1e-3"/>')}
{wire("cart.x", "place", more='<ssc:LinearTransformation factor="2" offset="1"/>')}</ssd:Connections>"""
    path = archive(tmp_path / "push.ssp", described(whole), car__fmu=exported(CAR).path.read_bytes())
    run = lag2fmu.simulate(
        path, step=0.001, inputs={"time": [0.0, 1.0], "push": [0.0, 1000.0]}, values={"cart.k": 0.0}, outputs=["place"]
    )
    assert run["place"] == pytest.approx(1 + 2000 * (0.3 + run.time**3 / 6), abs=1.1)  # held: half a step late
    assert lag2fmu.simulate(path, values={"cart.k": 0.0})["place"] == pytest.approx(601.0), "it keeps its start value"
    with pytest.raises(LoadError, match="the system has no input 'pull'; there are push"):
        lag2fmu.simulate(path, inputs={"time": [0.0, 1.0], "pull": [0.0, 1.0]})


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
@pytest.mark.parametrize(("a", "b"), [(0.5, 0.5), (-2.0, 3.0), (0.999, -1000.0)])
def test_loops_of_direct_feed_through(a: float, b: float, fmi: str, exported, tmp_path) -> None:
    """p = a (q + 1), q = b p: p = a/(1 - a b), also where an exchange of the two would grow."""
    one = exported(AMPLIFIER, fmi=fmi)
    values = {"p.gain": a, "p.bias": 1.0, "q.gain": b}
    path = lag2fmu.ssp({"p": one, "q": one}, tmp_path / "l.ssp", connect=["p.y:q.u", "q.y:p.u"], values=values)
    run = lag2fmu.simulate(path, stop_time=0.1, step=0.05)
    assert run["p.y"] == pytest.approx(a / (1 - a * b), rel=1e-9)
    assert run["q.y"] == pytest.approx(a * b / (1 - a * b), rel=1e-9)


def test_a_loop_without_a_solution_is_named(exported, tmp_path) -> None:
    one = exported(AMPLIFIER)
    path = lag2fmu.ssp({"p": one, "q": one}, tmp_path / "l.ssp", connect=["p.y:q.u", "q.y:p.u"], values={"p.bias": 1.0})
    with pytest.raises(SimulationError, match=r"at t = 0 s no values of the inputs agree .*: (p|q)\.u misses by"):
        lag2fmu.simulate(path)


def test_a_chain_needs_no_loop(exported, tmp_path) -> None:
    """Three amplifiers in a row, named against their order: each value is there at once."""
    one = exported(AMPLIFIER)
    path = lag2fmu.ssp(
        {"c": one, "b": one, "a": one},
        tmp_path / "chain.ssp",
        connect=["a.y:b.u", "b.y:c.u"],
        values={"a.bias": 1.0, "b.gain": 2.0, "c.gain": 5.0},
    )
    assert lag2fmu.simulate(path, stop_time=0.1)["c.y"] == pytest.approx(10.0)


BROKEN = {
    "version": (described("", "3.0"), "is of SSP '3.0'; 1.0 and 2.0 are read"),
    "no XML": ("<ssd", "is no well-formed XML"),
    "start": (
        described(f"<ssd:Elements>{CART}</ssd:Elements>").replace('startTime="0"', 'startTime="5"'),
        "the stop time 1 s is not after the start time 5 s of the system; give a later one",
    ),
    "missing FMU": (
        described(f"<ssd:Elements>{component('a', source='b.fmu')}</ssd:Elements>"),
        "the component 'a': there is no file 'b.fmu', which the system refers to",
    ),
    "leads out": (
        described(f"<ssd:Elements>{component('a', source='../../b.fmu')}</ssd:Elements>"),
        "the component 'a': '../../b.fmu' leads out of the archive",
    ),
    "connector": (
        described(f"<ssd:Elements>{CART}</ssd:Elements><ssd:Connections>{wire('cart.f', 'cart.G')}</ssd:Connections>"),
        "there is no connector 'cart.G'",
    ),
    "dimension": (
        described(f"<ssd:Elements>{CART}</ssd:Elements><ssd:Connections>{wire('cart.f', 'cart.y')}</ssd:Connections>"),
        "the connection of 'cart.f' with 'cart.y': 'N' does not convert to 'm'; the dimensions must agree",
    ),
    "indices": (
        described(
            f"<ssd:Elements>{CART}</ssd:Elements><ssd:Connections>"
            + wire("cart.f", "cart.F", 'startIndices="1"')
            + "</ssd:Connections>"
        ),
        "the connection of 'cart.f' with 'cart.F' has indices; whole connectors are connected here",
    ),
    "two sources": (
        described(
            f"<ssd:Elements>{CART}{WAGON}</ssd:Elements><ssd:Connections>{wire('wagon.x', 'cart.y')}"
            f"{wire('cart.x', 'cart.y')}</ssd:Connections>"
        ),
        "'cart.y' is connected with 2 sources; it hears one",
    ),
    "parameter": (
        described(
            "<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues>"
            '<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>'
            '<ssv:Parameter name="cart.mm"><ssv:Real value="1"/></ssv:Parameter></ssv:Parameters>'
            "</ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>"
            f"<ssd:Elements>{CART}</ssd:Elements>"
        ),
        "the parameter 'cart.mm' fits nothing in 'the system'",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("text", "message"), BROKEN.values(), ids=BROKEN)
def test_what_is_broken_is_named(text: str, message: str, exported, tmp_path) -> None:
    path = archive(tmp_path / "broken.ssp", text, car__fmu=exported(CAR).path.read_bytes())
    with pytest.raises(Lag2FmuError, match=re.escape(message)):
        lag2fmu.simulate(path)


def test_arguments_that_do_not_fit(train: Path, tmp_path) -> None:
    for arguments, message in (
        ({"values": {"cart.mm": 1.0}}, "'cart.mm' cannot be set; "),
        ({"values": {"m": 1.0}}, "write COMPONENT.VARIABLE, components are cart, wagon"),
        ({"outputs": ["cart.zz"]}, "the component 'cart' has no number 'zz'"),
        ({"step": 3.0}, "the step 3.0 s is longer than the stop time 1.0 s"),
        ({"kind": "model-exchange"}, "a system runs by co-simulation alone"),
    ):
        with pytest.raises(LoadError, match=re.escape(message)):
            lag2fmu.simulate(train, **arguments)
    with pytest.raises(LoadError, match="there is no such file"):
        lag2fmu.simulate(tmp_path / "absent.ssp")
    with zipfile.ZipFile(tmp_path / "slip.ssp", "w") as out:
        out.writestr("../slip.txt", "")
    with pytest.raises(LoadError, match=r"the entry '\.\./slip\.txt' leads out of the archive; it is not unpacked"):
        lag2fmu.simulate(tmp_path / "slip.ssp")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["slip.ssp"]


FAILS = """    (void)no_set;
    if (self->value[2] == -1.0 && time > 0.45) *(volatile int *)0 = 1;
    if (self->value[2] == -5.0 && time > 0.45) return fmi2Error;
"""


def test_a_component_whose_values_cannot_be_read_is_named(tmp_path) -> None:
    """The error of a call between steps names the component and the call, and keeps what was recorded."""
    get = "EXPORT fmi2Status fmi2GetReal("
    assert get in SOURCE
    broken = SOURCE.replace(get, "static int reads = 0;\n" + get, 1)
    i = broken.index("SELF;", broken.index(get)) + len("SELF;")
    other = by_hand(tmp_path / "other.fmu", broken[:i] + "\n    if (++reads > 9) return fmi2Error;" + broken[i:])
    path = lag2fmu.ssp({"a": other}, tmp_path / "s.ssp")
    with pytest.raises(SimulationError, match=r"the component 'a', called by getReal: ") as caught:
        lag2fmu.simulate(path, stop_time=1.0, step=0.01)
    assert 1 < len(caught.value.reached.time) < 20


@pytest.mark.skipif(not apart.FORKS, reason="no process is a fork of another one here")
@pytest.mark.parametrize(("k", "message"), [(-1.0, "the component 'b' is simulated, it crashes (SIGSEGV)"),
                                            (-5.0, "the component 'b', in the step from t = 0.5 s")])  # fmt: skip
def test_a_component_that_fails_is_named(k: float, message: str, tmp_path) -> None:
    """What was recorded until an error stays; a crash takes it along."""
    other = by_hand(tmp_path / "other.fmu", SOURCE.replace("    (void)no_set;\n", FAILS, 1))
    path = lag2fmu.ssp({"a": other, "b": other}, tmp_path / "s.ssp", values={"b.k": k})
    with pytest.raises(SimulationError, match=re.escape(message)) as caught:
        lag2fmu.simulate(path, stop_time=1.0, step=0.1)
    if k == -5.0:
        assert caught.value.reached.time == pytest.approx(np.arange(0, 0.55, 0.1))


def test_the_command_line(train: Path, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["simulate", str(train), "--step", "0.01", "-o", "o.csv", "--plot", "o.png", "--set", "cart.m=1000 g"]
    done = CliRunner().invoke(main, [*words, "--output", "cart.k"])
    assert done.exit_code == 0, done.output
    heading, *rows = Path("o.csv").read_text("utf-8").splitlines()
    assert heading.startswith("time,cart.x [m],")
    assert heading.endswith("cart.k [N/m]")
    assert len(rows) == 101
    assert Path("o.png").stat().st_size > 10_000
    shown = CliRunner().invoke(main, ["simulate", str(train)])
    assert "wagon.x [m]" in shown.output
    assert "a system has no picture" in CliRunner().invoke(main, ["simulate", str(train), "--animate", "a.gif"]).output


@pytest.mark.fmu
def test_a_component_gives_its_own_reason(exported) -> None:
    """By FMI 2.0 fmpy passes what FMUs say to the logger that was set last: that of the component that came last."""
    fmus = {"a": exported("pendulum").path, "b": exported("spring_mass_damper").path}
    for order in (("a", "b"), ("b", "a")):
        with pytest.raises(SimulationError, match=r"the component 'a', .*the mass matrix becomes singular"):
            lag2fmu.simulate({name: fmus[name] for name in order}, values={"a.m": 0.0}, stop_time=0.1)
