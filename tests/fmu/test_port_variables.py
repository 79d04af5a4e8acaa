"""What the table [ports] makes of an FMU: its inputs, forces at places, motion of places, drives, terminals."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from describing import described
from lxml import etree
from scipy.integrate import solve_ivp
from stepping import Stepping
from stepping3 import Stepping3

from lag2fmu.checking import check_fmu
from lag2fmu.fmu import Fmu, export
from lag2fmu.fmu.live import page
from lag2fmu.fmu.terminals import Terminal, terminals_of
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.verify.simulate import Run, simulate_fmu
from lag2fmu.verify.validate import validate

pytestmark = pytest.mark.fmu

LIFTED = """
[mechanism]
name = "lifted"
[parameters]
tau = { value = 50, unit = "ms" }
g = { value = 9.81, unit = "m/s2" }
[coordinates]
a = { unit = "rad", start = 0.4 }
[inputs]
y0 = { unit = "m", motion = "filtered", time_constant = "tau", doc = "height of the support" }
wind = { unit = "N", start = 0.5 }
[forces]
a = "-wind*cos(a)"
[gravity]
acceleration = "g"
[bodies.bob]
mass = 2
position = ["sin(a)", "y0 - cos(a)"]
[experiment]
stop_time = 1.0
step = 0.01
[ports]
inputs = ["y0"]
forces = ["bob"]
poses = ["bob"]
accelerations = ["bob"]
drives = ["y0"]
"""
"""A pendulum of 1 m and 2 kg on a support that is lifted; the wind cannot be connected."""
TARGET, PUSH, TAU, STOP = 0.3, (1.5, -2.5), 0.05, 1.0
NAMES = ("a", "a_dot", "y0", "y0_dot", "bob_position_x", "bob_position_y", "bob_acceleration_x", "bob_acceleration_y")


@pytest.fixture(scope="module")
def lifted() -> Mechanism:
    return read(LIFTED, "lifted.toml")


def filtered(t: float) -> tuple[float, float, float]:
    """What a critically damped filter of second order makes of a step at 0, with its derivatives."""
    fading = TARGET * np.exp(-t / TAU)
    return TARGET - fading * (1 + t / TAU), fading * t / TAU**2, fading * (1 - t / TAU) / TAU**2


def rates(t: float, z: np.ndarray) -> list[float]:
    """a_ddot = ((F_x - wind) cos a + F_y sin a)/m - (g + y_ddot) sin a for l = 1."""
    along = (PUSH[0] - 0.5) * np.cos(z[0]) + PUSH[1] * np.sin(z[0])
    return [z[1], along / 2 - (9.81 + filtered(t)[2]) * np.sin(z[0])]


@pytest.fixture(scope="module")
def expected() -> dict[str, float]:
    """The values of NAMES and of the force of the drive at STOP."""
    a, a_dot = solve_ivp(rates, (0.0, STOP), [0.4, 0.0], method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    (y, y_dot, y_ddot), (_, a_ddot) = filtered(STOP), rates(STOP, np.array([a, a_dot]))
    c, s = np.cos(a), np.sin(a)
    bob = (a_ddot * c - a_dot**2 * s, y_ddot + a_ddot * s + a_dot**2 * c)
    values = (a, a_dot, y, y_dot, s, y - c, *bob)
    return {**dict(zip(NAMES, values, strict=True)), "F_y0": 2 * (9.81 + bob[1]) - PUSH[1]}


INPUTS = {"bob_force_x": PUSH[0], "bob_force_y": PUSH[1], "y0_target": TARGET}


@pytest.fixture(
    scope="module",
    params=[
        ("2.0", "co-simulation", "c"),
        ("2.0", "model-exchange", "c"),
        ("3.0", "co-simulation", "c"),
        ("", "", "py"),
    ],
    ids=["2.0", "2.0-ME", "3.0-arrays", "python"],
)
def run(request: pytest.FixtureRequest, lifted: Mechanism, exported: Callable[..., Fmu], tmp_path_factory) -> dict:
    """The values at STOP, of each version and backend."""
    version, kind, backend = request.param
    if backend == "py":
        fmu = export(lifted, tmp_path_factory.mktemp("py") / "lifted.fmu", backend="python")
        with Stepping(fmu.path) as s:
            s.start(tolerance=1e-10)
            s.set(INPUTS)
            for _ in range(10):
                s.step(STOP / 10)
            return dict(zip((*NAMES, "F_y0"), s.get([*NAMES, "F_y0"]), strict=True))
    fmu = exported(lifted, fmi=version, arrays=version == "3.0")
    found = simulate_fmu(fmu.path, Run(STOP, 0.1, 1e-10, values=INPUTS, kind=kind))
    return {name: found[name][-1] for name in (*NAMES, "F_y0")}


def test_forces_go_in_and_motion_and_the_force_of_the_drive_go_out(run: dict[str, float], expected) -> None:
    assert run == pytest.approx(expected, abs=2e-6)


def test_only_chosen_inputs_are_there(lifted: Mechanism) -> None:
    for fmi, arrays in (("2.0", False), ("3.0", True)):
        description, _ = described(lifted, fmi=fmi, arrays=arrays)
        inputs = [v for v in description.variables if v.causality == "input"]
        assert [v.name for v in inputs] == ["y0_target", "bob_force_x", "bob_force_y"]
        assert inputs[0].doc == "height of the support; y0 follows it by a critically damped filter"
        assert {v.name for v in description.variables if v.state} == {"a", "a_dot", "y0", "y0_dot"}
        uses = {name for v in description.variables for name in v.dependencies or ()}
        assert uses <= {v.name for v in description.variables}


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_they_keep_the_rules_of_the_standard(fmi: str, lifted: Mechanism, exported: Callable[..., Fmu]) -> None:
    """Directional derivatives, dependencies and states are tried by running it."""
    assert check_fmu(exported(lifted, fmi=fmi, arrays=fmi == "3.0").path).findings == ()


def test_it_is_validated_on_the_independent_path(lifted: Mechanism, exported: Callable[..., Fmu]) -> None:
    assert validate(exported(lifted).path, stop_time=0.3).passed


# ---------------------------------------------------------------------------------------------------- led by the target


def led(motion: Callable[[float], list[float]]) -> dict[str, float]:
    """The values of NAMES and of the drive at STOP on a support that moves by ``motion``: [y, y_dot, y_ddot, ...]."""

    def rates_on_it(t: float, z: np.ndarray) -> list[float]:
        along = (PUSH[0] - 0.5) * np.cos(z[0]) + PUSH[1] * np.sin(z[0])
        return [z[1], along / 2 - (9.81 + motion(t)[2]) * np.sin(z[0])]

    a, a_dot = solve_ivp(rates_on_it, (0.0, STOP), [0.4, 0.0], method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    (y, y_dot, y_ddot, *_), a_ddot = motion(STOP), rates_on_it(STOP, np.array([a, a_dot]))[1]
    c, s = np.cos(a), np.sin(a)
    bob = (a_ddot * c - a_dot**2 * s, y_ddot + a_ddot * s + a_dot**2 * c)
    values = (a, a_dot, y, y_dot, s, y - c, *bob)
    return {**dict(zip(NAMES, values, strict=True)), "F_y0": 2 * (9.81 + bob[1]) - PUSH[1]}


def parabola(t: float) -> list[float]:
    """A support that is lifted with 3 m/s2, with its derivatives."""
    return [1.5 * t**2, 3.0 * t, 3.0, 0.0]


def wave(t: float) -> list[float]:
    """A support that swings; the target never rests."""
    return [0.1 * np.sin(5 * t), 0.5 * np.cos(5 * t), -2.5 * np.sin(5 * t), -12.5 * np.cos(5 * t)]


def stepped(path: Path, motion: Callable[[float], list[float]], orders: int, length: float) -> dict[str, float]:
    """The values at STOP where the target has its derivatives by time up to ``orders`` in each step."""
    with Stepping(path) as s:
        y, target = motion(0.0), s.references["y0_target"]
        s.start({**INPUTS, "y0": y[0], "y0_dot": y[1]}, tolerance=1e-10)
        for k in range(round(STOP / length)):
            y = motion(k * length)
            s.set({"y0_target": y[0]})
            if orders:
                s.unit.setRealInputDerivatives([target] * orders, [*range(1, orders + 1)], y[1 : orders + 1])
            s.step(length)
        return dict(zip((*NAMES, "F_y0"), s.get([*NAMES, "F_y0"]), strict=True))


def test_a_filtered_motion_is_that_of_the_polynomial(lifted: Mechanism, exported: Callable[..., Fmu]) -> None:
    """With two derivatives of its target a parabola is followed exactly; with none, 2 tau behind."""
    path = exported(lifted).path
    assert stepped(path, parabola, 2, 0.1) == pytest.approx(led(parabola), abs=1e-8)
    assert stepped(path, parabola, 0, 0.001)["y0"] == pytest.approx(parabola(STOP - 2 * TAU)[0], abs=0.02)


def test_a_filtered_motion_by_intermediate_updates(lifted: Mechanism, exported: Callable[..., Fmu]) -> None:
    """FMI 3.0 has no input derivatives: the polynomial goes through what the importer sets within the step."""

    def update(time: float, sets: bool, may: bool) -> None:
        if sets:
            unit.set({"y0_target": parabola(time)[0]})

    path = exported(lifted, fmi="3.0", arrays=True).path
    with Stepping3(path, update=update, intermediate=["y0_target"]) as unit:
        unit.set(INPUTS | {"y0_target": 0.0})
        rows, _ = unit.start(stopTime=STOP, tolerance=1e-10).run([0.0, 0.3, STOP], ["y0", "y0_dot", "F_y0"])
    wanted = led(parabola)
    assert rows[-1] == pytest.approx([wanted[name] for name in ("y0", "y0_dot", "F_y0")], abs=1e-6)


def test_a_filtered_motion_follows_a_wave(lifted: Mechanism, exported: Callable[..., Fmu]) -> None:
    """The error of the angle after 1 s in steps of 10 ms, by the number of derivatives; docs/ports.md has the table."""
    path, wanted = exported(lifted).path, led(wave)
    errors = [abs(stepped(path, wave, n, 0.01)["a"] - wanted["a"]) for n in range(4)]
    assert errors == pytest.approx([3.64e-2, 1.82e-3, 1.18e-4, 6.6e-7], rel=0.02)


def test_a_led_motion_is_rolled_back(lifted: Mechanism, exported: Callable[..., Fmu]) -> None:
    with Stepping(exported(lifted).path) as s:
        s.start(INPUTS)
        target = s.references["y0_target"]
        found = []
        s.step(0.1)
        state = s.unit.getFMUState()
        for _ in range(2):
            s.set({"y0_target": 0.7})
            s.unit.setRealInputDerivatives([target] * 2, [1, 2], [0.4, -3.0])
            found.append([s.step(0.05), s.step(0.02), s.get(["F_y0"])])
            s.unit.setFMUState(state)
            s.time = 0.1
        assert found[0] == found[1]
        s.unit.freeFMUState(state)


# ------------------------------------------------------------------------------------------------------- terminals


def found(mechanism: Mechanism, **of: object) -> dict[str, Terminal]:
    description, _ = described(mechanism, **of)
    return {terminal.name: terminal for terminal in terminals_of(description)}


def test_terminals_are_two_ends_of_a_bond(lifted: Mechanism) -> None:
    """The coordinate of one FMU and the motion of another one match member by member."""
    of = found(lifted)
    assert of["y0"].members == {"coordinate": "y0_target", "force": "F_y0"}
    assert of["a"].members == {"coordinate": "a", "velocity": "a_dot"}  # Q_a is left out
    assert of["bob_port"].members == {
        **{f"force_{x}": f"bob_force_{x}" for x in "xy"},
        **{f"{what}_{x}": f"bob_{what}_{x}" for what in ("position", "acceleration") for x in "xy"},
    }
    assert of["bob_port"].flows == {"force_x", "force_y"}
    ordinary = found(load("motion_driven_pendulum"), outputs=["F_y0", "theta_ddot"])
    rates = {"velocity": "y0_dot", "acceleration": "y0_ddot"}
    assert ordinary["y0"].members == {"coordinate": "y0", **rates, "force": "F_y0"}
    assert ordinary["theta"].members.keys() == ordinary["y0"].members.keys()
    assert {t.kind for t in ordinary.values()} == {"org.lag2fmu.coordinate"}
    assert "force" not in found(load("motion_driven_pendulum"))["y0"].members  # a local variable cannot be connected


def test_arrays_leave_no_input_without_a_terminal() -> None:
    """Where only some of the forces Q are inputs, they are no array; the terminal of the coordinates has them all."""
    text = PAIR.format("Q_b")
    of = found(read(text, "pair.toml"), fmi="3.0", arrays=True)["coordinates"]
    assert of.members == {"coordinate": "q", "velocity": "qd", "force_b": "Q_b"}
    assert "force_b" in of.flows
    whole = found(read(PAIR.format('Q_a", "Q_b'), "pair.toml"), fmi="3.0", arrays=True)["coordinates"]
    assert whole.members == {"coordinate": "q", "velocity": "qd", "force": "Q"}


PAIR = """
[mechanism]
name = "pair"
[coordinates]
a = {{ unit = "m" }}
b = {{ unit = "m" }}
[energy]
kinetic = "a_dot**2 + b_dot**2"
[ports]
inputs = ["{}"]
"""


def test_the_page_shows_declared_units_and_one_of_them_at_first() -> None:
    """An axis in mm has no angle on it; rates follow the units of their coordinates."""
    text = """
[mechanism]
name = "swing"
[coordinates]
x = { unit = "mm" }
phi = { unit = "deg" }
y = { unit = "mm" }
[energy]
kinetic = "x_dot**2 + phi_dot**2 + y_dot**2"
"""
    data = page._data(described(read(text, "swing"))[0], None, None)
    units = {v["name"]: v["unit"] for v in data["variables"]}
    assert data["plot"] == ["x", "y"]
    assert [units[name] for name in ("x", "x_dot", "phi", "phi_dot")] == ["mm", "mm/s", "deg", "deg/s"]
    assert {v["name"]: v["factor"] for v in data["variables"]}["x_dot"] == 1e-3


def test_the_page_takes_a_filtered_motion_for_a_place(lifted: Mechanism) -> None:
    """Its slider goes about the start, as that of a coordinate does."""
    kinds = {v["name"]: v["kind"] for v in page._data(described(lifted)[0], None, None)["variables"]}
    found = [kinds[name] for name in ("a", "y0", "y0_dot", "y0_target")]
    assert found == ["coordinate", "coordinate", "velocity", "input"]


def test_terminals_are_valid(lifted: Mechanism, exported: Callable[..., Fmu]) -> None:
    import fmpy

    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"))
    for fmi in ("2.0", "3.0"):
        with zipfile.ZipFile(exported(lifted, fmi=fmi, arrays=fmi == "3.0").path) as archive:
            schema.assertValid(etree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml")))
