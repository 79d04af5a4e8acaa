"""A, B, C, D with names and units: closed forms, small motions of the FMU, files, other packages."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from scipy.io import loadmat
from sympy import cos, sin

import lag2fmu
from lag2fmu.analysis import linearize
from lag2fmu.analysis.at_rest import resting
from lag2fmu.dynamics import derive
from lag2fmu.errors import DerivationError, ExportError, LoadError
from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import load
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism import Body, Constraint, Energy, Mechanism, Output, Ports, Spring, State, coordinate, signal
from lag2fmu.verify.entry_points import simulate

G = 9.81


def cart(ports: Ports | None = None, **more: object) -> Mechanism:
    """A cart of 2 kg, a pole of 0.5 kg with its mass at the tip, 0.8 m below; F pulls the cart."""
    x, theta, F = coordinate("x", "m"), coordinate("theta", "rad", **more), signal("F", "N")
    tip = (x + 0.8 * sin(theta), -0.8 * cos(theta))
    return Mechanism(
        "cart",
        coordinates=[x, theta],
        inputs=[F],
        bodies=[Body("cart", 2, (x, 0)), Body("tip", 0.5, tip)],
        gravity=G,
        forces={x: F},
        outputs=[Output("x_tip", tip[0], "mm")],
        ports=ports or Ports(),
    )


@pytest.mark.parametrize(("start", "side"), [(0.1, -1), (3.0, 1)])
def test_a_pole_on_a_cart_hanging_and_upright(start: float, side: int) -> None:
    """(M + m) x" + m l th" = F, l th" + x" = side g th th from the equilibrium; up, x counts the other way."""
    M, m, length = 2.0, 0.5, 0.8
    outputs = ["x", "x_tip", "theta_ddot"]
    found = lag2fmu.linearize(cart(start=start), "equilibrium", outputs=outputs).state_space(["F"])
    assert [x.name for x in found.states] == ["x", "theta", "x_dot", "theta_dot"]
    assert found.states[1].value == pytest.approx(0.0 if side < 0 else np.pi, abs=1e-12)
    turned = -side  # cos(theta) there
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2, 1], A[3, 1] = m * G / M, side * (M + m) * G / (M * length)
    B = np.array([[0], [0], [1 / M], [-turned / (M * length)]])
    assert pytest.approx(A, abs=1e-12) == found.A
    assert pytest.approx(B, abs=1e-12) == found.B
    assert pytest.approx(np.array([[1, 0, 0, 0], [1, turned * length, 0, 0], A[3]]), abs=1e-12) == found.C
    assert pytest.approx(np.array([[0], [0], B[3]]), abs=1e-12) == found.D
    assert found.resting
    rate = np.sqrt((M + m) * G / (M * length))
    fast = [pole for pole in found.poles if pole.frequency > 1e-6]
    assert [pole.frequency for pole in fast] == pytest.approx([rate, rate], rel=1e-9)
    assert [pole.damping for pole in fast] == pytest.approx([0, 0] if side < 0 else [1, -1], abs=1e-9)


def test_a_pendulum_about_a_state_that_does_not_rest() -> None:
    a = 0.7
    theta = coordinate("theta", "rad", start=a)
    pendulum = Mechanism("p", coordinates=[theta], bodies=[Body("b", 1, (2 * sin(theta), -2 * cos(theta)))], gravity=G)
    found = lag2fmu.linearize(pendulum, outputs=["potential_energy"]).state_space()
    assert pytest.approx(np.array([[0, 1], [-G / 2 * np.cos(a), 0]]), abs=1e-12) == found.A
    assert found.drift == pytest.approx([0, -G / 2 * np.sin(a)], abs=1e-12)
    assert not found.resting
    assert pytest.approx(np.array([[2 * G * np.sin(a), 0]]), abs=1e-12) == found.C
    assert found.outputs[0] == ("potential_energy", "J", pytest.approx(-2 * G * np.cos(a)))


def test_a_four_bar_linkage_in_minimal_form() -> None:
    """A parallelogram's coupler does not turn: (2 I + (m / 2 + mc) l^2) th" = M - (m + mc) g l th."""
    m, mc, length, base, inertia = 0.4, 0.9, 0.3, 0.7, 0.01
    a, M = coordinate("a", "rad", start=0.1), signal("M", "N.m")
    b, c = coordinate("b", "rad", guess=0.1), coordinate("c", "rad", guess=0.0)
    pin = (length * sin(a), -length * cos(a))
    loop = [pin[0] + base * cos(c) - base - length * sin(b), pin[1] + base * sin(c) + length * cos(b)]
    linkage = Mechanism(
        "parallelogram",
        coordinates=[a, b, c],
        inputs=[M],
        bodies=[
            Body("first", m, (pin[0] / 2, pin[1] / 2), angle=a, inertia=inertia),
            Body("second", m, (base + length * sin(b) / 2, -length * cos(b) / 2), angle=b, inertia=inertia),
            Body("coupler", mc, (pin[0] + base * cos(c) / 2, pin[1] + base * sin(c) / 2), angle=c, inertia=inertia),
        ],
        gravity=G,
        forces={a: M},
        constraints=[Constraint(f"loop_{i}", x) for i, x in zip("xy", loop, strict=True)],
    )
    found = lag2fmu.linearize(linkage, "equilibrium", outputs=["a", "b", "c"]).state_space(["M"])
    J = 2 * inertia + (m / 2 + mc) * length**2
    assert len(found.states) == 2
    assert found.states[0].name in "ab"
    assert pytest.approx(np.array([[0, 1], [-(m + mc) * G * length / J, 0]]), rel=1e-9, abs=1e-10) == found.A
    assert pytest.approx(np.array([[0], [1 / J]]), rel=1e-9) == found.B
    assert pytest.approx(np.array([[1, 0], [1, 0], [0, 0]]), abs=1e-10) == found.C


def chain(n: int) -> Mechanism:
    """``n`` masses of 2 kg in a row between walls, with springs of 50 N/m."""
    x = [coordinate(f"x{i}", "m", start=0.01) for i in range(n)]
    ends = [0, *x, 0]
    V = sum(25 * (ends[i + 1] - ends[i]) ** 2 for i in range(n + 1))
    return Mechanism("chain", coordinates=x, energy=Energy(kinetic=sum(y.dot**2 for y in x), potential=V))


def test_a_chain_of_springs_and_masses() -> None:
    """Frequencies 2 sqrt(k/m) sin(i pi / (2 n + 2)); start at rest in equilibrium."""
    found = lag2fmu.linearize(chain(5), "equilibrium").state_space()
    expected = 10 * np.sin(np.arange(1, 6) * np.pi / 12)
    assert [pole.frequency for pole in found.poles[::2]] == pytest.approx(expected, rel=1e-9)
    assert all(pole.value.imag > 0 and abs(pole.damping) < 1e-9 for pole in found.poles[::2])


def test_steps_of_the_linear_system_are_small_motions_of_the_fmu(exported: Callable[..., Fmu]) -> None:
    """A step of the force on the cart, hanging pole with friction; the rest is of third order in the amplitude."""
    from scipy.signal import lsim

    found = lag2fmu.linearize("cart_pole", "equilibrium", outputs=["x", "theta"])
    time, step = np.linspace(0, 3, 301), 1e-3
    run = simulate(
        exported("cart_pole"),
        stop_time=3.0,
        step=0.01,
        tolerance=1e-11,
        values={"theta": 0.0},
        inputs={"time": time, "F": np.full(301, step)},
    )
    _, y, _ = lsim(found.state_space(["F"]).scipy(), np.full(301, step), time)
    for i, name in enumerate(("x", "theta")):
        assert run[name] == pytest.approx(y[:, i], abs=2e-7 * np.abs(y[:, i]).max())


def test_the_state_at_a_time_is_that_of_the_run(exported: Callable[..., Fmu]) -> None:
    found = lag2fmu.linearize("cart_pole", 0.5)
    run = simulate(exported("cart_pole"), stop_time=0.5, step=0.5, tolerance=1e-10)
    q, qd = (np.array([run[f"{name}{dot}"][-1] for name in ("x", "theta")]) for dot in ("", "_dot"))
    assert found.values["t"] == 0.5
    assert pytest.approx(linearize(derive(load("cart_pole")), q, qd).A, rel=1e-6, abs=1e-8) == found.A


def test_a_mechanism_that_starts_in_its_equilibrium() -> None:
    """At rest, further states included; derived again it stays there."""
    x, z = coordinate("x", "m", start=1.0, velocity=2.0), State("z", derivative=3 - symbol("z") - symbol("x"))
    mechanism = Mechanism(
        "m",
        coordinates=[x],
        states=[z],
        bodies=[Body("b", 2, (0, x))],
        springs=[Spring("s", 50, elongation=x)],
        gravity=10,
    )
    found = resting(mechanism)
    assert (found.coordinates[0].start, found.coordinates[0].velocity) == (pytest.approx(-0.4), 0)
    assert found.states[0].start == pytest.approx(3.4)
    assert lag2fmu.linearize(found).state_space().resting
    with pytest.raises(ExportError, match="unknown start 'rest'; known are given, equilibrium"):
        lag2fmu.export(mechanism, start="rest")


def test_inputs_are_those_of_the_fmu() -> None:
    """What the ports leave out is no column unless it is named."""
    equations = derive(cart(ports=Ports(["F"])))
    about = linearize(equations)
    assert [u.name for u in about.state_space().inputs] == ["F"]
    assert [u.name for u in about.state_space(["Q_theta"]).inputs] == ["Q_theta"]


def test_files_and_other_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = linearize(derive(cart()), outputs=["x_tip"]).state_space(["F"])
    for ending in (".json", ".npz", ".mat"):
        found.save(tmp_path / f"abcd{ending}")
    plain = json.loads((tmp_path / "abcd.json").read_text("utf-8"))
    assert (plain["inputs"], plain["input_units"], plain["input_values"]) == (["F"], ["N"], [0.0])
    arrays, cells = np.load(tmp_path / "abcd.npz"), loadmat(tmp_path / "abcd.mat", simplify_cells=True)
    assert list(arrays["states"]) == list(cells["states"]) == plain["states"] == ["x", "theta", "x_dot", "theta_dot"]
    for name in "ABCD":
        assert np.array_equal(arrays[name], getattr(found, name))
        assert np.array_equal(np.squeeze(cells[name]), np.squeeze(arrays[name]))
        assert np.array_equal(np.array(plain[name]), arrays[name])
    with pytest.raises(ExportError, match=r"its ending must be one of \.json, \.mat, \.npz"):
        found.save(tmp_path / "abcd.csv")
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ExportError, match="pip install control"):
        found.control()
    stand_in = ModuleType("control")
    vars(stand_in)["ss"] = lambda *matrices, **names: SimpleNamespace(matrices=matrices, **names)
    monkeypatch.setitem(sys.modules, "control", stand_in)
    assert found.control().inputs == ["F"]


def test_names_and_places_that_are_none() -> None:
    equations = derive(cart())
    with pytest.raises(DerivationError, match="'thta' is no output; did you mean 'theta'"):
        linearize(equations, outputs=["thta"])
    with pytest.raises(LoadError, match=r"outputs: 'theta' is one text; give a list of names, such as \['theta'\]"):
        linearize(equations, outputs="theta")
    with pytest.raises(DerivationError, match="the sample time 'a' s is not positive"):
        linearize(equations).state_space(["F"]).sampled("a")  # type: ignore[arg-type]
    with pytest.raises(DerivationError, match="'G' is no input; known are Q_x, Q_theta, F"):
        linearize(equations).state_space(["G"])
    with pytest.raises(DerivationError, match="give 'start', 'equilibrium' or a time"):
        lag2fmu.linearize(equations, "-1")
    x = coordinate("x", "m")
    falling = Mechanism("falling", coordinates=[x], bodies=[Body("b", 1, (0, x))], gravity=G)
    with pytest.raises(DerivationError, match="'falling': no equilibrium was found"):
        lag2fmu.linearize(falling, "equilibrium")


# -------------------------------------------------------------------------------------------------------- for control


def masses(*, pushed: str) -> Mechanism:
    """Three masses of 2 kg in a row, with springs of 8 N/m between them; F pushes one of them."""
    a, b, c = (coordinate(name, "m") for name in "abc")
    springs = [Spring("left", 8.0, elongation=b - a), Spring("right", 8.0, elongation=c - b)]
    return Mechanism(
        "row",
        coordinates=[a, b, c],
        inputs=[signal("F", "N")],
        bodies=[Body(q.name, 2.0, (q, 0)) for q in (a, b, c)],
        springs=springs,
        forces={pushed: symbol("F")},
    )


def test_samples_of_a_free_mass() -> None:
    x, F = coordinate("x", "m"), signal("F", "N")
    m = Mechanism("m", coordinates=[x], inputs=[F], bodies=[Body("b", 2.0, (x, 0))], forces={x: F})
    found = lag2fmu.linearize(m, outputs=["x"]).state_space(["F"]).sampled(0.1)
    assert pytest.approx(np.array([[1, 0.1], [0, 1]]), abs=1e-15) == found.A
    assert pytest.approx(np.array([[0.0025], [0.05]]), abs=1e-15) == found.B
    assert found.step == 0.1


def test_samples_with_a_drift_are_those_of_scipy() -> None:
    """The drift is one more input that is held; poles are those of the motion between the samples."""
    from scipy.signal import cont2discrete

    linear = lag2fmu.linearize(cart(start=0.7), outputs=["theta"]).state_space(["F"])
    found, h = linear.sampled(0.05), 0.05
    whole = (linear.A, np.column_stack([linear.B, linear.drift]), linear.C, np.zeros((1, 2)))
    A, B, *_ = cont2discrete(whole, h)
    assert pytest.approx(A, rel=1e-12) == found.A
    assert pytest.approx(B, rel=1e-12) == np.column_stack([found.B, found.drift])
    assert np.array([x.value for x in found.poles]) == pytest.approx(
        np.array([x.value for x in linear.poles]), abs=1e-6
    )
    system = found.scipy()
    assert (system.dt, system.A.shape) == (h, (4, 4))


def test_a_sample_time_is_positive_and_given_once() -> None:
    linear = lag2fmu.linearize(cart()).state_space()
    with pytest.raises(DerivationError, match="the sample time 0 s is not positive"):
        linear.sampled(0)
    with pytest.raises(DerivationError, match=r"is sampled already, every 0\.1 s"):
        linear.sampled(0.1).sampled(0.1)


def test_files_know_the_sample_time(tmp_path: Path) -> None:
    lag2fmu.linearize(cart()).state_space().sampled(0.1).save(tmp_path / "x.json")
    assert json.loads((tmp_path / "x.json").read_text())["step"] == 0.1


def test_the_place_of_a_cart_does_not_show_in_its_pole() -> None:
    hanging = lag2fmu.linearize(cart(start=0.1), "equilibrium", outputs=["theta"]).state_space(["F"])
    for found in (hanging, hanging.sampled(0.1)):
        assert found.uncontrollable == ((), ())
        assert found.unobservable.states == ("x", "x_dot")
        assert np.array([x.value for x in found.unobservable.poles]) == pytest.approx([0, 0], abs=1e-6)


def test_a_push_in_the_middle_leaves_the_antisymmetric_mode_alone() -> None:
    """a - c moves by itself, with the frequency sqrt(k/m) = 2 rad/s; so neither a nor c is controllable alone."""
    found = lag2fmu.linearize(masses(pushed="b"), outputs=["b"]).state_space(["F"])
    for hidden in (found.uncontrollable, found.unobservable):
        assert hidden.states == ("a", "c", "a_dot", "c_dot")
        assert np.array([x.value for x in hidden.poles]) == pytest.approx([2j, -2j], abs=1e-9)
    at_the_end = lag2fmu.linearize(masses(pushed="a"), outputs=["a"]).state_space(["F"])
    assert at_the_end.uncontrollable == at_the_end.unobservable == ((), ())


def test_no_input_moves_anything() -> None:
    found = lag2fmu.linearize(masses(pushed="b"), outputs=["b"]).state_space([])
    assert found.uncontrollable.states == ("a", "b", "c", "a_dot", "b_dot", "c_dot")
    assert len(found.uncontrollable.poles) == 6
