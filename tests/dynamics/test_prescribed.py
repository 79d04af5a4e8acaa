"""Mechanisms all of whose motions are prescribed, forces on prescribed motions, joints that are prescribed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from sympy import cos, sin

from lag2fmu import validate
from lag2fmu.description import names
from lag2fmu.dynamics import derive
from lag2fmu.dynamics.starts import start_values
from lag2fmu.errors import MechanismError
from lag2fmu.language.expressions import symbol
from lag2fmu.mechanism import Body, Damper, Force, Joint, Mechanism, Ports, coordinate, parameter, signal
from lag2fmu.reference import Equations
from lag2fmu.reference.drives import DriveForces

AT = {"a": 0.4, "a_dot": 0.8, "a_ddot": -1.7}


def carried(m: Mechanism, at: Mapping[str, float]) -> dict[str, float]:
    """The forces of the drives of a mechanism without coordinates, by the names of the motions."""
    equations = derive(m)
    return dict(zip(m.driven, equations.graph.evaluate(equations.drives, {**start_values(m), **at}), strict=True))


def pendulum(**tables: object) -> Mechanism:
    """A pendulum of 2 kg and 0.5 m whose angle a is prescribed, with a damper in its bearing."""
    a = signal("a", "rad", motion=True, start=0.4)
    bob = Body("bob", 2.0, (0.5 * sin(a), -0.5 * cos(a)))
    given = {"inputs": [a], "bodies": [bob], "gravity": 9.81, "forces": {a: -0.3 * a.dot}}
    return Mechanism("held", **{**given, **tables})  # type: ignore[arg-type]


def test_nothing_is_left_to_move() -> None:
    """The drive bears inertia, weight and the bearing: m l^2 a_ddot + m g l sin a + c a_dot."""
    expected = 2 * 0.25 * -1.7 + 2 * 9.81 * 0.5 * np.sin(0.4) + 0.3 * 0.8
    assert carried(pendulum(), AT)["a"] == pytest.approx(expected, rel=1e-14)


def test_the_independent_path_knows_forces_on_motions() -> None:
    own = DriveForces(Equations(pendulum()))(0.0, [], [], AT)
    assert own == pytest.approx(list(carried(pendulum(), AT).values()), rel=1e-12)


def test_a_force_on_a_motion_moves_nothing_else() -> None:
    """A force on the support of a pendulum is borne by its drive alone."""
    a, y = coordinate("a", "rad", start=0.3), signal("y", "m", motion=True)
    bob = Body("bob", 2.0, (0.5 * sin(a), y - 0.5 * cos(a)))
    free, pushed = (
        derive(Mechanism("p", coordinates=[a], inputs=[y], bodies=[bob], gravity=9.81, forces=forces))
        for forces in ([], [Force("y", symbol("y_dot") * 7)])
    )
    at = {**start_values(free.mechanism), "y_dot": 0.5, "a_ddot": 1.1}
    values = [e.graph.evaluate([*e.forcing, *e.drives], at) for e in (free, pushed)]
    assert values[1] == pytest.approx([values[0][0], values[0][1] - 3.5], rel=1e-14)


def test_a_joint_may_be_prescribed() -> None:
    """The coordinate of a joint on a parent is then an input: the torque is I a_ddot about the vertical axis."""
    turn = Joint("hub", "revolute", parent="world", axis="z", coordinates=["a"])
    rotor = Body("rotor", 2.0, frame="hub", inertia=(0.2, 0.3, 0.4, 0, 0, 0))
    m = Mechanism("rotor", inputs=[signal("a", "rad", motion=True)], joints=[turn], bodies=[rotor])
    assert m.coordinates == ()
    assert carried(m, AT) == pytest.approx({"a": 0.4 * -1.7}, rel=1e-14)


def test_a_gear_may_be_driven() -> None:
    """The motor turns b, the gear makes a = 3 b: the motor bears (I_b + 9 I_a) b_ddot."""
    a, b = coordinate("a", "rad"), signal("b", "rad", motion=True)
    wheels = [Body("w", inertia=0.2, angle=a), Body("v", inertia=0.5, angle=b)]
    m = Mechanism("gear", coordinates=[a], inputs=[b], bodies=wheels, joints=[Joint("g", "gear", ("a", "b"), ratio=3)])
    equations = derive(m)
    at = {**start_values(m), "b_ddot": 2.0, "a_ddot": 6.0, names.multiplier("g"): 0.2 * 6.0}
    assert equations.graph.evaluate(equations.residual, at) == pytest.approx([0.0, 0.0], abs=1e-14)
    assert equations.graph.evaluate(equations.drives, at) == pytest.approx([(0.5 + 9 * 0.2) * 2.0], rel=1e-14)


def test_a_damper_of_a_motion_is_borne_by_its_drive() -> None:
    free = pendulum(forces={}, dampers=[Damper("d", 0.3, rate=symbol("a_dot"))])
    assert carried(free, AT) == pytest.approx(carried(pendulum(), AT), rel=1e-14)


def test_neither_coordinates_nor_motions() -> None:
    with pytest.raises(MechanismError, match="has none, and no prescribed motion"):
        Mechanism("empty", parameters=[parameter("m", 1.0, "kg")])


def test_a_force_on_nothing() -> None:
    with pytest.raises(MechanismError, match="no such coordinate or prescribed motion; known are a"):
        pendulum(forces={"b": 1.0})


@pytest.mark.fmu
def test_an_fmu_without_states_is_validated() -> None:
    report = validate(pendulum(ports=Ports(drives=["a"])), stop_time=1.0)
    assert report.passed
    assert "Nothing moves by itself" in str(report)
