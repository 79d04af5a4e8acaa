"""What has no mass: problem 5 of the slides in its massless forms, against closed forms and equations by hand."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from sliders import c, g, k, l, m, with_friction
from stepping import Stepping

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.errors import DerivationError, Lag2FmuError
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.verify.entry_points import simulate
from lag2fmu.verify.validate import validate


@pytest.mark.fmu
def test_small_vibrations_have_the_frequency_of_a_longer_pendulum(exported) -> None:
    omega = np.sqrt(g / (l + m * g / (2 * k)))
    with Stepping(exported("slides_problem_5_small").path) as s:
        assert {v.name: v.initial for v in s.description.modelVariables}["x"] == "approx"
        s.start({"solver_tolerance": 1e-11, "phi": 0.15})
        for _ in range(20):
            s.step(0.37)
            x, phi, phi_dot = s.get(["x", "phi", "phi_dot"])
            assert phi == pytest.approx(0.15 * np.cos(omega * s.time), abs=1e-9)
            assert phi_dot == pytest.approx(-0.15 * omega * np.sin(omega * s.time), abs=4e-9)
            assert x == pytest.approx(m * g * phi / (2 * k), abs=1e-15)


@pytest.mark.fmu
def test_what_has_no_mass_follows_a_force_at_once(exported) -> None:
    with Stepping(exported("slides_problem_5_small").path) as s:
        s.start({"phi": 0.0})
        s.set({"Q_x": 20.0})  # on the slider alone: it jumps, and the rod's end stays where it is
        s.step(1e-6)
        x, phi, end = s.get(["x", "phi", "x_m"])
        assert end == pytest.approx(0.0, abs=1e-9)
        assert 2 * k * x == pytest.approx(20.0 + m * g * phi, abs=1e-9)


@pytest.mark.fmu
def test_friction_on_what_has_no_mass_gives_an_equation_of_first_order(exported) -> None:
    # s = x + l phi:  s'' = -g (s - x) / l,  c x' = m g (s - x) / l - 2 k x
    A = np.array([[0, 1, 0], [-g / l, 0, g / l], [m * g / (l * c), 0, -m * g / (l * c) - 2 * k / c]])
    with Stepping(exported(with_friction()).path) as s:
        s.start({"solver_tolerance": 1e-11, "x": 0.03})
        x, phi, x_dot, phi_dot = s.get(["x", "phi", "x_dot", "phi_dot"])
        z = np.array([x + l * phi, x_dot + l * phi_dot, x])
        assert x == pytest.approx(0.03, abs=1e-15)
        for i in range(1, 15):
            s.step(0.11)
            x, phi = s.get(["x", "phi"])
            truth = expm(A * 0.11 * i) @ z
            assert (x, x + l * phi) == pytest.approx((truth[2], truth[0]), abs=1e-9)


PUSH = np.polynomial.Polynomial([3.0, 20.0, -8.0, 5.0])
"""A force on the slider in N, by the time in s."""


def pushed(friction: bool, start: list[float], t: float) -> tuple[list[float], float]:
    """By hand, after ``t``: x, s = x + l phi, their velocities, and x''; started with s, s', x."""

    def slider(t: float, z: np.ndarray) -> tuple[float, float]:
        s, s_dot, x = z
        if friction:  # c x' + 2 k x = m g phi + PUSH
            return x, (m * g * (s - x) / l - 2 * k * x + PUSH(t)) / c
        stiffness = 2 * k + m * g / l
        return (m * g * s / l + PUSH(t)) / stiffness, (m * g * s_dot / l + PUSH.deriv()(t)) / stiffness

    def slope(t: float, z: np.ndarray) -> list[float]:
        x, x_dot = slider(t, z)
        return [z[1], -g * (z[0] - x) / l, x_dot]

    z = solve_ivp(slope, (0, t), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    (x, x_dot), s_ddot = slider(t, z), slope(t, z)[1]
    if friction:
        x_ddot = (m * g * (z[1] - x_dot) / l - 2 * k * x_dot + PUSH.deriv()(t)) / c
    else:
        x_ddot = (m * g * s_ddot / l + PUSH.deriv(2)(t)) / (2 * k + m * g / l)
    return [x, z[0], x_dot, z[1]], x_ddot


@pytest.mark.fmu
@pytest.mark.parametrize("friction", [True, False])
def test_what_has_no_mass_under_a_force_with_derivatives(friction: bool, exported) -> None:
    """The equilibrium moves with the force: its first and second derivatives are in the equations."""
    fmu = exported(with_friction(friction))
    for tolerance in (1e-6, 1e-9):
        with Stepping(fmu.path) as s:
            s.start({"solver_tolerance": tolerance, "Q_x": PUSH(0.0)})
            push = [s.references["Q_x"]] * 3
            for i in range(10):
                s.set({"Q_x": PUSH(s.time)})
                s.unit.setRealInputDerivatives(push, [1, 2, 3], [PUSH.deriv(k)(s.time) for k in (1, 2, 3)])
                if i == 0:
                    x, phi, x_dot, phi_dot = s.get(["x", "phi", "x_dot", "phi_dot"])
                    start = [x + l * phi, x_dot + l * phi_dot, x]
                s.step(0.1)
            x, phi, x_dot, phi_dot = s.get(["x", "phi", "x_dot", "phi_dot"])
            truth, x_ddot = pushed(friction, start, 1.0)
            assert [x, x + l * phi, x_dot, x_dot + l * phi_dot] == pytest.approx(truth, abs=2 * tolerance)
            rates = s.unit.getRealOutputDerivatives([s.references[name] for name in ("x", "x", "x_dot")], [1, 2, 1])
            assert list(rates) == pytest.approx([truth[2], x_ddot, x_ddot], abs=20 * tolerance)


@pytest.mark.fmu
@pytest.mark.slow
@pytest.mark.parametrize("friction", [True, False])
def test_the_fmu_agrees_with_direct_integration(friction: bool) -> None:
    report = validate(with_friction(friction))
    assert report.passed
    assert friction or any("no force belongs to massless_x" in check.name for check in report.checks)


@pytest.mark.fmu
def test_the_exact_form_runs_to_its_singular_position_and_stops_there() -> None:
    """By hand: with p = x + l sin(phi), q = -l cos(phi) of the bob, m p'' = -2 k x, the rod's force along the rod."""

    def slope(t: float, z: np.ndarray) -> list[float]:
        x, phi, x_dot, phi_dot = z
        # the rod pulls with S along itself: 2 k x = -S sin(phi) on the slider, which has no mass
        pull = 2 * k * x / np.sin(phi)
        p, q = -pull * np.sin(phi) / m, pull * np.cos(phi) / m - g
        # p = x'' + l (phi'' cos - phi'^2 sin), q = l (phi'' sin + phi'^2 cos)
        phi_ddot = (q / l - phi_dot**2 * np.cos(phi)) / np.sin(phi)
        return [x_dot, phi_dot, p - l * (phi_ddot * np.cos(phi) - phi_dot**2 * np.sin(phi)), phi_ddot]

    mechanism = load("slides_problem_5_massless")
    truth = solve_ivp(slope, (0, 0.2), [0.02, 1.0, 0, 0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    run = simulate(mechanism, stop_time=0.2, step=0.01, tolerance=1e-11)
    assert [run[name][-1] for name in ("x", "phi", "x_dot", "phi_dot")] == pytest.approx(truth, rel=1e-8)
    with pytest.raises(Lag2FmuError, match=r"mass matrix becomes singular and does not determine .* of x, phi"):
        simulate(mechanism, stop_time=1.0, step=0.01)


@pytest.mark.fmu
@pytest.mark.parametrize("step", [5e-4, 2e-3, 0.01])
def test_fixed_steps_do_not_leap_over_the_singular_position(step: float, exported) -> None:
    """The exact motion ends there at 0.3899 s; beyond it results would be an invention."""
    with Stepping(exported("slides_problem_5_massless", solver="ros2").path) as s:
        s.start({"solver_step": step})
        with pytest.raises(FMICallException):
            s.steps(50, 0.02)
        assert s.time == pytest.approx(0.36, abs=0.021)
        assert any("mass matrix becomes singular" in sentence for sentence in s.sentences)


def test_the_equilibrium_follows_and_is_not_part_of_the_text() -> None:
    mechanism = load("slides_problem_5_small")
    completed = with_derived(mechanism)
    (equilibrium,) = completed.constraints
    assert (equilibrium.name, equilibrium.kind) == ("massless_x", "equilibrium")
    assert completed.origins == {"constraints.massless_x": "coordinates.x"}
    assert completed == mechanism
    assert write(completed) == write(mechanism)
    assert with_derived(read(write(completed), "text")).constraints == completed.constraints
    assert derive(with_friction()).mechanism.constraints[0].kind == "damped_equilibrium"


@pytest.mark.parametrize(
    ("energy", "sentence"),
    [
        ({"kinetic": "y_dot**2/2", "potential": "y**2", "dissipation": "0*x_dot"}, "appears in no energy"),
        (
            {"kinetic": "y_dot**2/2", "potential": "x*y"},
            "along x has no mass, and the force on it depends on no",
        ),
        ({"kinetic": "y_dot**2/2", "potential": "y + sin(x) + 2*x"}, "massless_x is the force on x, .* cannot be met"),
        ({"kinetic": "x*y_dot**2/2 + y_dot**2", "potential": "x**2"}, "is not affine|depends on no velocity along it"),
    ],
)
def test_a_massless_coordinate_that_nothing_determines_is_refused(energy: dict[str, str], sentence: str) -> None:
    lines = "\n".join(f'{key} = "{value}"' for key, value in energy.items())
    text = f'[mechanism]\nname = "odd"\n[coordinates]\nx = {{ start = 1 }}\ny = {{ start = 1 }}\n[energy]\n{lines}\n'
    with pytest.raises(Lag2FmuError, match=sentence) as caught:
        derive(read(text, "odd.toml"))
    assert isinstance(caught.value, DerivationError) or "appears" in sentence


@pytest.mark.parametrize(
    ("element", "refused"),
    [
        ('[frictions.rubs]\non = "x_dot - b_dot"\nforce = 0.5', True),
        ('[stops.rubs]\nof = "b"\nupper = 1', True),
        ('[contacts.rubs]\ngap = "1 - b"', True),
        ('[constraints.holonomic]\nrubs = { expression = "b - 1", while = "t - 1" }', True),
        ('[frictions.rubs]\non = "x_dot"\nforce = 0.5', False),
    ],
)
@pytest.mark.parametrize("dissipation", ["", 'dissipation = "b_dot**2/2"\n'])
def test_forces_of_events_on_what_has_no_mass_are_refused(element: str, refused: bool, dissipation: str) -> None:
    """The equilibrium of b bore them, so that a friction of 0.5 N showed itself and moved nothing."""
    start = "start = 0.1" if dissipation else "guess = 0.1"
    text = (
        f'[mechanism]\nname = "odd"\n[coordinates]\nx = {{ start = 0.3 }}\nb = {{ {start} }}\n[energy]\n'
        f'kinetic = "x_dot**2/2"\npotential = "5*(x - b)**2 + 15*b**2"\n{dissipation}{element}\n'
    )
    mechanism = read(text, "odd.toml")
    if not refused:
        assert len(derive(mechanism).rows) == 1
        return
    with pytest.raises(DerivationError, match=r"'rubs(_upper)?' acts on b, which has no mass"):
        derive(mechanism)
