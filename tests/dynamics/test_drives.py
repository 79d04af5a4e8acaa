"""The force that carries a prescribed motion: closed forms, the balance of power, the independent path."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from sympy import Rational, cos, sin

from lag2fmu.analysis.evaluation import unknowns
from lag2fmu.description import names
from lag2fmu.dynamics import derive
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.starts import start_values
from lag2fmu.errors import MechanismError
from lag2fmu.graph.autodiff import Forward
from lag2fmu.language.expressions import TIME, symbol
from lag2fmu.mechanism import (
    Body,
    Constraint,
    Contact,
    Damper,
    Energy,
    Frame,
    Friction,
    Load,
    Mechanism,
    Point,
    Spring,
    coordinate,
    parameter,
    signal,
)
from lag2fmu.reference import Equations
from lag2fmu.reference.drives import DriveForces

STATE = {"x": 0.3, "x_dot": -0.7, "a": 0.9, "a_dot": 1.3, "y": 0.4, "y_dot": 0.8, "y_ddot": -1.7}


def found(equations: EquationsOfMotion, values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """The forces of the drives by the names of the motions, and all values with accelerations and multipliers."""
    m = equations.mechanism
    known: dict[str, float] = {**start_values(m), **values}
    qdd, borne = unknowns(equations, known)
    known |= dict(zip((names.acceleration(q.name) for q in m.coordinates), qdd, strict=True))
    known |= dict(zip((names.multiplier(c.name) for c in m.constraints), borne, strict=True))
    forces = equations.graph.evaluate(equations.drives, known)
    return dict(zip(m.driven, forces, strict=True)), known


def test_a_pendulum_on_a_support_that_is_lifted() -> None:
    """The support bears m (g + y_ddot) and what the swinging bob pulls: m (a_ddot sin a + a_dot^2 cos a) l."""
    a, y = coordinate("a", "rad"), signal("y", "m", motion=True)
    bob = Body("bob", 2.0, (0.5 * sin(a), y - 0.5 * cos(a)))
    equations = derive(Mechanism("lifted", coordinates=[a], inputs=[y], bodies=[bob], gravity=9.81))
    forces, known = found(equations, STATE)
    pulled = 0.5 * (known["a_ddot"] * np.sin(0.9) + 1.3**2 * np.cos(0.9))
    assert forces["y"] == pytest.approx(2.0 * (9.81 - 1.7 + pulled), rel=1e-13)


def test_the_rope_of_a_crane() -> None:
    """The drive of the rope pushes with m (y_ddot - y a_dot^2 + x_ddot sin a - g cos a): minus the rope's tension."""
    x, a, y = coordinate("x", "m"), coordinate("a", "rad"), signal("y", "m", motion=True, start=0.4)
    load = Body("load", 3.0, (x + y * sin(a), -y * cos(a)))
    equations = derive(
        Mechanism("crane", coordinates=[x, a], inputs=[y], bodies=[Body("trolley", 5, (x, 0)), load], gravity=9.81)
    )
    forces, known = found(equations, STATE)
    along = -1.7 - 0.4 * 1.3**2 + known["x_ddot"] * np.sin(0.9) - 9.81 * np.cos(0.9)
    assert forces["y"] == pytest.approx(3.0 * along, rel=1e-13)


def driven(**tables: object) -> Mechanism:
    """Two motions: of a support, by springs, a damper and a constraint; and of a frame that carries a rigid body."""
    x, a, b = coordinate("x", "m", start=0.3), coordinate("a", "rad", start=0.9), coordinate("b", "rad")
    y, w = signal("y", "m", motion=True, start=0.4), signal("w", "rad", motion=True, start=0.2)
    arm = Frame("arm", origin=(x, y, 0), rotations=[("z", a), ("x", w)])
    hand = Point("hand", (0.3, 0, 0.2), frame=arm)
    own = {
        "coordinates": [x, a, b],
        "inputs": [y, w],
        "parameters": [parameter("k", 7.0, "N/m")],
        "frames": [arm],
        "bodies": [
            Body("rotor", 2.0, frame=arm, center=(0.1, 0, 0), inertia=(0.2, 0.3, 0.4, 0.01, 0, 0.02)),
            Body("slider", 1.5, (x, y + sin(b), Rational(1, 2) * b)),
        ],
        "points": [hand, Point("wall", (0, 2 * y, 1))],
        "springs": [Spring("s", symbol("k"), between=("hand", "wall"), length=0.2), Spring("t", 3, elongation=x - y)],
        "dampers": [
            Damper("d", 0.7, between=("hand", "wall")),
            Damper("r", force=symbol("rate") ** 3, rate=x.dot - y.dot),
        ],
        "loads": [Load("p", "hand", force=(1, -2, 3 * x.dot)), Load("q", body="rotor", torque=(1, 2, 3), axes="frame")],
        "forces": {x: -0.3 * x.dot},
        "energy": Energy(potential=y * x**2, kinetic=y.dot * x.dot / 3 + y.dot**2 / 5),
        "constraints": [Constraint("tie", b - a * y - 0.3 * w)],
        "gravity": 9.81,
    }
    return Mechanism("driven", **{**own, **tables})


AT = {"y": 0.4, "y_dot": 0.8, "y_ddot": -1.7, "w": 0.2, "w_dot": -0.6, "w_ddot": 2.2}
MOVING = {"x": 0.3, "a": 0.9, "b": 0.9 * 0.4 + 0.06, "x_dot": -0.7, "a_dot": 1.3}
MOVING["b_dot"] = MOVING["a_dot"] * AT["y"] + MOVING["a"] * AT["y_dot"] + 0.3 * AT["w_dot"]


def test_the_balance_of_power() -> None:
    """d(T + V)/dt = F y_dot + G w_dot + powers of loads, forces and dampers, found from velocities alone."""
    equations = derive(driven())
    forces, known = found(equations, MOVING | AT)
    g = equations.apart().graph
    change = Forward(g, equations.variables.direction(g, accelerating=True))
    (rate,) = g.evaluate(change([equations.energies["total_energy"]]), known)
    passive = derive(driven(loads=[], forces={}, dampers=[]))
    silent, _ = found(passive, known)
    hand, wall, omega, x_dot = speeds(known)
    gap = places(known)
    along = gap @ (hand - wall) / np.linalg.norm(gap)
    taken = 0.7 * along**2 + (x_dot - AT["y_dot"]) ** 4 + 0.3 * x_dot**2
    given = np.array([1, -2, 3 * x_dot]) @ hand + np.array([1, 2, 3]) @ omega
    driving = forces["y"] * AT["y_dot"] + forces["w"] * AT["w_dot"]
    assert rate == pytest.approx(driving + given - taken, rel=1e-12)
    assert silent != pytest.approx(forces, rel=1e-3)


def turned(known: Mapping[str, float]) -> np.ndarray:
    """The rotation matrix of the arm."""
    (c, s), (cw, sw) = ((np.cos(known[k]), np.sin(known[k])) for k in ("a", "w"))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, cw, -sw], [0, sw, cw]])


def places(known: Mapping[str, float]) -> np.ndarray:
    """From the wall to the hand."""
    hand = np.array([known["x"], known["y"], 0]) + turned(known) @ [0.3, 0, 0.2]
    return hand - np.array([0, 2 * known["y"], 1])


def speeds(known: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Velocities of hand and wall, angular velocity of the rotor in its axes, x_dot."""
    R = turned(known)
    omega = np.array([0, 0, known["a_dot"]]) + R @ [known["w_dot"], 0, 0]
    hand = np.array([known["x_dot"], known["y_dot"], 0]) + np.cross(omega, R @ [0.3, 0, 0.2])
    return hand, np.array([0, 2 * known["y_dot"], 0]), R.T @ omega, known["x_dot"]


def test_the_multipliers_of_the_independent_path() -> None:
    """Here y and w are coordinates that constraints hold at laws of time: what these bear is the force of the drive."""
    forces, _ = found(derive(driven()), MOVING | AT)
    m = driven()
    y, w = coordinate("y", "m", start=0.4), coordinate("w", "rad", start=0.2)
    laws = {name: sum(AT[name + end] * TIME**i / (1, 1, 2)[i] for i, end in enumerate(ENDS)) for name in "yw"}
    held = [Constraint(f"hold_{name}", symbol(name) - law) for name, law in laws.items()]
    free = driven(coordinates=[*m.coordinates, y, w], inputs=[], constraints=[*m.constraints, *held])
    order = [q.name for q in free.coordinates]
    known = MOVING | AT
    q, qd = [known[name] for name in order], [known[f"{name}_dot"] for name in order]
    multipliers = dict(zip((c.name for c in free.constraints), Equations(free).multipliers(0.0, q, qd), strict=True))
    assert forces == pytest.approx({name: multipliers[f"hold_{name}"] for name in "yw"}, rel=1e-9)


def test_the_forces_of_the_independent_path() -> None:
    """What ``validate`` compares the FMU with, at one state and at two."""
    forces, _ = found(derive(driven()), MOVING | AT)
    drives = DriveForces(Equations(driven()))
    q, qd = ([MOVING[name + end] for name in "xab"] for end in ("", "_dot"))
    assert dict(zip(drives.names, drives(0.0, q, qd, AT), strict=True)) == pytest.approx(forces, rel=1e-9)
    both = drives(np.zeros(2), [q, q], [qd, qd], {**AT, "Q_x": np.array([0.0, 5.0])})
    assert both[0] == pytest.approx(list(forces.values()), rel=1e-9)
    assert np.abs(both[1] - both[0]).max() > 1e-3


ENDS = ("", "_dot", "_ddot")


def test_dry_friction_on_what_is_driven_pulls_at_the_drive() -> None:
    x, y = coordinate("x", "m"), signal("y", "m", motion=True)
    rubbing = Friction("belt", on=x.dot - y.dot, force=2.0)
    equations = derive(
        Mechanism("belt", coordinates=[x], inputs=[y], bodies=[Body("b", 1.0, (x, 0))], frictions=[rubbing])
    )
    assert equations.graph.evaluate(equations.drives, {"belt_force": -1.25}) == [-1.25]


def test_a_table_bears_what_lies_on_it() -> None:
    """Its drive brings up what the block presses with, the force of the contact."""
    x, y = coordinate("x", "m"), signal("y", "m", motion=True)
    table = Contact("table", gap=x - 2 * y)
    equations = derive(
        Mechanism("table", coordinates=[x], inputs=[y], bodies=[Body("b", 1.0, (0, x))], contacts=[table], gravity=9.81)
    )
    assert equations.graph.evaluate(equations.drives, {"table_force": 9.81}) == [2 * 9.81]


def test_the_name_of_the_force_may_not_be_taken() -> None:
    a, y = coordinate("a", "rad"), signal("y", "m", motion=True)
    with pytest.raises(MechanismError, match=r"inputs.F_y: the name 'F_y' is already taken by the force that carries"):
        Mechanism(
            "m", coordinates=[a], inputs=[y, signal("F_y", "N")], bodies=[Body("b", 1.0, (sin(a), y))], gravity=9.81
        )
