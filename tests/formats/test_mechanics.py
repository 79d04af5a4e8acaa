"""SymPy's mechanics as mechanisms: accelerations as those of SymPy's own equations, and what is missing is named."""

from __future__ import annotations

import keyword
import random
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from numpy.typing import NDArray
from of_kane import accelerations, rates_of_speeds, speeds_of_kane
from sympy.physics.mechanics import (
    KanesMethod,
    LagrangesMethod,
    Particle,
    PinJoint,
    Point,
    ReferenceFrame,
    RigidBody,
    System,
    dynamicsymbols,
    inertia,
)

from lag2fmu import load
from lag2fmu.errors import LoadError
from lag2fmu.formats.mechanics.equations import T

Floats = NDArray[np.float64]
m, length, g, r, c = sp.symbols("m length g r c", positive=True)
NUMBERS = {"m": 1.3, "length": 0.7, "g": 9.81, "r": 0.4, "c": 0.2}


def values_of(*names: str) -> dict[str, float]:
    """The numbers of some constants."""
    return {name: NUMBERS[name] for name in names}


def disagreement(method: KanesMethod, constants: Mapping[str, float], q: Sequence[float], u: Sequence[float]) -> float:
    """The largest difference of u' from SymPy's, relative to the greatest."""
    values = {s: constants[str(s)] for s in sp.symbols(" ".join(constants), positive=True, seq=True)}
    values |= {s: constants[str(s)] for s in sp.symbols(" ".join(constants), seq=True)}
    values |= dict(zip((*method.q, *method.u), (*q, *u), strict=True))
    qd, expected = speeds_of_kane(method, values)
    found = rates_of_speeds(method, values, accelerations(load(method, constants), q, qd), qd)
    return float(np.abs(found - expected).max() / np.abs(expected).max())


# ----------------------------------------------------------------------------------------------------------- Lagrange


def pendulum() -> LagrangesMethod:
    """A mathematical pendulum with viscous friction of the point."""
    theta = dynamicsymbols("theta")
    N, fixed = ReferenceFrame("N"), Point("O")
    fixed.set_vel(N, 0)
    P = fixed.locatenew("P", length * (sp.sin(theta) * N.x - sp.cos(theta) * N.y))
    P.set_vel(N, P.pos_from(fixed).dt(N))
    L = m * length**2 * theta.diff(T) ** 2 / 2 + m * g * length * sp.cos(theta)
    return LagrangesMethod(L, [theta], forcelist=[(P, -c * P.vel(N))], frame=N)


def test_a_pendulum_has_its_closed_form() -> None:
    """theta'' = -g/l sin(theta) - c/m theta'."""
    found = accelerations(load(pendulum(), values_of("m", "length", "g", "c")), [0.3], [0.8])
    assert found[0] == pytest.approx(-9.81 / 0.7 * np.sin(0.3) - 0.2 / 1.3 * 0.8, rel=1e-14)


@pytest.mark.parametrize("word", sorted({*random.Random(1).sample(keyword.kwlist, 6), "lambda"}))
def test_symbols_may_be_named_like_keywords_of_python(word: str) -> None:
    """A constant, which is a keyword argument, gets an underscore; a coordinate keeps its name."""
    stiffness, x, force = sp.Symbol(word), dynamicsymbols(f"{word}_x"), dynamicsymbols("as" if word != "as" else "is")
    method = LagrangesMethod(x.diff(T) ** 2 / 2 - stiffness * x**2 / 2 + force * x, [x])
    for name in (word, f"{word}_"):
        mechanism = load(method, {name: 4.0})
        assert [p.name for p in mechanism.parameters] == [f"{word}_"]
    moving = dynamicsymbols(word)
    mechanism = load(LagrangesMethod(moving.diff(T) ** 2 / 2 - sp.Symbol("k") * moving**2 / 2, [moving]), {"k": 4.0})
    assert [q.name for q in mechanism.coordinates] == [word]
    assert accelerations(mechanism, [0.5], [0.0])[0] == pytest.approx(-2.0, rel=1e-14)


def test_two_names_that_would_come_out_alike_stay_apart() -> None:
    x = dynamicsymbols("x")
    method = LagrangesMethod(x.diff(T) ** 2 / 2 - sp.Symbol("lambda") * x**2 - sp.Symbol("lambda_") * x**4, [x])
    mechanism = load(method, {"lambda": 4.0, "lambda_": 1.5})
    assert {p.name: p.value for p in mechanism.parameters} == {"lambda__": 4.0, "lambda_": 1.5}


def test_constraints_of_lagrange() -> None:
    """A particle in x, y on a circle, pushed along x by a force F(t), which becomes an input."""
    x, y, F = dynamicsymbols("x y F")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, x.diff(T) * N.x + y.diff(T) * N.y)
    L = m * (x.diff(T) ** 2 + y.diff(T) ** 2) / 2 - m * g * y
    method = LagrangesMethod(L, [x, y], hol_coneqs=[x**2 + y**2 - length**2], forcelist=[(P, F * N.x)], frame=N)
    mechanism = load(method, values_of("m", "length", "g"))
    assert [u.name for u in mechanism.inputs if not u.name.startswith("Q_")] == ["F"]
    angle, rate = 0.4, 1.1
    state = [0.7 * np.sin(angle), -0.7 * np.cos(angle)]
    velocity = [0.7 * np.cos(angle) * rate, 0.7 * np.sin(angle) * rate]
    found = accelerations(mechanism, state, velocity, F=2.0)
    turning = -9.81 / 0.7 * np.sin(angle) + 2.0 * np.cos(angle) / (1.3 * 0.7)
    along, inward = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    assert found == pytest.approx(0.7 * turning * along + 0.7 * rate**2 * inward, rel=1e-12)


def test_a_moved_support_is_a_motion() -> None:
    """y0(t) in the energy is a prescribed motion: theta'' = -(g + y0'')/l sin(theta)."""
    theta, y0 = dynamicsymbols("theta y0")
    T_, height = m / 2, y0 - length * sp.cos(theta)
    L = T_ * ((length * sp.sin(theta)).diff(T) ** 2 + height.diff(T) ** 2) - m * g * height
    mechanism = load(LagrangesMethod(L, [theta]), values_of("m", "length", "g"))
    assert [(u.name, u.motion) for u in mechanism.inputs if not u.name.startswith("Q_")] == [("y0", True)]
    found = accelerations(mechanism, [0.3], [0.5], y0=0.1, y0_dot=0.2, y0_ddot=3.0)
    assert found[0] == pytest.approx(-(9.81 + 3.0) / 0.7 * np.sin(0.3), rel=1e-13)


# --------------------------------------------------------------------------------------------------------------- Kane


def rolling_disc(*, constrained: bool = True) -> KanesMethod:
    """SymPy's example "a rolling disc": with the contact's velocity as constraints, or with three speeds only."""
    q, u = dynamicsymbols("q1:6"), dynamicsymbols("u1:6")
    N = ReferenceFrame("N")
    Y = N.orientnew("Y", "Axis", [q[0], N.z])
    L = Y.orientnew("L", "Axis", [q[1], Y.x])
    R = L.orientnew("R", "Axis", [q[2], L.y])
    turning = R.ang_vel_in(N)
    kinematic = [turning.dot(axis) - speed for axis, speed in zip(L, u[:3], strict=True)]
    R.set_ang_vel(N, u[0] * L.x + u[1] * L.y + u[2] * L.z)
    C, center = Point("C"), Point("center")
    tensor = (inertia(L, m * r**2 / 4, m * r**2 / 2, m * r**2 / 4), center)
    if not constrained:
        C.set_vel(N, 0)
        center.set_pos(C, r * L.z)
        center.v2pt_theory(C, N, R)
        method = KanesMethod(N, q[:3], u[:3], kd_eqs=kinematic)
    else:
        center.set_vel(N, u[3] * N.x + u[4] * N.y + (r * sp.cos(q[1])).diff(T) * N.z)
        kinematic += [q[3].diff(T) - u[3], q[4].diff(T) - u[4]]
        slip = center.vel(N) + R.ang_vel_in(N).cross(-r * L.z)
        known = sp.solve(kinematic[:3], [x.diff(T) for x in q[:3]], dict=True)[0]
        ties = [slip.dot(axis).xreplace(known) for axis in (N.x, N.y)]
        center.set_vel(N, center.vel(N).xreplace(known))
        method = KanesMethod(N, q, u[:3], kd_eqs=kinematic, u_dependent=u[3:], velocity_constraints=ties)
    method.kanes_equations([RigidBody("disc", center, R, m, tensor)], [(center, -m * g * N.z)])
    return method


def test_a_rolling_disc_in_three_speeds() -> None:
    error = disagreement(rolling_disc(constrained=False), values_of("m", "r", "g"), (0.3, 0.4, 0.5), (0.6, -3.0, 0.7))
    assert error < 1e-12


def test_a_rolling_disc_with_the_contact_as_a_constraint() -> None:
    """u4 and u5 follow from the others; both mechanisms move alike, and as SymPy says."""
    method = rolling_disc()
    constants = values_of("m", "r", "g")
    mechanism = load(method, constants)
    assert [k.kind for k in mechanism.constraints] == ["nonholonomic"] * 2
    q, u = (0.3, 0.4, 0.5, 0.0, 0.0), (0.6, -3.0, 0.7)
    values = {m: 1.3, r: 0.4, g: 9.81} | dict(zip((*method.q, *method.u[:3]), (*q, *u), strict=True))
    ties = (method._k_nh * method.u + method._f_nh).xreplace(values)
    u = (*u, *(float(x) for x in sp.linsolve(ties, *method.u[3:]).args[0]))
    assert disagreement(method, constants, q, u) < 1e-12


def test_a_body_without_kinematic_equations_is_refused() -> None:
    q, u = dynamicsymbols("q u")
    N, P = ReferenceFrame("N"), Point("P")
    P.set_vel(N, u * N.x)
    with pytest.raises(LoadError, match=r"call its kanes_equations\(bodies, loads\) first"):
        load(KanesMethod(N, [q], [u], kd_eqs=[q.diff(T) - u]), {})


# ------------------------------------------------------------------------------------------------------------- System


def test_a_double_pendulum_of_joints() -> None:
    """Two uniform rods on pin joints, made by ``System``: SymPy's equations have the same accelerations."""
    system = System()
    rods = [RigidBody(f"rod_{k}", mass=m) for k in (1, 2)]
    for rod in rods:
        rod.central_inertia = inertia(rod.frame, m * length**2 / 12, m * length**2 / 12, m * length**2 / 12)
    ground = RigidBody("ground", masscenter=system.fixed_point, frame=system.frame)
    for k, (parent, child) in enumerate(((ground, rods[0]), rods), 1):
        at = None if k == 1 else -length / 2 * parent.frame.y
        own = length / 2 * child.frame.y
        system.add_joints(
            PinJoint(f"pin_{k}", parent, child, parent_point=at, child_point=own, joint_axis=parent.frame.z)
        )
    system.apply_uniform_gravity(-g * system.frame.y)
    system.form_eoms()
    method = system.eom_method
    mechanism = load(system, values_of("m", "length", "g"))
    q, u = (0.3, -0.5), (0.4, 0.7)
    values = {m: 1.3, length: 0.7, g: 9.81} | dict(zip((*system.q, *system.u), (*q, *u), strict=True))
    _, expected = speeds_of_kane(method, values)
    assert accelerations(mechanism, q, u) == pytest.approx(expected, rel=1e-12)


def test_a_pendulum_as_a_particle_on_a_string() -> None:
    """Holonomic constraint of a ``System``: x'' and y'' of the circle."""
    x, y, u, v = dynamicsymbols("x y u v")
    system = System()
    particle = Particle("bob", mass=m)
    particle.masscenter.set_pos(system.fixed_point, x * system.x + y * system.y)
    particle.masscenter.set_vel(system.frame, u * system.x + v * system.y)
    system.add_bodies(particle)
    system.add_coordinates(x, y)
    system.add_speeds(u, v)
    system.add_kdes(x.diff(T) - u, y.diff(T) - v)
    system.add_holonomic_constraints(x**2 + y**2 - length**2)
    system.apply_uniform_gravity(-g * system.y)
    found = accelerations(
        load(system, values_of("m", "length", "g")), [0.7 * np.sin(0.3), -0.7 * np.cos(0.3)], [0.0, 0.0]
    )
    along = -9.81 * np.sin(0.3)
    assert found == pytest.approx([along * np.cos(0.3), along * np.sin(0.3)], rel=1e-12)


# -------------------------------------------------------------------------------------------------------------- names

PROGRAM = """
import sympy as sp
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols
theta = dynamicsymbols("theta")
m, l = sp.symbols("m l")
number = 3
swing = LagrangesMethod(m*l**2*theta.diff()**2/2 + m*9.81*l*sp.cos(theta), [theta])
def made():
    return swing
"""


@pytest.mark.parametrize("name", ["swing", "made"])
def test_a_name_in_a_program(tmp_path: Path, name: str) -> None:
    (tmp_path / "x.py").write_text(PROGRAM)
    mechanism = load(f"{tmp_path / 'x.py'}:{name}", {"m": "1.5", sp.Symbol("l"): 2})
    assert (mechanism.name, [p.value for p in mechanism.parameters]) == (name, [2.0, 1.5])


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("swing", {"m": 1}, r"needs the structural argument\(s\) l; give NAME=VALUE"),
        ("swing", {"m": 1, "l": 1, "k": 2}, "'k' is no structural argument of swing; known are: l, m"),
        ("swing", {"m": 1, "l": 1, "theta": 0.3}, "'theta' is no constant, .*values={'theta': 0.3}"),
        ("swing", {"m": 1, "l": 1, "theta(t)": 0.3}, r"'theta\(t\)' is no constant, .*values={'theta': 0.3}"),
        ("swing", {"m": "heavy", "l": 1}, "m expects float, got 'heavy'"),
        ("swin", {}, "there is no 'swin'; did you mean 'swing'"),
        ("number", {}, "'number' is of type int; expected a Mechanism, a function that returns one"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, name: str, values: dict[str, object], message: str) -> None:
    (tmp_path / "x.py").write_text(PROGRAM)
    with pytest.raises(LoadError, match=message):
        load(f"{tmp_path / 'x.py'}:{name}", values)


def test_names_that_come_out_alike_are_numbered() -> None:
    a, b = dynamicsymbols(r"q\_1 q_1")
    m = load(LagrangesMethod(a.diff(T) ** 2 + b.diff(T) ** 2, [a, b]), {})
    assert [q.name for q in m.coordinates] == ["q_1", "q_1_2"]


def test_a_function_of_something_else_is_refused() -> None:
    x = dynamicsymbols("x")
    f = sp.Function("f")
    with pytest.raises(LoadError, match="is no function of the time alone"):
        load(LagrangesMethod(x.diff(T) ** 2 - f(x), [x]), {})


def test_names_of_notebooks() -> None:
    """Greek letters, LaTeX and subscripts become identifiers; values are given by symbol or by either name."""
    q, mass, k = dynamicsymbols("θ₁"), sp.Symbol(r"\hat{m}"), sp.Symbol("N_{max}")
    method = LagrangesMethod(mass * q.diff(T) ** 2 / 2 - k * q**2 / 2, [q])
    found = load(method, {mass: 2.0, "N_{max}": sp.Rational(1, 2)})
    assert [c.name for c in found.coordinates] == ["theta1"]
    assert {p.name: p.value for p in found.parameters} == {"hat_m_": 2.0, "N__max_": 0.5}
    assert load(method, {"hat_m_": 2.0, "N__max_": 0.5}) == found
