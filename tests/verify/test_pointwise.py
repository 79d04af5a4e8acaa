"""What an FMU and the independent path calculate at random states near a motion."""

import numpy as np
import pytest
import sympy as sp

from lag2fmu.fmu import Fmu
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Body, Constraint, Energy, Experiment, Mechanism, coordinate
from lag2fmu.reference import integrate
from lag2fmu.reference.equations import Equations
from lag2fmu.verify.firmness import Firmness
from lag2fmu.verify.pointwise import pointwise_checks
from lag2fmu.verify.report import Check
from lag2fmu.verify.task import Task

pytestmark = pytest.mark.fmu


def checks(fmu: Fmu, stop_time: float, **starts: float) -> list[Check]:
    reference = integrate(fmu.mechanism, np.linspace(0, stop_time, 51), starts=starts)
    return pointwise_checks(Task(fmu.mechanism, fmu.path, stop_time, 1e-6, None), reference)


@pytest.mark.parametrize("stop_time", [0.05, 0.1])
def test_states_near_singular_positions_do_not_judge(stop_time: float, exported) -> None:
    """Three cranks on one coupler, 0.02 rad before all are in line. There accelerations differ by rounding alone.

    Some of the states cannot be moved onto the constraints to 1e-12.
    """
    a, b, c, th = (
        coordinate(name, "rad", **{"start" if name == "a" else "guess": 0.6}) for name in ("a", "b", "c", "th")
    )
    x, y = coordinate("x", "m", guess=1.8), coordinate("y", "m", guess=0.5)
    cranks = [(k, q) for k, q in enumerate((a, b, c))]
    bodies = [Body(f"crank{k}", 1, (k + sp.cos(q) / 2, sp.sin(q) / 2), q, 0.1) for k, q in cranks]
    loops = [
        Constraint(f"{axis}{k}", expression)
        for k, q in cranks
        for axis, expression in (
            ("x", k + sp.cos(q) - x - (k - 1) * sp.cos(th)),
            ("y", sp.sin(q) - y - (k - 1) * sp.sin(th)),
        )
    ]
    coupler = Body("coupler", 3, (x, y), th, 1)
    coordinates = [a, b, c, x, y, th]
    row = Mechanism(
        "row", coordinates=coordinates, bodies=[*bodies, coupler], constraints=loops, gravity=sp.Float(9.81)
    )
    found = checks(exported(row), stop_time, a=np.pi - 0.02, a_dot=6.0)
    assert all(check.passed for check in found), found


def test_an_fmu_may_pull_back_what_rounds_in_a_velocity(exported) -> None:
    """A rotor at 3000 rpm whose steps are 1 ms: 200/s times the rounding of 314 rad/s is an acceleration of 1e-11."""
    x, phi = coordinate("x", "m", start=1e-5), coordinate("phi", "rad", guess_velocity=300.0)
    drive = Constraint("drive", phi - 100 * sp.pi * TIME)
    energy = Energy(x.dot**2 + phi.dot**2 / 200, 4e4 * x**2)
    step = Experiment(0.2, 0.001)
    rotor = Mechanism("rotor", coordinates=[x, phi], energy=energy, constraints=[drive], experiment=step)
    found = checks(exported(rotor), 0.2)
    assert all(check.passed for check in found), found


@pytest.mark.parametrize(("angle", "firm"), [(1.0, True), (3.0, True), (np.pi - 1e-3, False), (np.pi - 1e-9, False)])
def test_short_rows_are_not_firm(angle: float, firm: bool) -> None:
    """Of a parallelogram one row gets ever shorter until its links lie in one line; none by its own length."""
    a, b, c = (coordinate(name, "rad", guess=0.6 * (name != "b")) for name in "abc")
    loops = [Constraint("x", sp.cos(a) + sp.cos(b) - 1 - sp.cos(c)), Constraint("y", sp.sin(a) + sp.sin(b) - sp.sin(c))]
    bar = Mechanism("bar", coordinates=[a, b, c], energy=Energy(a.dot**2 + b.dot**2 + c.dot**2), constraints=loops)
    energies = Equations(bar).energies
    angles = np.array([0.5, 1.0, 1.5, angle])
    motion = energies.state(np.zeros(4), np.stack([angles, 0 * angles, angles], axis=1), np.zeros((4, 3)))
    assert Firmness.along(energies, motion).at(motion).tolist() == [True, True, True, firm]
