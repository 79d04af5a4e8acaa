"""What the documentation says of communication steps, against the exact map of a step with polynomial forces."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np
import pytest
from scipy.linalg import expm
from sympy import cos, sin

from lag2fmu import derive
from lag2fmu.analysis import analysis_sections, linearize
from lag2fmu.analysis.coupling import CHANGE, CouplingPort, bonds, ports
from lag2fmu.analysis.state_space import Linearization
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Body, Mechanism, coordinate, signal


def place_of(about: Linearization, port: CouplingPort) -> np.ndarray:
    """The displacement of the port by the states, (k,)."""
    return about.shape[[q.name for q in about.mechanism.coordinates].index(port.output)]


def multiplied(about: Linearization, port: CouplingPort, step: float, degree: int) -> np.ndarray:
    """What a communication step with a spring multiplies the eigenmodes by, (k,)."""
    B, c = about.B[:, [about.inputs.index(port.inputs[0])]], place_of(about, port)[None]
    return of_a_step(about.A, B, -port.stiffness * c, step, degree)


def of_a_step(A: np.ndarray, B: np.ndarray, feedback: np.ndarray, step: float, degree: int) -> np.ndarray:
    """What a step multiplies the eigenmodes of z' = A z + B u by, (k,): exponentials of matrices, no approximation.

    u = ``feedback`` z goes on from the beginning of the step as its Taylor polynomial.
    """
    k = len(A)
    force = [feedback, feedback @ A]
    force.append(feedback @ A @ A + feedback @ A @ B @ force[0])
    chain = np.zeros((k + 3, k + 3))
    chain[:k, :k], chain[:k, k : k + 1], chain[k, k + 1], chain[k + 1, k + 2] = A, B, 1.0, 1.0
    begin = np.concatenate([np.eye(k), *(f if i <= degree else 0 * f for i, f in enumerate(force))])
    return np.linalg.eigvals((expm(chain * step) @ begin)[:k])


def cases() -> Iterator[tuple[str, Linearization, CouplingPort]]:
    for model in ("pendulum", "spring_mass_damper", "cart_pole", "coupled_masses"):
        about = linearize(derive(load(model)))
        for port in ports(about):
            yield model, about, port


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_the_step_changes_an_oscillation_by_a_hundredth(degree: int) -> None:
    """Of the fastest mode, compared with its exact decay; damping makes it somewhat less."""
    for model, about, port in cases():
        step = port.step(degree)
        found = np.log(multiplied(about, port, step, degree)) / step
        spring = np.outer(about.B[:, about.inputs.index(port.inputs[0])], place_of(about, port))
        truth = np.linalg.eigvals(about.A - port.stiffness * spring)
        here, there = (max(x, key=lambda value: value.imag) for x in (found, truth))
        change = abs(here.real - there.real) * 2 * pi / there.imag
        assert 0.7 * CHANGE < change < 1.05 * CHANGE, (model, port)


def test_held_inputs_make_it_grow_from_the_bound_on() -> None:
    """A mass on a lightly damped spring: the bound is where the modulus of what a step multiplies by passes 1."""
    about = linearize(derive(load("spring_mass_damper")))
    (port,) = ports(about)
    below, above = (np.abs(multiplied(about, port, x * port.bound, 0)).max() for x in (0.9, 1.1))
    assert below < 1 < above
    (undamped,) = ports(linearize(derive(load("pendulum"))))
    assert undamped.bound == 0, "without damping a held force adds energy at any step"


def test_inertia_and_stiffness_of_a_port() -> None:
    """A pendulum of 1 kg and 1 m; the spring is as it is given, and softer ones swing slower."""
    about = linearize(derive(load("pendulum")), q=np.zeros(1))
    (port,) = ports(about)
    assert (port.inputs, port.output) == (("Q_theta",), "theta")
    assert port.inertia == pytest.approx(1.0)
    assert port.stiffness == pytest.approx(4 * 9.81)
    assert port.frequency == pytest.approx(np.sqrt(5 * 9.81))
    (softer,) = ports(about, stiffness=1.0)
    assert softer.frequency == pytest.approx(np.sqrt(10.81))


def test_forces_of_the_user_come_first_and_the_analysis_tells() -> None:
    equations = derive(load("cart_pole"))
    assert [p.inputs for p in ports(linearize(equations))] == [("F", "Q_x"), ("Q_theta",)]
    section = next(s for s in analysis_sections(equations) if s.title == "Coupling to other FMUs")
    assert "of order 1 in the communication step with held inputs, 2 and 3 with first and second" in str(
        section.lines[0]
    )
    assert str(section.lines[1]).startswith("F, Q_x and x: with ")


# ------------------------------------------------------------------------------------------- motion in, force out


def hanging() -> Mechanism:
    """A pendulum of 0.5 kg and 0.6 m on a support that another FMU moves."""
    theta, x0 = coordinate("theta", "rad"), signal("x0", "m", motion=True)
    bob = Body("bob", 0.5, (x0 + 0.6 * sin(theta), -0.6 * cos(theta)))
    return Mechanism("hanging", coordinates=[theta], inputs=[x0], bodies=[bob], gravity=9.81)


def test_the_force_that_carries_a_motion_contains_its_inertia() -> None:
    """m sin(theta)^2 at once, and m in the end; with 4 m below it swings at sqrt((g/l) 5/4)."""
    (tilted,) = bonds(linearize(derive(hanging()), q=np.array([0.8]), outputs=["F_x0"]))
    assert tilted.inertia == pytest.approx(0.5 * np.sin(0.8) ** 2)
    (below,) = bonds(linearize(derive(hanging()), outputs=["F_x0"]))
    assert (below.inertia, below.mass) == (0.0, pytest.approx(2.0))
    assert below.swing.frequency == pytest.approx(np.sqrt(9.81 / 0.6 * 1.25))


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_the_step_of_a_motion_changes_an_oscillation_by_a_hundredth(degree: int) -> None:
    """theta'' = -(g theta + x'')/l and x'' = m g theta/M, which goes on as a polynomial."""
    (bond,) = bonds(linearize(derive(hanging()), outputs=["F_x0"]))
    A = np.array([[0.0, 1.0], [-9.81 / 0.6, 0.0]])
    B, feedback = np.array([[0.0], [-1 / 0.6]]), np.array([[0.5 * 9.81 / bond.mass, 0.0]])
    step = bond.swing.step(degree)
    found = np.log(of_a_step(A, B, feedback, step, degree)) / step
    change = 2 * pi * np.abs(found.real).max() / bond.swing.frequency
    assert 0.7 * CHANGE < change < 1.05 * CHANGE


def test_the_analysis_tells_of_motions() -> None:
    section = next(s for s in analysis_sections(derive(hanging())) if s.title == "Coupling to other FMUs")
    assert str(section.lines[-1]).startswith("x0 and F_x0. With 2 kg on the other side it swings at 4.52 rad/s. ")
