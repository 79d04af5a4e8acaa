"""Supports that the importer moves from one communication step to the next: motion inputs, set anew before each."""

from __future__ import annotations

import re
from collections.abc import Callable
from ctypes import c_double
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from describing import described
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from stepping import Stepping

from lag2fmu.fmu import Fmu, export
from lag2fmu.fmu.model_description import heeds_steps
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Body, Constraint, Mechanism, Spring, coordinate, signal
from lag2fmu.reference import Trajectory, held, integrate

pytestmark = pytest.mark.fmu

AMPLITUDE, RATE, STIFFNESS, GRAVITY, STOP = 0.3, 2.0, 50.0, 9.81, 3.0
START = {"x": 0.0, "x_dot": 0.0, "a": 0.4, "a_dot": 0.5}


def support(t: float) -> dict[str, float]:
    """Position, velocity and acceleration of the support."""
    phase = RATE * t
    return {
        "y0": AMPLITUDE * np.sin(phase),
        "y0_dot": AMPLITUDE * RATE * np.cos(phase),
        "y0_ddot": -AMPLITUDE * RATE**2 * np.sin(phase),
    }


@pytest.fixture(scope="module")
def hanging() -> Mechanism:
    """A mass on a spring, its place x counted from the support; a pendulum on a rope that is drawn up."""
    x, y0 = coordinate("x", "m", minimum=-0.01, maximum=0.01), signal("y0", "m", motion=True)
    a = coordinate("a", "rad", start=0.4, velocity=0.5, minimum=-0.6, maximum=0.6)
    length = 1 + y0
    return Mechanism(
        "hanging",
        coordinates=[x, a],
        inputs=[y0],
        bodies=[Body("block", 1.0, (x + y0, 0)), Body("load", 1.0, (length * sp.sin(a), -length * sp.cos(a)))],
        springs=[Spring("spring", STIFFNESS, elongation=x)],
        gravity=GRAVITY,
    )


@pytest.fixture(scope="module")
def crane() -> Mechanism:
    """A trolley that the support takes along by a constraint, with a load on a rope of 1 m."""
    x, a, y0 = coordinate("x", "m"), coordinate("a", "rad", start=0.4, velocity=0.5), signal("y0", "m", motion=True)
    return Mechanism(
        "crane",
        coordinates=[x, a],
        inputs=[y0],
        bodies=[Body("trolley", 2.0, (x, 0)), Body("load", 1.0, (x + sp.sin(a), -sp.cos(a)))],
        constraints=[Constraint("drive", x - y0)],
        gravity=GRAVITY,
    )


def hanging_rates(t: float, z: NDArray[np.float64]) -> list[float]:
    y, y_dot, y_ddot = support(t).values()
    x, x_dot, a, a_dot = z
    return [x_dot, -STIFFNESS * x - y_ddot, a_dot, (-GRAVITY * np.sin(a) - 2 * y_dot * a_dot) / (1 + y)]


def crane_rates(t: float, z: NDArray[np.float64]) -> list[float]:
    _, y_dot, y_ddot = support(t).values()
    a, a_dot = z[2:]
    return [y_dot, y_ddot, a_dot, -GRAVITY * np.sin(a) - y_ddot * np.cos(a)]


def error(fmu: Fmu, rates: Callable[..., list[float]], step: float, given: tuple[str, ...]) -> float:
    """The largest error at the end, of coordinates and velocities, with only the inputs ``given`` connected."""
    start = [START[name] for name in START]
    expected = solve_ivp(rates, (0.0, STOP), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    with Stepping(fmu.path) as s:
        s.start(support(0.0))
        s.set({"y0_ddot": support(0.0)["y0_ddot"] if "y0_ddot" in given else 0.0})
        for i in range(round(STOP / step)):
            s.set({name: support(i * step)[name] for name in given})
            s.set({"Q_a": 1e-200 * i})  # no force to speak of, but another input that changes
            s.step(step)
        return float(np.abs(np.array(s.get(list(START))) - expected)[2 if rates is crane_rates else 0 :].max())


@pytest.mark.parametrize("solver", ["verlet", "midpoint", "gauss4"])
def test_variational_methods_follow_supports(solver: str, hanging: Mechanism, exported) -> None:
    """Momenta are what they know of inertia: a jump of the support's velocity has to act as an impulse."""
    fmu = exported(hanging, solver=solver)
    held = [error(fmu, hanging_rates, step, ("y0", "y0_dot", "y0_ddot")) for step in (0.02, 0.01)]
    assert held[1] < 2e-3
    jumps = [error(fmu, hanging_rates, step, ("y0", "y0_dot")) for step in (0.02, 0.01)]
    assert jumps[1] < 2e-2
    assert jumps[1] / jumps[0] == pytest.approx(0.5, abs=0.1)


ALL_THREE = ("y0", "y0_dot", "y0_ddot")


@pytest.mark.parametrize("solver", ["verlet", "lobatto4", "ros2", "dopri5"])
def test_supports_in_constraints(solver: str, crane: Mechanism, exported) -> None:
    """Motions go on between communication points as their velocities and accelerations say: the error is of order 2."""
    errors = [error(exported(crane, solver=solver), crane_rates, step, ALL_THREE) for step in (0.1, 0.02, 0.01)]
    assert errors[0] < 2e-2
    assert errors[2] < 2e-4
    assert errors[1] / errors[2] == pytest.approx(4, abs=0.4)


def test_both_backends_move_supports_alike(hanging: Mechanism, exported, tmp_path: Path) -> None:
    """So does the direct integration that validates them."""
    at = 0.1 * np.arange(10)
    given = Trajectory(at, ALL_THREE, np.array([list(support(t).values()) for t in at]))
    expected = integrate(hanging, [0.0, 1.0], inputs=held(given, ["y0"]), rtol=1e-10).trajectory
    slave = export(hanging, tmp_path / "hanging.fmu", backend="python")
    for fmu in (slave, exported(hanging, solver="dopri5")):
        with Stepping(fmu.path) as s:
            s.start(tolerance=1e-10)
            for t in at:
                s.set(support(t))
                s.step(0.1)
            assert s.get(list(START)) == pytest.approx([expected[name][-1] for name in START], abs=1e-8)
            y, y_dot, y_ddot = support(at[-1]).values()
            assert s.get(ALL_THREE) == pytest.approx([y + 0.1 * (y_dot + 0.05 * y_ddot), y_dot + 0.1 * y_ddot, y_ddot])


KINDS = ("CoSimulation", "ModelExchange")


def moved(fmu: Fmu, given: tuple[str, ...], kind: str = KINDS[0], **values: float) -> list[str]:
    """What the FMU warns of in 30 steps of 0.1 s while the inputs ``given`` are connected."""
    with Stepping(fmu.path, kind) as s:
        s.start(values)
        for i in range(30):
            s.set({name: support(0.1 * i)[name] for name in given})
            if kind == KINDS[0]:
                s.step(0.1)
            else:
                euler_step(s, 0.1)
        return s.sentences


def euler_step(s: Stepping, step: float) -> None:
    """A step of an importer's solver in model exchange, in s."""
    states = (c_double * len(s.states_of_derivatives))()
    s.unit.getContinuousStates(states, len(states))
    states[:] = [x + step * rate for x, rate in zip(states, s.rates(), strict=True)]
    s.time += step
    s.unit.setTime(s.time)
    s.unit.setContinuousStates(states, len(states))
    s.unit.completedIntegratorStep()


@pytest.mark.parametrize("kind", KINDS)
def test_a_support_whose_velocity_is_not_connected_is_noticed_once(kind: str, hanging: Mechanism, exported) -> None:
    fmu = exported(hanging, solver="verlet")
    docs = {v.name: v.doc for v in fmu.description.variables}
    assert docs["y0"].endswith("to be given with y0_dot and y0_ddot")
    (sentence,) = (said for said in moved(fmu, ("y0",), kind) if "stay 0" in said)
    assert re.search(r"the input y0 moves at time 0\.[34]", sentence)
    assert "y0_dot and y0_ddot stay 0" in sentence
    assert not any("stay 0" in said for said in moved(fmu, ("y0", "y0_dot"), kind))
    assert not any("stay 0" in said for said in moved(fmu, (), kind))


@pytest.mark.parametrize("kind", KINDS)
def test_coordinates_that_leave_their_ranges_are_noticed_once_each(kind: str, hanging: Mechanism, exported) -> None:
    fmu = exported(hanging, solver="verlet")
    sentences = moved(fmu, (), kind, x_dot=0.1, a_dot=2.0)
    for name, low, high in [("x", "-0.01", "0.01"), ("a", "-0.6", "0.6")]:
        said = f"the coordinate {name} leaves its range from {low} to {high} (SI) before"
        assert sum(said in sentence for sentence in sentences) == 1
    assert len(sentences) == 2
    assert moved(fmu, ()) == []  # amplitudes of 0 m and 0.42 rad


def test_an_importer_that_integrates_is_asked_for_its_steps_where_they_are_watched(hanging: Mechanism) -> None:
    """Also where events leave a rest that ends with the next step: without a call for it a bias would stay."""
    watched = {
        m.name: heeds_steps(described(m)[0]) for m in (hanging, *map(load, ("double_pendulum", "bouncing_ball")))
    }
    assert watched == {"hanging": True, "double_pendulum": False, "bouncing_ball": True}
    assert heeds_steps(described(load("four_bar_linkage"))[0])
