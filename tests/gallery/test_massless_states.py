"""Coordinates without mass are outputs, no states: model exchange against closed forms and direct integration."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq
from sliders import c, g, k, l, m, with_friction
from stepping import Stepping, bits

from lag2fmu.dynamics import derive
from lag2fmu.errors import MechanismError, SimulationError
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Constraint, Energy, Mechanism, coordinate, parameter
from lag2fmu.verify.entry_points import simulate

hard = 2e4


def hardening() -> Mechanism:
    """Small vibrations; the springs of the massless slider become stiffer: 2 k x + 4 k3 x^3 = m g phi."""
    x, phi = coordinate("x", "m", nominal=0.1), coordinate("phi", "rad", start=0.5)
    k3 = parameter("k3", hard, "N/m3")
    return Mechanism(
        "hardening_slider",
        coordinates=[x, phi],
        parameters=[k3],
        energy=Energy(m * (x.dot + l * phi.dot) ** 2 / 2, k * x**2 + k3 * x**4 + m * g * l * phi**2 / 2),
    )


def slider_of(phi: float, force: float = 0.0) -> float:
    """x of the hardening slider in equilibrium with the angle, and with a force on the slider."""
    return brentq(lambda x: 2 * k * x + 4 * hard * x**3 - m * g * phi - force, -1, 1, xtol=1e-16)


def by_hand(times: np.ndarray, bob: float) -> np.ndarray:
    """phi of the hardening slider at ``times``, released at rest with the bob at this place: m bob'' = -m g phi."""

    def angle(s: float) -> float:
        return brentq(lambda phi: slider_of(phi) + l * phi - s, -2, 2, xtol=1e-15)

    run = solve_ivp(
        lambda t, z: [z[1], -g * angle(z[0])], (0, times[-1]), [bob, 0], "DOP853", times, rtol=1e-11, atol=1e-12
    )
    return np.array([angle(s) for s in run.y[0]])


def exchanged(path: Path, names: Sequence[str], stop_time: float, **options: Any) -> dict[str, np.ndarray]:
    """A run of the FMU in model exchange with CVode."""
    run = fmpy.simulate_fmu(
        str(path),
        fmi_type="ModelExchange",
        stop_time=stop_time,
        output_interval=stop_time / 20,
        relative_tolerance=1e-10,
        output=["time", *names],
        **options,
    )
    return {name: run[name] for name in ("time", *names)}


@pytest.mark.fmu
def test_of_what_has_no_mass_neither_position_nor_velocity_is_a_state(exported) -> None:
    with Stepping(exported("slides_problem_5_small").path, "ModelExchange") as s:
        assert s.states_of_derivatives == ["phi", "phi_dot"]
        assert s.description.numberOfContinuousStates == 2
        variables = {v.name: v for v in s.description.modelVariables}
        for name in ("x", "x_dot"):
            assert (variables[name].causality, variables[name].initial) == ("output", "approx")
            assert variables[name].start is not None
        listed = {u.variable.name: [d.name for d in u.dependencies] for u in s.description.outputs}
        assert listed["x"] == ["phi", "Q_x", "Q_phi"]
        assert listed["x_dot"] == ["phi_dot"]
        initial = {u.variable.name: [d.name for d in u.dependencies] for u in s.description.initialUnknowns}
        assert initial["x_dot"] == ["phi_dot", "m", "l", "k", "g"]  # of l where Q_phi has a derivative
        s.start({"phi": 0.2, "phi_dot": 0.3})
        assert s.get(["x", "x_dot"]) == pytest.approx([m * g * 0.2 / (2 * k), m * g * 0.3 / (2 * k)], rel=1e-14)
        with pytest.raises(FMICallException):
            s.set({"x": 0.1})
        assert 'x is fixed in state "continuous-time mode"' in s.sentences[-1]


@pytest.mark.fmu
def test_the_documentation_says_what_is_no_state(exported) -> None:
    with zipfile.ZipFile(exported("slides_problem_5_small", without=()).path) as archive:
        page = " ".join(archive.read("documentation/index.html").decode().split())
    assert "Its 2 states are" in page
    assert page.index("Without mass: outputs that follow from the states") < page.index("<code>x_dot</code>")
    assert "What has no mass is no state" in page


@pytest.mark.fmu
def test_a_force_that_moves_in_co_simulation(exported) -> None:
    """Q_x = 20 sin 7t as cubics in each step, which leave 20 (7 H)^4 / 4! / 2k at most; the bob has s'' = -g phi."""
    path, amplitude, pulse, H = exported("slides_problem_5_small").path, 20.0, 7.0, 0.0125
    angle = lambda s, t: (s - amplitude * np.sin(pulse * t) / (2 * k)) / (l + m * g / (2 * k))  # noqa: E731
    with Stepping(path) as s:
        s.start({"solver_tolerance": 1e-10})
        x, phi = s.get(["x", "phi"])
        for _ in range(80):
            sine, cosine = amplitude * np.sin(pulse * s.time), amplitude * np.cos(pulse * s.time)
            s.set({"Q_x": sine})
            rates = [pulse * cosine, -(pulse**2) * sine, -(pulse**3) * cosine]
            s.unit.setRealInputDerivatives([s.references["Q_x"]] * 3, [1, 2, 3], rates)
            s.step(H)
        run = solve_ivp(lambda t, z: [z[1], -g * angle(z[0], t)], (0, 1), [x + l * phi, 0], "DOP853", rtol=1e-11)
        assert s.get(["phi"])[0] == pytest.approx(angle(run.y[0, -1], 1.0), abs=1e-6)


@pytest.mark.fmu
def test_small_vibrations_in_model_exchange(exported) -> None:
    omega = np.sqrt(g / (l + m * g / (2 * k)))
    run = exchanged(exported("slides_problem_5_small").path, ["x", "phi", "x_dot"], 5.0, start_values={"phi": 0.15})
    assert run["phi"] == pytest.approx(0.15 * np.cos(omega * run["time"]), abs=1e-7)
    assert run["x"] == pytest.approx(m * g * run["phi"] / (2 * k), abs=1e-15)
    assert run["x_dot"] == pytest.approx(-0.15 * omega * np.sin(omega * run["time"]) * m * g / (2 * k), abs=1e-7)


@pytest.mark.fmu
def test_with_friction_the_position_is_a_state_and_the_velocity_is_not(exported) -> None:
    # s = x + l phi:  s'' = -g (s - x) / l,  c x' = m g (s - x) / l - 2 k x
    A = np.array([[0, 1, 0], [-g / l, 0, g / l], [m * g / (l * c), 0, -m * g / (l * c) - 2 * k / c]])
    path = exported(with_friction()).path
    with Stepping(path, "ModelExchange") as s:
        assert s.states_of_derivatives == ["x", "phi", "phi_dot"]
        s.start({"x": 0.03})
        x, phi, x_dot, phi_dot = s.get(["x", "phi", "x_dot", "phi_dot"])
        assert x == 0.03
        assert c * x_dot == pytest.approx(m * g * phi - 2 * k * x, rel=1e-12)
    run = exchanged(path, ["x", "phi"], 1.5, start_values={"x": 0.03})
    z = np.array([x + l * phi, x_dot + l * phi_dot, x])
    truth = np.array([expm(A * t) @ z for t in run["time"]])
    assert run["x"] == pytest.approx(truth[:, 2], abs=1e-8)
    assert run["x"] + l * run["phi"] == pytest.approx(truth[:, 0], abs=1e-8)


@pytest.mark.fmu
def test_an_equilibrium_that_is_not_linear_in_both_kinds_of_run(exported) -> None:
    path = exported(hardening()).path
    bob = slider_of(0.5) + l * 0.5
    run = exchanged(path, ["x", "phi"], 2.0)
    truth = by_hand(run["time"], bob)
    assert run["phi"] == pytest.approx(truth, abs=5e-8)
    assert run["x"] == pytest.approx([slider_of(phi) for phi in truth], abs=5e-9)
    with Stepping(path) as s:
        s.start({"solver_tolerance": 1e-10, "x": 0.3})  # a guess, which is solved
        assert s.get(["x"])[0] == pytest.approx(slider_of(0.5), abs=1e-14)
        s.step(2.0)
        assert s.get(["phi", "x"]) == pytest.approx([truth[-1], slider_of(truth[-1])], abs=1e-8)


@pytest.mark.fmu
@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_directional_derivatives_are_those_of_the_equilibrium(exported, kind: str) -> None:
    with Stepping(exported(hardening()).path, kind) as s:
        s.start({"phi_dot": 0.7, "solver_tolerance": 1e-10})
        if kind == "CoSimulation":
            s.step(0.2)
        x, phi_dot = s.get(["x", "phi_dot"])
        slope = m * g / (2 * k + 12 * hard * x**2)
        assert s.derivative(["x", "x_dot"], {"phi": 1.0}) == pytest.approx(
            [slope, -slope * 24 * hard * x * slope * phi_dot / (2 * k + 12 * hard * x**2)], rel=1e-9
        )
        assert s.derivative(["x", "x_dot"], {"phi_dot": 1.0}) == pytest.approx([0, slope], rel=1e-9)
        assert s.derivative(["x"], {"Q_x": 2.0})[0] == pytest.approx(2 * slope / (m * g), rel=1e-9)
        with pytest.raises(FMICallException):
            s.derivative(["phi"], {"x": 1.0})
        assert "variable x is not a known" in s.sentences[-1]


@pytest.mark.fmu
def test_directional_derivatives_of_accelerations_agree_with_differences(exported) -> None:
    unknowns = ["der_phi_dot", "x_ddot", "x_dot", "x", "total_energy"]
    with Stepping(exported(hardening()).path, "ModelExchange") as s:
        s.start({"phi_dot": 0.7})
        at = {"phi": 0.4, "phi_dot": 0.7, "Q_phi": 0.1, "k3": 1.5e4}
        s.set(at)
        for known, value in at.items():
            found = []
            for sign in (1, -1):
                s.set({known: value + sign * 1e-5 * max(1, value)})
                found.append(np.array(s.get(unknowns)))
            s.set({known: value})
            differences = (found[0] - found[1]) / (2e-5 * max(1, value))
            assert s.derivative(unknowns, {known: 1.0}) == pytest.approx(differences, rel=1e-6, abs=1e-9)


@pytest.mark.fmu
def test_a_rolled_back_run_repeats_bit_for_bit(exported) -> None:
    def go_on(s: Stepping) -> str:
        seen = []
        for i in range(1, 4):
            s.unit.setTime(0.1 * i)
            s.set({"phi": 0.5 - 0.2 * i, "phi_dot": -0.3 * i})
            seen += [*s.rates(), *s.get(["x", "x_dot", "x_ddot"])]
            s.unit.completedIntegratorStep()
        return bits(seen)

    with Stepping(exported(hardening()).path, "ModelExchange") as s:
        s.start()
        s.set({"phi": 0.37})
        s.unit.completedIntegratorStep()
        s.set({"phi": 0.31})
        state = s.unit.getFMUState()
        saved = s.unit.serializeFMUState(state)
        first = go_on(s)
        s.unit.setFMUState(state)
        assert go_on(s) == first
        other = s.unit.deSerializeFMUstate(saved)
        s.unit.setFMUState(other)
        assert go_on(s) == first


@pytest.mark.fmu
def test_after_an_event_what_has_mass_is_where_it_was(exported) -> None:
    """A force on the slider alone jumps: slider and angle jump, the bob does not, nor does its velocity."""
    with Stepping(exported(hardening()).path, "ModelExchange") as s:
        s.start({"phi_dot": 0.4})
        x, phi, x_dot, phi_dot = s.get(["x", "phi", "x_dot", "phi_dot"])
        s.unit.enterEventMode()
        s.set({"Q_x": 3.0})
        changed = s.unit.newDiscreteStates()[3]
        after = s.get(["x", "phi", "x_dot", "phi_dot"])
        assert changed
        assert after[0] + l * after[1] == pytest.approx(x + l * phi, abs=1e-13)
        assert after[2] + l * after[3] == pytest.approx(x_dot + l * phi_dot, abs=1e-12)
        assert after[0] == pytest.approx(slider_of(after[1], 3.0), abs=1e-13)
        assert abs(after[0] - x) > 1e-3
        assert not s.unit.newDiscreteStates()[3]


@pytest.mark.fmu
def test_a_force_that_jumps_at_an_event_of_the_importer(exported) -> None:
    """From t = 0.5 on with Q_x = 20 N: the bob, s'' = -g phi, goes on without a jump."""
    names = ("Q_x", "Q_phi", "F")
    rows = [(t, force, 0.0, 0.0) for t, force in ((0.0, 0.0), (0.5, 0.0), (0.5, 20.0), (1.0, 20.0))]
    signal = np.array(rows, dtype=[("time", float), *((name, float) for name in names)])
    reach = l + m * g / (2 * k)
    z = np.array([0.1 * reach, 0.0])
    for force in (0.0, 20.0):
        slope = lambda t, z, q=force: [z[1], -g * (z[0] - q / (2 * k)) / reach]  # noqa: E731
        z = solve_ivp(slope, (0, 0.5), z, "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    run = exchanged(exported("slides_problem_5_small").path, ["x_m"], 1.0, input=signal)
    assert run["x_m"][-1] == pytest.approx(z[0], abs=1e-7)


@pytest.mark.fmu
def test_forces_without_an_equilibrium_stop_the_run_with_a_sentence(exported) -> None:
    x, y = coordinate("x", "m", nominal=0.1), coordinate("y", "m", start=1.0)
    lost = Mechanism("lost", coordinates=[x, y], energy=Energy(y.dot**2 / 2, (x - 1) ** 3 / 3 - x * y + y**2))
    with Stepping(exported(lost).path, "ModelExchange") as s:
        s.start()
        assert s.get(["x"])[0] == pytest.approx(0.0, abs=1e-12)  # (x - 1)^2 = y
        s.unit.setTime(0.25)
        s.set({"y": -0.5})
        with pytest.raises(FMICallException) as caught:
            s.rates()
        assert caught.value.status == 2  # fmi2Discard: a shorter step may do
        assert "at time 0.25" in s.sentences[-1]
        assert "do not determine x near the last completed step; residuals: massless_x = " in s.sentences[-1]
        s.set({"y": 0.25})
        assert s.get(["x", "y"]) == pytest.approx([0.5, 0.25], abs=1e-12)
    sentence = r"at time 1.162\d* the forces on what has no mass do not determine x near"
    with pytest.raises(SimulationError, match=sentence):
        simulate(lost, stop_time=2.0, step=0.1)


@pytest.mark.fmu
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # fmpy's callback, when CVode tries on
def test_a_run_of_the_importer_that_comes_to_a_singular_position_hears_why() -> None:
    reason = r"singular and (hardly determines|does not determine) the acceleration of x, phi;"
    with pytest.raises(SimulationError, match=reason):
        simulate(load("slides_problem_5_massless"), stop_time=1.0, step=0.01, kind="model-exchange")


@pytest.mark.fmu
def test_the_coordinate_is_one_that_the_force_depends_on(exported) -> None:
    """Nothing holds the slider: then the angle has the equilibrium, and the slider goes with the bob."""
    x, phi = coordinate("x", "m", start=0.1, velocity=0.2), coordinate("phi", "rad", guess=0.1)
    held = Mechanism("held", coordinates=[x, phi], energy=Energy((x.dot + phi.dot) ** 2 / 2, 3 * phi**2 + x))
    assert [e.name for e in derive(held).mechanism.constraints] == ["massless_phi"]
    run = exchanged(exported(held).path, ["x", "phi"], 1.0)
    assert run["phi"] == pytest.approx(np.full(21, 1 / 6), abs=1e-14)
    assert run["x"] == pytest.approx(0.1 + 0.2 * run["time"] - run["time"] ** 2 / 2, abs=1e-9)


def test_an_equilibrium_by_hand_names_the_coordinate_that_it_determines() -> None:
    x, y = coordinate("x", "m"), coordinate("y", "m")
    with pytest.raises(MechanismError, match=r"equilibrium.rest: .* give it one of the names massless_x, massless_y"):
        Mechanism("odd", coordinates=[x, y], constraints=[Constraint("rest", x - y, "equilibrium")])
