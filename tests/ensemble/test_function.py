"""The equations as plain functions: against the reference, finite differences and CasADi's own differentiation."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from sympy import cos, sin

import lag2fmu
from lag2fmu.description import names
from lag2fmu.ensemble import StateFunction
from lag2fmu.errors import DerivationError, LoadError
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Energy, Mechanism, Part, coordinate

pytestmark = pytest.mark.fmu


@cache
def function(model: str) -> StateFunction:
    return StateFunction(model)


def points(f: StateFunction, *batch: int) -> np.ndarray:
    return f.start["x"] + np.random.default_rng(0).uniform(-0.3, 0.3, (*batch, len(f.start["x"])))


def double_pendulum(x, u, p, cos, sin):  # type: ignore[no-untyped-def]
    """The accelerations by hand: Landau, Lifshitz, Mechanics, section 5, problem 1, for massless rods."""
    a, b, ad, bd = (x[i] for i in range(4))
    m1, m2, l1, l2, g = (p[i] for i in range(5))
    m11, m12, m22 = (m1 + m2) * l1**2, m2 * l1 * l2 * cos(a - b), m2 * l2**2
    f1 = u[0] - m2 * l1 * l2 * sin(a - b) * bd**2 - (m1 + m2) * g * l1 * sin(a)
    f2 = u[1] + m2 * l1 * l2 * sin(a - b) * ad**2 - m2 * g * l2 * sin(b)
    det = m11 * m22 - m12**2
    return [ad, bd, (m22 * f1 - m12 * f2) / det, (m11 * f2 - m12 * f1) / det]


def test_accelerations_with_any_leading_dimensions() -> None:
    f = function("double_pendulum")
    x, u = points(f, 7, 3), np.array([0.3, -0.2])
    expected = np.stack(double_pendulum(np.moveaxis(x, -1, 0), u, f.start["p"], np.cos, np.sin), axis=-1)
    assert np.allclose(f(x, u), expected, rtol=1e-12, atol=1e-12)
    assert np.allclose(f.accelerations(x, u), expected[..., 2:], rtol=1e-12, atol=1e-12)
    p = np.tile(f.start["p"], (3, 1))
    assert np.array_equal(f(x, u, p), f(x, u))
    assert f(x[0, 0]).shape == (4,)
    assert np.array_equal(f(np.tile(x, (2000, 1, 1)), u)[-7:], f(x, u))


@pytest.mark.parametrize("model", ["double_pendulum", "four_bar_linkage", "bricard"])
def test_jacobians_are_differences_of_the_function(model: str) -> None:
    f = function(model)
    known = {"t": np.zeros(()), "x": points(f, 4) if model == "double_pendulum" else f.start["x"][None]}
    known |= {name: f.start[name] for name in ("u", "p")}
    jacobians = f.jacobians(**known)
    for name, jacobian in jacobians.items():
        for j in range(jacobian.shape[-1]):
            step = np.zeros(jacobian.shape[-1])
            step[j] = 1e-5 * max(1.0, float(np.abs(np.atleast_1d(known[name])[..., j]).max()))
            shift = step[0] if name == "t" else step
            up, down = (f(**(known | {name: known[name] + sign * shift})) for sign in (1.0, -1.0))
            assert np.allclose(jacobian[..., j], (up - down) / (2.0 * step[j]), rtol=1e-6, atol=1e-5)
        assert not jacobian[..., ~f.sparsity[name]].any()


def test_long_formulas_under_constraints_are_functions_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """The engine has loops where a formula is long; plain functions have nothing else."""
    f = function("four_bar_linkage")
    monkeypatch.setattr("lag2fmu.dynamics.schur_complement.MOST_OPERATIONS", 10)
    longer = StateFunction("four_bar_linkage")
    assert np.array_equal(longer(f.start["x"]), f(f.start["x"]))


def test_the_external_function_of_casadi(tmp_path: Path) -> None:
    """Values, forward and adjoint derivatives against CasADi's own differentiation of formulas written by hand."""
    ca = pytest.importorskip("casadi", reason="CasADi is not installed")
    f = function("double_pendulum")
    external = ca.external("double_pendulum", str(f.external(tmp_path)))
    assert [external.name_in(i) for i in range(4)] == ["t", "x", "u", "p"]
    assert (tmp_path / "double_pendulum.c").is_file()
    symbols = [ca.SX.sym("t"), ca.SX.sym("x", 4), ca.SX.sym("u", 2), ca.SX.sym("p", 5)]
    own = ca.Function("f", symbols, [ca.vertcat(*double_pendulum(*symbols[1:], ca.cos, ca.sin))])
    at = [0.0, points(f), [0.2, 0.1], f.start["p"]]
    seeds = [1.0, [0.1, 0.2, 0.3, 0.4], [0.5, 0.6], [0.7, 0.8, 0.9, 1.0, 1.1]]
    weights = [1.0, -2.0, 3.0, 0.5]
    for calculate in (
        lambda function: function(*at),
        lambda function: function.forward(1)(*at, function(*at), *seeds),
        lambda function: ca.vertcat(*function.reverse(1)(*at, function(*at), weights)),
    ):
        assert np.allclose(np.array(calculate(external)), np.array(calculate(own)), rtol=1e-10, atol=1e-10)


def circles() -> Mechanism:
    """x'' = cos(x) or sin(x) of four coordinates."""
    q = [coordinate(name, start=0.5) for name in ("a", "b", "c", "d")]
    potential = -sin(q[0]) - sin(q[1]) + cos(q[2]) + cos(q[3])
    return Mechanism("circles", coordinates=q, energy=Energy(sum(x.dot**2 for x in q) / 2, potential))


@pytest.mark.slow
def test_sines_and_cosines_of_many_angles_in_the_external_function(tmp_path: Path) -> None:
    """Within 1 unit in the last place of the C library's, near multiples of pi/2 and far away; NaN as there."""
    f = StateFunction(circles())
    library = ctypes.CDLL(str(f.external(tmp_path)))
    assert "sines_and_cosines" in (tmp_path / "circles.c").read_text("utf-8")
    near = 0.5 * np.pi * np.arange(-400.0, 400.0, 7.0)
    drawn = np.random.default_rng(0).uniform(-1.0, 1.0, 300)
    usual = np.concatenate([near, np.nextafter(near, 9e9), 4.0 * drawn, 1e6 * drawn, 1e-9 * drawn])
    angles = np.concatenate([usual, [0.0, -0.0, 1e6, -1e6, 1e7, -1e15, 1e300, np.nan, np.inf]])
    arguments = [np.zeros(1), np.zeros(8), f.start["u"], f.start["p"]]
    pointers, found = (ctypes.c_void_p * 4)(*(array.ctypes.data for array in arguments)), np.zeros(8)
    results = (ctypes.c_void_p * 1)(found.ctypes.data)
    for angle in angles:
        arguments[1][:4] = angle
        assert library.circles(pointers, results, None, None, 0) == 0
        with np.errstate(invalid="ignore"):
            expected = np.array([np.cos(angle), np.cos(angle), np.sin(angle), np.sin(angle)])
        assert np.array_equal(np.isnan(found[4:]), np.isnan(expected))
        if np.isfinite(angle):
            assert (np.abs(found[4:] - expected) <= np.spacing(np.abs(expected))).all(), angle


def test_it_is_offered_at_the_top() -> None:
    assert repr(lag2fmu.function("pendulum")).startswith("<StateFunction of pendulum: 2 x, 1 u")


def test_what_has_no_plain_function_is_refused() -> None:
    with pytest.raises(DerivationError, match=r"'bouncing_ball' has contacts \(floor\)"):
        StateFunction("bouncing_ball")
    with pytest.raises(LoadError, match=r"x has shape \(3,\); expected \(..., 4\)"):
        function("double_pendulum")(np.zeros(3))
    for bad in ("a", [[0.0] * 4, [0.0]]):
        with pytest.raises(LoadError, match="expected numbers of equal rows"):
            function("double_pendulum")(bad)
    with pytest.raises(LoadError, match="do not broadcast"):
        function("double_pendulum")(np.zeros((3, 4)), np.zeros((2, 2)))


RUBBING = """
[mechanism]
name = "rubbing"
[coordinates]
x = { unit = "m", start = 0.5 }
[bodies.block]
mass = 2.0
position = ["x", 0]
[springs.spring]
stiffness = 8.0
elongation = "x"
[frictions.rail]
on = "x_dot"
force = 0.3
[stops.end]
of = "x"
upper = 1.0
"""


def test_what_makes_events_is_named_and_left_out_by_its_word() -> None:
    """Without friction and stop x'' = -k x / m; in parts of a whole too."""
    rubbing = read(RUBBING, "text")
    words = r"'rubbing' has friction \(rail\) and stops \(end\): .* by without = \[\"friction\", \"stops\"\]; or use an"
    with pytest.raises(DerivationError, match=words):
        lag2fmu.function(rubbing)
    with pytest.raises(DerivationError, match=r'has stops \(end\): .* by without = "stops"; or'):
        lag2fmu.function(rubbing, without="friction")
    f = lag2fmu.function(rubbing, without=["friction", "stops"])
    assert f(np.array([0.5, 1.0])).tolist() == pytest.approx([1.0, -2.0])
    whole = Mechanism("whole", parts=[Part("one", of=rubbing), Part("two", of=rubbing)])
    g = lag2fmu.function(whole, without=["friction", "stops"])
    assert g(np.array([0.5, 0.1, 1.0, 0.0])).tolist() == pytest.approx([1.0, 0.0, -2.0, -0.4])
    with pytest.raises(LoadError, match="without = 'air': known are friction, stops, contacts"):
        lag2fmu.function(rubbing, without="air")


def test_an_fmu_without_friction_has_none(tmp_path: Path) -> None:
    rubbing = read(RUBBING, "text")
    fmu = lag2fmu.export(rubbing, tmp_path / "smooth.fmu", without=["friction", "equations"], page="static")
    assert (fmu.mechanism.frictions, len(fmu.mechanism.stops)) == ((), 1)
    run = lag2fmu.simulate(fmu, stop_time=np.pi / 2, step=np.pi / 2, tolerance=1e-9)
    assert run["x"][-1] == pytest.approx(0.5 * np.cos(np.pi), abs=1e-7)


def test_outputs_beside_the_states() -> None:
    """Accelerations, multipliers and residuals of a linkage: their values, and derivatives as differences."""
    wanted = ["multiplier_loop_x", "b_ddot", "a", "residual_loop_x", names.rate("residual_loop_x")]
    f = lag2fmu.function("four_bar_linkage", outputs=wanted)
    x, n = f.start["x"], len(f.start["x"])
    assert np.array_equal(f(x), function("four_bar_linkage")(x))
    y = f.outputs(x)
    assert y[1:3] == pytest.approx([f(x)[4], x[0]], rel=1e-14)
    assert y[3:] == pytest.approx([0, 0], abs=1e-14)
    jacobian = f.jacobians(x)["x"]
    assert jacobian.shape == (n + len(wanted), n)
    steps = 1e-6 * np.eye(n)
    found = (f.outputs(x + steps) - f.outputs(x - steps)).T / 2e-6
    assert jacobian[n:] == pytest.approx(found, abs=1e-6)


def test_an_unknown_output() -> None:
    with pytest.raises(DerivationError, match=r"'double_pendulum' has no variable 'theta3'; .*theta1"):
        lag2fmu.function("double_pendulum", outputs=["theta3"])
