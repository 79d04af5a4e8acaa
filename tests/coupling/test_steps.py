"""What the documentation says of communication steps, against the exact map of a step with polynomial forces."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np
import pytest
from scipy.linalg import expm

from lag2fmu import derive
from lag2fmu.analysis import analysis_sections, linearize
from lag2fmu.analysis.coupling import CHANGE, Port, ports
from lag2fmu.analysis.state_space import Linearization
from lag2fmu.formats.loading import load


def place_of(about: Linearization, port: Port) -> np.ndarray:
    """The displacement of the port by the states, (k,)."""
    return about.shape[[q.name for q in about.mechanism.coordinates].index(port.output)]


def multiplied(about: Linearization, port: Port, step: float, degree: int) -> np.ndarray:
    """What a communication step multiplies the eigenmodes by, (k,): exponentials of matrices, no approximation.

    The force of the spring goes on from the beginning of the step as its Taylor polynomial.
    """
    k = len(about.states)
    A, B, c = about.A, about.B[:, [about.inputs.index(port.inputs[0])]], place_of(about, port)[None]
    force = [-port.stiffness * c, -port.stiffness * c @ A]
    force.append(-port.stiffness * c @ A @ A + -port.stiffness * c @ A @ B @ force[0])
    chain = np.zeros((k + 3, k + 3))
    chain[:k, :k], chain[:k, k : k + 1], chain[k, k + 1], chain[k + 1, k + 2] = A, B, 1.0, 1.0
    begin = np.concatenate([np.eye(k), *(f if i <= degree else 0 * f for i, f in enumerate(force))])
    return np.linalg.eigvals((expm(chain * step) @ begin)[:k])


def cases() -> Iterator[tuple[str, Linearization, Port]]:
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
