"""The record: what it makes of symbols, and what it refuses with the part and the remedy."""

from __future__ import annotations

import re
from dataclasses import FrozenInstanceError, replace
from typing import Any

import pytest
import sympy as sp
from sympy import cos, sin

from lag2fmu.dynamics import derive
from lag2fmu.errors import DerivationError, MechanismError, UnitError
from lag2fmu.language.expressions import symbol
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.mechanism import (
    Body,
    Constraint,
    Contact,
    Coordinate,
    Damper,
    Definition,
    Energy,
    Experiment,
    Force,
    Gravity,
    Load,
    Mechanism,
    Output,
    Parameter,
    Point,
    Spring,
    coordinate,
    parameter,
    signal,
)

m, l, g = parameter("m", 1.0, "kg"), parameter("l", 1.0, "m"), parameter("g", 9.81, "m/s2")  # noqa: E741
theta, F, y0 = coordinate("theta", "rad"), signal("F", "N"), signal("y0", "m", motion=True)
bob = Body("bob", m, (l * sin(theta), -l * cos(theta)))


def pendulum(**changes: Any) -> Mechanism:
    """A pendulum with some tables replaced."""
    tables: dict[str, Any] = {
        "coordinates": [theta],
        "parameters": [m, l, g],
        "inputs": [F, y0],
        "bodies": [bob],
        "gravity": g,
    }
    return Mechanism("p", **{**tables, **changes})


def test_declared_symbols_leave_their_records() -> None:
    mechanism = pendulum()
    assert mechanism.coordinates == (Coordinate("theta", parse_unit("rad")),)
    assert [p.name for p in mechanism.parameters] == ["m", "l", "g"]
    assert mechanism.gravity == Gravity(symbol("g"))
    assert mechanism.place("bob") == (symbol("l") * sin(symbol("theta")), -symbol("l") * cos(symbol("theta")))
    assert (mechanism.motions, mechanism.plain_inputs) == ((y0.declaration,), (F.declaration,))
    assert type(mechanism.bodies[0].mass) is sp.Symbol


def test_a_coordinate_declared_again_has_its_own_record() -> None:
    first, second = coordinate("q", "m", start=1.0), coordinate("q", "m", start=2.0)
    assert first == second
    assert hash(first) == hash(second)
    assert (first.declaration.start, second.declaration.start) == (1.0, 2.0)
    assert first.dot == symbol("q_dot")
    assert first.ddot == symbol("q_ddot")


def test_numbers_are_in_the_unit_and_kept_in_si() -> None:
    q = coordinate("q", "mm", start=9, velocity=70, minimum=-5).declaration
    assert (q.start, q.velocity, q.nominal, q.minimum, q.maximum) == (0.009, 0.07, 0.001, -0.005, None)
    assert parameter("T", 20, "degC").declaration.value == 293.15
    assert coordinate("q").declaration == Coordinate("q")


def test_a_parameter_may_follow_from_others() -> None:
    mechanism = pendulum(parameters=[m, l, g, parameter("J", m * l**2 / 3, "kg.m2")])
    J = mechanism.parameters[-1]
    assert J.value is None
    assert J.expression == symbol("m") * symbol("l") ** 2 / 3


def test_input_loads_bring_their_inputs() -> None:
    rod = Body("rod", m, (l * sin(theta), 0), angle=theta, inertia=1)
    mechanism = pendulum(
        bodies=[bob, rod], loads=[Load("push", point=bob, input=True), Load("turn", body=rod, input=True)]
    )
    assert [u.name for u in mechanism.inputs] == ["F", "y0", "push_x", "push_y", "turn"]
    assert mechanism.loads[1] == Load("turn", body="rod", torque=symbol("turn"))


def test_expressions_are_listed_with_their_places() -> None:
    places = dict(pendulum(springs=[Spring("s", 2, elongation=theta)], forces={theta: F * l}).expressions())
    assert places["bodies.bob.position[0]"] == symbol("l") * sin(symbol("theta"))
    assert places["springs.s.stiffness"] == 2
    assert places["forces.theta.expression"] == symbol("F") * symbol("l")
    assert places["gravity.acceleration"] == symbol("g")


def test_a_mechanism_is_frozen_and_comparable() -> None:
    mechanism = pendulum()
    assert mechanism == pendulum()
    assert mechanism != pendulum(source="elsewhere")
    with pytest.raises(FrozenInstanceError):
        mechanism.name = "other"  # type: ignore[misc]


def definitions(**expressions: sp.Expr) -> list[Definition]:
    return [Definition(name, expression) for name, expression in expressions.items()]


a, b, x = symbol("a"), symbol("b"), symbol("x")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"coordinates": [], "inputs": []}, "coordinates: mechanism 'p' has none, and no prescribed motion"),
        ({"coordinates": [theta, coordinate("q")]}, "coordinates.q: appears in no energy.*; leave it out"),
        (
            {"coordinates": [theta, coordinate("q")], "contacts": [Contact("c", gap=2 - symbol("q"))]},
            "coordinates.q: appears in no energy.*; contacts.c.gap acts on it: give what moves there a mass or inertia",
        ),
        ({"coordinates": [m]}, r"coordinates: expected a coordinate, got Parameter .*; coordinate\(...\) makes one"),
        ({"coordinates": theta}, "coordinates: expected a list, got Coordinate 'theta'; put square brackets around it"),
        (
            {"coordinates": [coordinate("theta", start=float("nan"))]},
            "coordinates.theta.start: nan is not a finite number",
        ),
        (
            {"coordinates": [coordinate("theta", start=4, maximum=3)]},
            r"coordinates.theta.start: 4.0 is outside of \[-inf, 3.0\]",
        ),
        ({"coordinates": [coordinate("theta", nominal=-1)]}, "coordinates.theta.nominal: -1.0 is not positive"),
        ({"parameters": [m, l]}, "undefined symbol 'g'; known are .*, or declare 'g' among the parameters"),
        ({"parameters": [m, l, g, m]}, "parameters.m: the name 'm' is already taken by parameters.m"),
        (
            {"parameters": [m, l, g, parameter("Q_theta", 1)]},
            "'Q_theta' is already taken by the external force of coordinate 'theta'",
        ),
        (
            {"parameters": [m, l, g, parameter("y0_dot", 1)]},
            "'y0_dot' is already taken by the velocity of motion input 'y0'",
        ),
        ({"parameters": [m, l, g, parameter("total_energy", 1)]}, "'total_energy' is already taken by an energy"),
        ({"parameters": [m, l, g, parameter("1a", 1)]}, "parameters.1a: '1a' is no name"),
        ({"parameters": [m, l, g, parameter("a" * 129, 1)]}, "has 129 letters"),
        ({"parameters": [m, l, g, Parameter("k")]}, "parameters.k: give either a value or an expression"),
        (
            {"parameters": [m, l, g, parameter("a", b), parameter("b", a)]},
            "parameters.[ab]: is defined by itself: . <- . <- .",
        ),
        (
            {"parameters": [m, l, g, parameter("a", theta * 1)]},
            "parameters.a.expression: 'theta' is a coordinate and cannot stand",
        ),
        ({"definitions": definitions(a=b, b=a + 1)}, "definitions.[ab]: is defined by itself"),
        ({"definitions": definitions(a=x)}, "definitions.a: undefined symbol 'x'"),
        ({"energy": Energy(kinetic=m, lagrangian=m)}, "energy: 'lagrangian' stands for kinetic and potential"),
        (
            {"energy": Energy(potential=symbol("thta"))},
            "energy.potential: undefined symbol 'thta'; did you mean 'theta'",
        ),
        ({"bodies": [Body("bob", m, (F, 0))]}, "bodies.bob.position.0.: 'F' is an input and .* motion = true"),
        ({"bodies": [Body("bob", m, (y0.ddot, theta))]}, "bodies.bob.position.0.: 'y0_ddot' is a motion acceleration"),
        ({"bodies": [Body("bob", m, (theta.dot, 0))]}, "bodies.bob.position.0.: 'theta_dot' is a velocity and cannot"),
        ({"bodies": [Body("bob", theta, (theta, 0))]}, "bodies.bob.mass: 'theta' is a coordinate and cannot"),
        ({"bodies": [Body("bob", m, (theta,))]}, r"positions have \[1\] entries"),
        ({"bodies": [bob, Body("c", m, (theta, 0, 0))]}, r"positions have \[2, 3\] entries"),
        ({"bodies": [Body("bob", m, (theta, 0), angle=theta)]}, "bodies.bob: 'inertia' is missing"),
        ({"bodies": [Body("bob", m, (theta, 0, 0), angle=theta, inertia=1)]}, "a body with an angle is planar"),
        ({"bodies": [bob, bob]}, "bodies and points: the name 'bob' is used twice"),
        ({"points": [Point("bob", (0, 0))]}, "bodies and points: the name 'bob' is used twice"),
        ({"gravity": Gravity(g, (0, 0, -1))}, "gravity.direction: has 3 entries"),
        ({"springs": [Spring("s", 1)]}, "springs.s: give either 'elongation' or 'between'"),
        ({"springs": [Spring("s", 1, theta, length=l)]}, "springs.s: 'length' goes with 'between'"),
        ({"springs": [Spring("s", 1, between=("bob",))]}, "springs.s.between: 1 ends"),
        ({"springs": [Spring("s", 1, between=("bob", "bab"))]}, "springs.s.between: there is no point or body 'bab'"),
        ({"springs": [Spring("s", 1, between=(bob, bob))]}, "at the same place always"),
        ({"dampers": [Damper("d", 1)]}, "dampers.d: give either 'rate' or 'between'"),
        ({"loads": [Load("f", point=bob)]}, "loads.f: give either a force .* or a torque"),
        ({"loads": [Load("f", force=(1, 0))]}, "loads.f: a force acts at a 'point'"),
        (
            {"loads": [Load("f", point=bob, force=(1, 0, 0))]},
            "loads.f.force: has 3 entries, the position of 'bob' has 2",
        ),
        ({"loads": [Load("f", body=bob, torque=1)]}, "loads.f.body: 'bob' is not a rigid body with an angle"),
        (
            {"loads": [Load("f", point=bob, force=(1, 0), input=True)]},
            "loads.f: 'input' and a value exclude each other",
        ),
        (
            {"forces": [Force("phi", 1)]},
            "forces.phi: there is no such coordinate or prescribed motion; known are theta, y0",
        ),
        ({"forces": [Force("theta", 1), Force("theta", 2)]}, "forces: the name 'theta' is used twice"),
        (
            {"outputs": [Output("theta", theta)]},
            "outputs.theta: the name 'theta' is already taken by coordinates.theta",
        ),
        ({"experiment": Experiment(stop_time=-1.0)}, "experiment.stop_time: -1.0 is not positive"),
        ({"experiment": Experiment(1.0, 2.0)}, "experiment.step: 2.0 s is longer than stop_time"),
    ],
)
def test_a_fault_is_named_with_its_place(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(MechanismError, match=message):
        pendulum(**changes)


def test_an_unknown_unit_is_refused_where_it_is_declared() -> None:
    with pytest.raises(UnitError, match="unknown unit 'kgg'; did you mean 'kg'"):
        Output("o", 1, "kgg")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bodies": [Body("bob", l, bob.position)]}, "bodies.bob.mass: 'l' is in m, expected kg"),
        ({"energy": Energy(potential=m * g)}, "energy.potential: .* is in N, expected J"),
        ({"energy": Energy(potential=m * g * l + m)}, "energy.potential: .* they cannot be added"),
        ({"energy": Energy(dissipation=m * theta.dot**2)}, "energy.dissipation: .* expected W"),
        ({"energy": Energy(potential=m * g * l * cos(l))}, "the argument of 'cos.l.' has the dimension m"),
        ({"forces": {theta: F}}, "forces.theta.expression: 'F' is in N, expected"),
        ({"forces": {theta: m * g}}, r"forces\.theta\.expression: .* is in N, expected N\.m$"),
        ({"forces": {theta: m * l**2}}, r"forces\.theta\.expression: .* is in kg\.m2, expected N\.m$"),
        ({"dampers": [Damper("d", m, rate=theta.dot)]}, r"dampers\.d\.damping: 'm' is in kg, expected N\.m\.s$"),
        ({"springs": [Spring("s", m, elongation=l * theta)]}, "springs.s.stiffness: 'm' is in kg, expected N/m"),
        ({"dampers": [Damper("d", m, rate=theta.dot)]}, "dampers.d.damping: 'm' is in kg"),
        ({"outputs": [Output("o", l * theta, "kg")]}, "outputs.o.expression: .* is in m, expected kg"),
        ({"parameters": [m, l, g, parameter("J", m * l, "kg.m2")]}, "parameters.J.expression: .* expected kg.m2"),
        ({"loads": [Load("f", point=bob, force=(m, 0))]}, "loads.f.force.0.: 'm' is in kg, expected N"),
    ],
)
def test_a_wrong_dimension_is_a_warning_or_an_error(changes: dict[str, Any], message: str) -> None:
    assert any(re.search(message, warning) for warning in pendulum(**changes).warnings)
    with pytest.raises(UnitError, match=message):
        pendulum(**changes, strict_units=True)


def test_a_radian_counts_as_one() -> None:
    k = parameter("k", 1.0, "J")
    energy = Energy(potential=k * theta**2, kinetic=m * (l * theta.dot) ** 2)
    mechanism = pendulum(parameters=[m, l, g, k], energy=energy, strict_units=True)
    assert mechanism.warnings == ()


def test_unknown_units_are_let_pass_unless_units_are_strict() -> None:
    k = parameter("k", 1.0)
    parts = {"parameters": [m, l, g, k], "energy": Energy(potential=k * theta**2, kinetic=m * (l * theta.dot) ** 2)}
    assert pendulum(**parts).warnings == ()
    with pytest.raises(UnitError, match=r'parameters\.k: 1 has no unit, .* give unit = "J"'):
        pendulum(**parts, strict_units=True)


def test_many_definitions_are_checked_in_no_time() -> None:
    web = {"d0": theta, "d1": 2 * theta} | {f"d{i}": symbol(f"d{i - 1}") * symbol(f"d{i - 2}") for i in range(2, 300)}
    assert len(pendulum(definitions=definitions(**web)).definitions) == 300


def test_a_plain_number_is_a_value_in_si_and_fits_everywhere() -> None:
    x = coordinate("x", "m")
    m = parameter("m", 1.0, "kg")
    wall = Point("wall", (0.3, 0))
    body = Body("b", m, (x, 0))
    spring = Spring("s", 20.0, between=(body, wall), length=0.1)
    mechanism = Mechanism(
        "numbers", coordinates=[x], parameters=[m], bodies=[body], points=[wall], springs=[spring], gravity=9.81,
        strict_units=True,
    )  # fmt: skip
    assert mechanism.warnings == ()
    with pytest.raises(UnitError, match="they cannot be added"):
        replace(mechanism, springs=[Spring("s", 20.0, elongation=x - 1)])
    remedy = "'0.6' is in 1 .* they cannot be added; a number has no unit: make it a parameter that has one"
    with pytest.raises(UnitError, match=remedy):
        replace(mechanism, springs=[Spring("s", 20.0, elongation=x + sp.Rational(3, 5))])


def test_a_guess_that_latches_alone_contain_is_said() -> None:
    x, y = coordinate("x", guess=0.5), coordinate("y", start=1.0)
    bodies = [Body("a", 1, (x, y))]
    catch = Constraint("catch", x - 2 * y, while_=5 - y)
    (held,) = Mechanism("held", coordinates=[x, y], bodies=bodies, constraints=[catch]).warnings
    assert held.startswith("coordinates.x: its guess is its start, since catch, which holds at times only")
    always = Constraint("always", x - y)
    assert Mechanism("bound", coordinates=[x, y], bodies=bodies, constraints=[catch, always]).warnings == ()
    given = coordinate("x", start=0.5)
    assert Mechanism("given", coordinates=[given, y], bodies=bodies, constraints=[catch]).warnings == ()


def test_gravity_that_does_nothing_and_energies_that_count_twice_are_said() -> None:
    x, z = coordinate("x", "m"), coordinate("z", "m")

    def warnings(*position: object, **further: object) -> tuple[str, ...]:
        body = Body("b", 1, position)  # type: ignore[arg-type]
        return Mechanism("doubted", coordinates=[x, z], bodies=[body], **further).warnings  # type: ignore[arg-type]

    (idle,) = warnings(x, z, 0, gravity=9.81)
    assert idle.startswith("gravity: acts along -z, where no body moves")
    assert warnings(x, 0, z, gravity=9.81) == warnings(x, z, gravity=9.81) == ()
    assert warnings(x, z, 0, gravity=Gravity(9.81, (0, -1, 0))) == ()
    assert warnings(x, z, gravity=Gravity(9.81, (0.6, -0.8))) == ()
    (long,) = warnings(x, z, gravity=Gravity(9.81, (3, -4)))
    assert long.startswith("gravity: its direction has the length 5, not 1, so that bodies fall with 5 times")
    (none,) = warnings(x, z, gravity=Gravity(9.81, (0, 0)))
    assert none.startswith("gravity: its direction is 0, and does nothing")
    (still,) = warnings(x, z, forces={x: sp.diff(x, sp.Symbol("t"))})
    assert still.startswith("forces.x: is 0, and does nothing; correct it, or leave it out (a velocity is x_dot, in Py")
    (twice,) = warnings(x, z, parameters=[m], energy=Energy(lagrangian=m * x.dot**2))
    assert twice.startswith("energy.lagrangian: the energies of b count beside it; leave the bodies out")
    assert warnings(x, 0, parameters=[m], energy=Energy(lagrangian=m * z.dot**2)) == ()


def test_a_kinetic_energy_that_is_that_of_the_bodies_is_said() -> None:
    """It doubled their masses without a word."""
    x, z, r = coordinate("x", "m"), coordinate("z", "m"), parameter("r", 2.0, "m")
    bead = Body("bead", m, (r * sp.sin(x / r), z**2 / r))

    def warnings(kinetic: sp.Expr) -> tuple[str, ...]:
        given = {"coordinates": [x, z], "parameters": [r, m], "bodies": [bead], "energy": Energy(kinetic)}
        return Mechanism("again", **given).warnings  # type: ignore[arg-type]

    (again,) = warnings(m * ((sp.cos(x / r) * x.dot) ** 2 / 2 + 2 * (z * z.dot / r) ** 2))
    assert again.startswith("energy.kinetic: the kinetic energy of bead counts by itself, and so twice; leave one")
    assert warnings(m * x.dot**2 / 2) == ()


def test_masses_are_positive_and_what_drives_is_said() -> None:
    """At the values of the parameters; what depends on coordinates is not known there."""
    x, m, k = coordinate("x", "m"), parameter("m", -2.0, "kg"), parameter("k", -3.0, "N/mm")
    with pytest.raises(MechanismError, match=r"bodies\.b\.mass: 'm' is -2 kg at the values given, and negative"):
        Mechanism("negative", coordinates=[x], parameters=[m], bodies=[Body("b", m, (x, 0))])
    with pytest.raises(MechanismError, match=r"bodies\.b\.inertia: '-1' is -1 kg\.m2"):
        Mechanism("negative", coordinates=[x], bodies=[Body("b", 1, (x, 0), angle=x, inertia=-1)])
    found = Mechanism(
        "driven",
        coordinates=[x],
        parameters=[k],
        bodies=[Body("b", 1, (x, 0))],
        springs=[Spring("s", k, elongation=x)],
        dampers=[Damper("d", k / 2, rate=x.dot)],
    )
    assert found.warnings[-2:] == (
        "springs.s.stiffness: 'k' is -3 N/mm at the values given; negative, it pushes away from rest",
        "dampers.d.damping: 'k/2' is -1500 at the values given; negative, it drives the motion",
    )
    kinetic = Mechanism("negative", coordinates=[x], parameters=[m], energy=Energy(m * x.dot**2 / 2, x**2))
    with pytest.raises(DerivationError, match="what moves along x has the mass or inertia -2"):
        derive(kinetic)
