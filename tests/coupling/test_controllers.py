"""Python functions as components of a system: against integration with held inputs, and what goes wrong in them."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from by_hand import TOKEN, by_hand
from click.testing import CliRunner
from lxml import etree
from scipy.integrate import solve_ivp
from train import CAR, WAGON_ALONE

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import Lag2FmuError, LoadError, SimulationError
from lag2fmu.systems.controller import Controller

pytestmark = pytest.mark.fmu

SEEN = ("x", "theta", "x_dot", "theta_dot")
GAINS = (-1.0, 36.0875, -2.5015, 8.8068)
"""Of the upright pole, by linear-quadratic regulation of the linearized cart with its pole."""
BALANCE = f"""
from math import pi

GAINS = {GAINS}


def balance(t, inputs, *, gain=1.0, target=0.0):
    \"\"\"The force that keeps the pole upright.\"\"\"
    z = (inputs["x"] - target, inputs["theta"] - pi, inputs["x_dot"], inputs["theta_dot"])
    return {{"F": -gain * sum(k * x for k, x in zip(GAINS, z)), "t": t}}


class Damper:
    def __init__(self, d=1.0):
        self.d, self.calls = d, 0

    def __call__(self, t, inputs):
        self.calls += 1
        return {{"F": -self.d * inputs["x_dot"], "calls": self.calls}}
"""
CONNECT = [*(f"plant.{name}:control.{name}" for name in SEEN), "control.F:plant.F"]
START = {"plant.theta": 2.9, "plant.x": 0.2}


def held(sample: float, stop: float) -> np.ndarray:
    """The states, at each sample, of the cart with its pole under the control of BALANCE, F held from sample to sample.

    The equations are those of R. Tedrake, Underactuated Robotics, chapter 3, with a rigid pole and damping.
    """
    M, m, l, c, d, g = 1.0, 0.3, 1.0, 0.1, 0.002, 9.81  # noqa: E741

    def rates(_: float, z: np.ndarray, F: float) -> np.ndarray:
        s, k = np.sin(z[1]), m * l / 2 * np.cos(z[1])
        mass = [[M + m, k], [k, m * l**2 / 3]]
        load = [F - c * z[2] + m * l / 2 * s * z[3] ** 2, -m * g * l / 2 * s - d * z[3]]
        return np.array([*z[2:], *np.linalg.solve(mass, load)])

    z, found = np.array([0.2, 2.9, 0.0, 0.0]), []
    times = sample * np.arange(round(stop / sample) + 1)
    for t in times:
        found.append(z)
        F = -np.dot(GAINS, z - [0.0, np.pi, 0.0, 0.0])
        z = solve_ivp(rates, (t, t + sample), z, "DOP853", args=(F,), rtol=1e-12, atol=1e-12).y[:, -1]
    return np.array(found)


@pytest.fixture
def program(tmp_path) -> Path:
    path = tmp_path / "control.py"
    path.write_text(BALANCE, "utf-8")
    return path


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_a_plant_with_its_controller_against_held_inputs(fmi: str, program: Path, exported) -> None:
    """Steps end at each sample: the run is that of the equations with the force held, to the solvers' tolerance.

    Recorded points lie between samples too, and no step of the user's changes the run.
    """
    exact = held(0.02, 2.0)
    parts = {"plant": exported("cart_pole", fmi=fmi), "control": f"{program}:balance@20 ms"}
    for step in (None, 0.015):
        run = lag2fmu.simulate(
            parts, connect=CONNECT, values=START, stop_time=2.0, step=step, tolerance=1e-10, outputs=[
                *(f"plant.{name}" for name in SEEN), "control.t"],
        )  # fmt: skip
        shared = [i for i, t in enumerate(run.time) if np.isclose(t % 0.02, [0.0, 0.02], atol=1e-9).any()]
        found = run.columns([f"plant.{name}" for name in SEEN])[shared]
        assert len(found) > 30
        assert found == pytest.approx(exact[np.round(run.time[shared] / 0.02).astype(int)], abs=1e-7)
        assert run["control.t"] == pytest.approx(np.floor(run.time / 0.02 + 1e-6) * 0.02, abs=1e-12)
    assert abs(exact[-1, 1] - np.pi) < 0.05, "it is upright"


def test_functions_of_this_process_and_states(program: Path, exported) -> None:
    """A class is made for each run; each sample is one call, at the start and at the end too."""
    plant = exported("cart_pole")

    class Counter:
        def __init__(self, d: float = 1.0) -> None:
            self.d, self.calls = d, 0

        def __call__(self, t: float, inputs: dict[str, float]) -> dict[str, float]:
            self.calls += 1
            return {"F": -self.d * inputs["x_dot"], "calls": self.calls}

    connect = ["plant.x_dot:c.x_dot", "c.F:plant.F"]
    chosen = {"stop_time": 1.0, "outputs": ["c.calls", "c.F", "plant.x"], "values": {"c.d": 2.0}}
    here, again, there = (
        lag2fmu.simulate({"plant": plant, "c": part}, connect=connect, **chosen)
        for part in (Controller(Counter, 0.01), Controller(Counter, 0.01), f"{program}:Damper@0.01")
    )
    assert here["c.calls"][[0, -1]].tolist() == [1, 101]
    assert np.array_equal(here.values, again.values)
    assert np.array_equal(here.values, there.values)
    with pytest.raises(Lag2FmuError, match="'c' is a function of this process, which no file holds"):
        lag2fmu.ssp({"plant": plant, "c": Controller(Counter, 0.01)}, program.with_suffix(".ssp"), connect=connect)


def test_functions_hear_each_other_at_one_time(exported) -> None:
    """What is due at one time runs along the connections, whatever their order; else outputs are held."""

    def count(t: float, inputs: dict[str, float]) -> dict[str, float]:
        return {"n": round(10 * t)}

    def double(t: float, inputs: dict[str, float]) -> dict[str, float]:
        return {"m": 2 * inputs["n"]}

    parts = {"late": Controller(double, 0.2), "now": Controller(double, 0.1), "count": Controller(count, 0.1)}
    connect = ["count.n:now.n", "count.n:late.n", "now.m:car.F"]
    run = lag2fmu.simulate({"car": exported(CAR), **parts}, connect=connect, stop_time=1.0, step=0.1,
                           outputs=["now.m", "late.m"])  # fmt: skip
    assert run["now.m"] == pytest.approx(2 * np.arange(11))
    assert run["late.m"] == pytest.approx(4 * (np.arange(11) // 2))


def test_a_controller_in_a_coupling_under_error_control(exported) -> None:
    """Cart and wagon with a brake: the steps follow the tolerance, and the force jumps at samples alone."""
    car = exported(CAR)

    def brake(t: float, inputs: dict[str, float]) -> dict[str, float]:
        return {"F": -3.0 * inputs["v"]}

    parts = {"cart": car, "wagon": car, "brake": Controller(brake, 0.05)}
    connect = ["wagon.x:cart.y", "cart.f:wagon.F", "cart.x_dot:brake.v", "brake.F:cart.F"]
    values = {f"wagon.{name}": value for name, value in WAGON_ALONE.items()}
    fine, run = (
        lag2fmu.simulate(parts, connect=connect, values=values, stop_time=1.0, **chosen)
        for chosen in ({"step": 5e-4, "tolerance": 1e-11}, {"tolerance": 1e-7})
    )
    every = (len(fine.time) - 1) // (len(run.time) - 1)
    assert run["wagon.x"] == pytest.approx(fine["wagon.x"][::every], abs=3e-7)
    assert float(np.ptp(run["brake.F"])) > 1.0


def test_an_archive_with_a_controller(program: Path, exported, tmp_path) -> None:
    """It holds the program, names its type and sample time, is valid under the schema, and runs as the parts do."""
    plant = exported("cart_pole")
    parts = {"plant": plant, "control": f"{program}:balance@0.01"}
    path = lag2fmu.ssp(parts, tmp_path / "s.ssp", connect=CONNECT, values={**START, "control.target": 0.1})
    with zipfile.ZipFile(path) as archive:
        text = archive.read("SystemStructure.ssd")
        assert archive.read("resources/control.py").decode() == BALANCE
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "ssp/schema/SystemStructureDescription.xsd"))
    schema.assertValid(etree.fromstring(text))
    assert b'type="application/x-lag2fmu-python"' in text
    program.unlink()
    found = lag2fmu.simulate(path, stop_time=1.0)
    program.write_text(BALANCE, "utf-8")
    again = lag2fmu.simulate(
        parts, connect=CONNECT, values={**START, "control.target": 0.1}, stop_time=1.0, step=float(found.time[1])
    )
    assert np.array_equal(found["plant.x"], again["plant.x"])
    for old, new, message in (
        (b'sampleTime="0.01"', b"", "'' is no number"),
        (b"x-lag2fmu-python", b"x-other", "is of type 'application/x-other', which is not run"),
        (b'function="balance"', b"", "has no annotation 'org.lag2fmu.controller' that tells the function"),
    ):
        with zipfile.ZipFile(path) as whole, zipfile.ZipFile(tmp_path / "b.ssp", "w") as out:
            for name in whole.namelist():
                out.writestr(name, whole.read(name).replace(old, new) if name.endswith(".ssd") else whole.read(name))
        with pytest.raises(LoadError, match=re.escape(message)):
            lag2fmu.simulate(tmp_path / "b.ssp")


FAILING = {
    "an error": (
        "def f(t, inputs):\n    k = inputs['theta']\n    return {'F': k / (0.3 - t)} if t < 0.25 else {'F': 1 / 0}\n",
        "the component 'control', control.py, line 3, in 'f' at t = 0.25 s: ZeroDivisionError: division by zero",
    ),
    "an unknown input": (
        "def f(t, inputs):\n    return {'F': inputs['phi']}\n",
        "the component 'control', control.py, line 2, in 'f' at t = 0 s: KeyError: 'phi'; its inputs are theta",
    ),
    "no mapping": (
        "def f(t, inputs):\n    return 1.0\n",
        "the component 'control', control.py: 'f', at t = 0 s, returns 1.0; it has to return {output: value} for F",
    ),
    "a missing output": (
        "def f(t, inputs):\n    return {'G': 1.0}\n",
        "returns no 'F', which is heard or recorded; it returns G",
    ),
    "no number": ("def f(t, inputs):\n    return {'F': 'x'}\n", "returns what are no numbers: F = 'x'"),
    "not finite": ("def f(t, inputs):\n    return {'F': float('nan')}\n", "returns F = nan, not finite"),
    "an exit": ("def f(t, inputs):\n    raise SystemExit(3)\n", "line 2, in 'f' at t = 0 s: SystemExit: 3"),
    "no such function": ("def g(t, inputs):\n    pass\n", "there is no function 'f'; known are g"),
    "arguments": ("def f(t):\n    pass\n", "'f' takes (t); it has to take (t, inputs), and parameters"),
    "a parameter": ("def f(t, inputs, k):\n    pass\n", "the argument 'k'; a parameter needs a number as default"),
    "a program": ("import nowhere\n", "control.py, line 1: ModuleNotFoundError: No module named 'nowhere'"),
}


@pytest.mark.parametrize(("text", "message"), FAILING.values(), ids=FAILING)
def test_what_goes_wrong_in_a_function_is_said(text: str, message: str, program: Path, exported) -> None:
    """By the component's name, the file, the line and the message; what was recorded until then stays."""
    program.write_text(text, "utf-8")
    parts = {"plant": exported("cart_pole"), "control": f"{program}:f@0.05"}
    with pytest.raises(Lag2FmuError, match=re.escape(message)) as caught:
        lag2fmu.simulate(parts, connect=["plant.theta:control.theta", "control.F:plant.F"], stop_time=1.0, step=0.1)
    if "0.25" in message:
        assert isinstance(caught.value, SimulationError)
        assert caught.value.reached.time == pytest.approx([0.0, 0.1, 0.2])


def test_a_function_that_does_not_come_back(program: Path, exported) -> None:
    """It is ended as an FMU is, and what was recorded until then stays."""
    program.write_text("def f(t, inputs):\n    while t > 0.25:\n        pass\n    return {'F': 0.0}\n", "utf-8")
    parts = {"plant": exported("cart_pole"), "control": f"{program}:f@0.05"}
    message = r"'control', control.py, line [23], in 'f' at t = 0.3 s: TimeoutError: it does not come back within 2 s"
    with pytest.raises(SimulationError, match=message) as caught:
        lag2fmu.simulate(parts, connect=["plant.theta:control.theta", "control.F:plant.F"], step=0.1, apart=2.0)
    assert caught.value.reached.time == pytest.approx([0.0, 0.1, 0.2])


def test_sample_times_and_connections_that_do_not_fit(program: Path, exported) -> None:
    plant = exported("cart_pole")
    for part, connect, message in (
        (f"{program}:balance@0", CONNECT, "the sample time of 'balance' is 0.0 s; give a positive one"),
        (f"{program}:balance@1 kg", CONNECT, "'kg' is no unit of 'sample time'"),
        (f"{program}:balance@0.01", ["plant.z:control.x"], "has no variable 'z'"),
    ):
        with pytest.raises(LoadError, match=re.escape(message)):
            lag2fmu.simulate({"plant": plant, "control": part}, connect=connect, stop_time=0.1)
    with pytest.raises(LoadError, match="there is one model and nothing to connect"):
        lag2fmu.simulate(plant, connect=CONNECT)


def test_the_command_line(program: Path, tmp_path, monkeypatch) -> None:
    """One command for a model of the gallery and its controller."""
    monkeypatch.chdir(tmp_path)
    words = ["simulate", "plant=cart_pole", "control=control.py:balance@1 ms", "--set", "plant.theta=170 deg"]
    for word in CONNECT:
        words += ["--connect", word]
    done = CliRunner().invoke(main, [*words, "--stop-time", "0.5", "-o", "o.csv"])
    assert done.exit_code == 0, done.output
    assert Path("o.csv").read_text("utf-8").startswith("time,plant.x [m],plant.theta [rad],")
    words[2] = "control=control.py:balancing@1 ms"
    assert "did you mean 'balance'" in CliRunner().invoke(main, words).output


TICKING = (Path(__file__).parents[1] / "checking" / "faulty_fmu3.c").read_text("utf-8")
TICKING = TICKING.replace(
    'REFUSED(SetClock, "SET_CLOCK", V, const fmi3Clock value[])',
    """EXPORT fmi3Status fmi3SetClock(fmi3Instance instance, V, const fmi3Clock value[])
{
    SELF;
    ALLOW(EVENT);
    DEMAND(n == 1 && vr[0] == TICK && value[0], "there is one clock");
    self->m.f = self->m.x[0];
    return fmi3OK;
}
""",
)
CLOCKED = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="faulty" instantiationToken="{TOKEN}">
  <CoSimulation modelIdentifier="faulty" canHandleVariableCommunicationStepSize="true" hasEventMode="true"
    mightReturnEarlyFromDoStep="true"/>
  <DefaultExperiment startTime="0" stopTime="1"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="x" valueReference="1" causality="output" initial="exact" start="1 2"><Dimension start="2"/></Float64>
    <Float64 name="u" valueReference="3" causality="input" start="0"/>
    <Float64 name="k" valueReference="4" causality="parameter" variability="tunable" start="2"/>
    <Float64 name="held" valueReference="5" causality="output" variability="discrete"/>
    <Clock name="tick" valueReference="11" causality="input" INTERVAL/>
  </ModelVariables>
  <ModelStructure><Output valueReference="1"/><Output valueReference="5"/></ModelStructure>
</fmiModelDescription>
"""


@pytest.mark.parametrize(
    ("attributes", "interval", "shift"),
    [
        ('intervalVariability="constant" intervalDecimal="0.25" shiftDecimal="0.125"', 0.25, 0.125),
        ('intervalVariability="fixed" intervalCounter="1" resolution="10"', 0.1, 0.0),
    ],
)
def test_clocks_of_an_fmu_tick_at_their_times(attributes: str, interval: float, shift: float, tmp_path) -> None:
    """The FMU, which is right only in event mode, keeps x at each tick; on its way it asks for event mode itself.

    A function of the same sample time hears what the FMU has at that time.
    """
    fmu = by_hand(tmp_path / "c.fmu", TICKING, CLOCKED.replace("INTERVAL", attributes), "3.0")

    def keep(t: float, inputs: dict[str, float]) -> dict[str, float]:
        return {"held": inputs["x"]}

    parts = {"f": fmu, "keep": Controller(keep, interval)}
    run = lag2fmu.simulate(parts, connect=["f.held:keep.x"], step=0.025, stop_time=1.0, outputs=[
        "f.x[1]", "f.held", "keep.held"])  # fmt: skip
    ticks = shift + interval * np.floor((run.time - shift) / interval + 1e-9)
    first = run.time >= shift - 1e-9
    assert run["f.held"][first] == pytest.approx(np.interp(ticks, run.time, run["f.x[1]"])[first], abs=1e-15)
    assert run["f.x[1]"][-1] < 0.5, "it passed its own event"
    if shift == 0.0:
        assert np.array_equal(run["f.held"], run["keep.held"])


def test_a_clock_whose_interval_is_not_said(tmp_path) -> None:
    fmu = by_hand(tmp_path / "c.fmu", TICKING, CLOCKED.replace("INTERVAL", 'intervalVariability="countdown"'), "3.0")
    with pytest.raises(LoadError, match="'f' has the clock 'tick', an input with countdown interval; clocks whose"):
        lag2fmu.simulate({"f": fmu}, stop_time=1.0)
