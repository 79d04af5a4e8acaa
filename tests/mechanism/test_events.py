"""Contacts, stops, frictions, tables and further states: what is written, what follows, and what is refused."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import minimize

from lag2fmu.description.events import CONTACTS
from lag2fmu.errors import MechanismError, TextError, UnitError
from lag2fmu.formats.loading import with_values
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.language.expressions import parse, symbol, value_of
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.vocabulary import Choice
from lag2fmu.mechanism import (
    Body,
    Constraint,
    Contact,
    Damper,
    Frame,
    Friction,
    Mechanism,
    Point,
    State,
    Stop,
    Table,
    coordinate,
    parameter,
    signal,
)

BALL = """
[mechanism]
name = "ball"
[parameters]
r = { value = 100, unit = "mm" }
mu = { value = 0.3, unit = "1" }
[coordinates]
x = { unit = "m" }
y = { unit = "m", start = 1.0 }
phi = { unit = "rad" }
[inputs]
hold = { unit = "1" }
[bodies.ball]
mass = 2
inertia = 0.1
position = ["x", "y"]
angle = "phi"
"""


def hybrid() -> Mechanism:
    """A mechanism with everything hybrid, built in Python."""
    x, y, phi = coordinate("x", "m"), coordinate("y", "m", start=1.0), coordinate("phi", "rad")
    r, mu, k = parameter("r", 100, "mm"), parameter("mu", 0.3, "1"), parameter("k", 1e6)
    hold, i = signal("hold", "1"), symbol("i")
    torque = Table("torque", columns=[[0, 100, 250], [1.5, 2, 0]], units=["rpm", "N.m"], interpolation="pchip")
    field = Table("field", columns=[[0, 1], [0, 1, 2], [[1, 2, 3], [4, 5, 7]]], outside="error")
    ball = Body("ball", 2, (x, y), angle=phi, inertia=0.1)
    return Mechanism(
        "hybrid",
        coordinates=[x, y, phi],
        parameters=[r, mu, k],
        inputs=[hold],
        bodies=[ball],
        states=[State("i", "mA", 0.003, (hold - 2 * i) / 3, 0.01, "current")],
        tables=[torque, field],
        forces={phi: torque(phi.dot) + parse("if(i > 0 and not x >= 1, 1, -1) + smooth(abs(x))") * field(x, y)},
        contacts=[
            Contact("floor", y - r, x.dot + r * phi.dot, sp.Rational(4, 5), mu, 0.4),
            Contact("wall", kind="disc_line", between=(ball, "world"), normal=(-1, 1, 0), radius=r),
            Contact(
                "soft",
                kind="point_line",
                between=("ball", "world"),
                normal="y",
                friction=mu,
                law="compliant",
                stiffness=k,
                damping=0.1,
                slip_speed=0.001,
            ),
        ],
        stops=[Stop("rail", x, -2, 2, 0.5), Stop("roof", y, upper=10)],
        frictions=[Friction("bearing", phi.dot, 0.1 * symbol("floor_force") + 1, 20)],
        constraints=[Constraint("catch", x - 0.3, while_=hold - 0.5), Constraint("hub", phi.dot, "nonholonomic")],
        impacts="simultaneous",
    )


def test_a_normal_in_the_plane_may_have_two_entries() -> None:
    normal = {"kind": "point_line", "between": ("ball", "world")}
    assert Contact("floor", normal=(1, 2), **normal) == Contact("floor", normal=(1, 2, 0), **normal)


def test_text_and_python_say_the_same() -> None:
    mechanism = hybrid()
    text = write(mechanism)
    assert read(text, "hybrid") == mechanism
    assert write(read(text, "hybrid")) == text
    for line in ('impacts = "simultaneous"', 'while = "-1/2 + hold"', 'law = "compliant"', "[stops.roof]"):
        assert line in text


def test_unilaterals_are_the_contacts_then_two_for_each_stop() -> None:
    found = {u.name: u for u in hybrid().unilaterals}
    x, y, r, mu = map(symbol, ("x", "y", "r", "mu"))
    assert list(found) == ["floor", "wall", "rail_lower", "rail_upper", "roof_upper"]
    floor = found["floor"]
    assert (floor.gap, floor.slips) == (y - r, (symbol("x_dot") + r * symbol("phi_dot"),))
    assert (floor.restitution, floor.friction, floor.static_friction) == (sp.Rational(4, 5), mu, sp.Rational(2, 5))
    assert (floor.unit, floor.where) == (parse_unit("m"), "contacts.floor")
    assert sp.simplify(found["wall"].gap - (y - x) / sp.sqrt(2) + r) == 0
    assert found["wall"].slips == ()  # no friction
    assert [found[name].gap for name in ("rail_lower", "rail_upper", "roof_upper")] == [x + 2, 2 - x, 10 - y]
    assert found["rail_upper"].restitution == sp.Rational(1, 2)


def test_parameters_in_gaps_are_fixed_and_starts_of_states_are_set() -> None:
    mechanism = hybrid()
    assert mechanism.fixed_parameters == {"r"}
    assert with_values(mechanism, {"i": 0.02}).states[0].start == 0.02
    assert all(q.given is not False for q in mechanism.coordinates if q.name != "phi")  # 'catch' decides no start


# ------------------------------------------------------------------------------------------------- tables


def test_a_table_is_a_grid_in_si() -> None:
    torque, field = hybrid().tables
    rpm = 2 * math.pi / 60
    assert torque.grid.axes == (pytest.approx((0, 100 * rpm, 250 * rpm)),)
    assert (torque.grid.values, torque.arity, field.arity) == ((1.5, 2.0, 0.0), 1, 2)
    assert field.grid == (((0.0, 1.0), (0.0, 1.0, 2.0)), (1.0, 2.0, 3.0, 4.0, 5.0, 7.0))
    rows = Table("field", columns=[[1, 0, 0, 1, 1, 0], [0, 1, 0, 2, 1, 2], [4, 2, 1, 7, 5, 3]])
    assert rows.grid == field.grid


@pytest.mark.parametrize(
    "content",
    ["x;y\n0;1\n1;2\n", "# measured\n0, 1\n1, 2\n", "0 1\n1\t2", "\ufeff0\t1\n1\t2\n", '"x","y"\n"0","1"\n"1","2"\n'],
)
def test_a_file_beside_the_text_is_read_and_written_as_columns(content: str, tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(content, "utf-8")
    text = BALL + '[tables.f]\nfile = "data.csv"\n[forces]\nx = "f(y)"\n'
    mechanism = read(text, str(tmp_path / "ball.toml"))
    assert mechanism.tables[0].grid == (((0.0, 1.0),), (1.0, 2.0))
    assert "file" not in write(mechanism)
    assert read(write(mechanism), "elsewhere") == mechanism


def test_a_file_with_more_columns_is_a_grid(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("x/y, 0, 1, 2\n0, 1, 2, 3\n1, 4, 5, 7\n", "utf-8")
    assert Table("field", file=path).grid == hybrid().tables[1].grid


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            "columns = [[0, 1, 1], [1, 2, 3]]",
            "tables.f.columns[0], entry 3: 1.0 (SI) follows 1.0 (SI); the arguments have to incr",
        ),
        ("columns = [[0, 1], [1, 2, 3]]", "tables.f.columns: have [2, 3] entries"),
        ("columns = [[0], [1]]", "tables.f.columns[0]: has 1 entries; give at least 2"),
        ("columns = [[0, 1], [0, 1], [[1, 2], [3]]]", "tables.f.columns[2]: row 2 does not have 2 values"),
        ("columns = [[0, 1, 1], [0, 0, 1], [1, 2, 3]]", "tables.f.columns: there is no value at (0.0, 1.0)"),
        ('columns = [[0, 1], [1, 2]]\nunits = ["m"]', "tables.f.units: 1 units of 2 columns"),
        ('columns = [[0, 1], [1, 2]]\nfile = "a.csv"', "tables.f: 'columns' and 'file' exclude each other"),
        ('columns = [[0, 1], [1, 2]]\noutside = "wrap"', "tables.f.outside: 'wrap' is unknown; give one of hold"),
        ('file = "absent.csv"', "tables.f.file: 'absent.csv' cannot be read: No such file"),
        ('file = "../x.csv"', "tables.f.file: '../x.csv' is no file beside the text or below"),
        ("", "tables.f: 'columns' are missing; give them, or a CSV 'file'"),
    ],
)
def test_what_is_no_table_is_refused(table: str, message: str) -> None:
    with pytest.raises(TextError, match=re.escape(f"ball.toml: {message}")):
        read(f"{BALL}[tables.f]\n{table}\n", "ball.toml")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            b"0,1\n1,two\n",
            "line 2 of '.*data.csv' holds 'two', which is no finite number; correct it, or put a # before",
        ),
        (b"0;0,1\n1;0,2\n", "line 1 of '.*data.csv' holds '0,1', which is no finite number; write .* point, 0.1"),
        (b"0,1\n1\n", "line 2 of '.*data.csv' has 1 numbers, the first has 2; give as many in each line"),
        (b"T in \xb0C,1\n1,2\n", "'.*data.csv' cannot be read: byte 0xb0 at 5 is no UTF-8; save it as UTF-8"),
    ],
)
def test_a_file_of_other_things_is_refused_with_a_remedy(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_bytes(content)
    with pytest.raises(MechanismError, match=f"tables.f.file: {message}"):
        Table("f", file=tmp_path / "data.csv")


# --------------------------------------------------------------------------- contacts between places, by hand


def rotation(axis: str, angle: float) -> sp.Matrix:
    turn = {"x": sp.rot_axis1, "y": sp.rot_axis2, "z": sp.rot_axis3}[axis]
    return turn(-angle).evalf(30)


def two_bodies(kind: str, **keys: object) -> Mechanism:
    """Two bodies that move freely, with a contact of ``kind`` between them, the first place being off its centre."""
    planar = CONTACTS[kind].entries == 2
    names = ["xa", "ya", "pa", "xb", "yb", "pb"] if planar else [f"{c}{b}" for b in "ab" for c in "xyzpq"]
    q = {name: coordinate(name, "rad" if name[0] in "pq" else "m", start=_START[name]) for name in names}
    of = CONTACTS[kind]
    contact = Contact(
        "c",
        kind=kind,
        between=("a", "b"),
        friction=0.2,
        radius={0: None, 1: 0.25, 2: (0.25, 0.5), 3: (0.3, 0.2, 0.1)}[of.radii],
        length={0: None, 1: 2.0, 2: (2.0, 3.0)}[of.lengths],
        normal=(3, 4, 0) if of.normal else None,
        **keys,
    )
    if planar:
        bodies = [Body(b, 1, (q[f"x{b}"], q[f"y{b}"]), angle=q[f"p{b}"], inertia=1) for b in "ab"]
        return Mechanism("two", coordinates=list(q.values()), bodies=bodies, contacts=[contact])
    frames = [
        Frame(f"f{b}", origin=[q[f"{c}{b}"] for c in "xyz"], rotations=[("x", q[f"p{b}"]), ("z", q[f"q{b}"])])
        for b in "ab"
    ]
    bodies = [Body(f"body_{b}", 1, frame=f"f{b}", inertia=(1, 1, 1, 0, 0, 0)) for b in "ab"]
    points = [Point(b, (0.1, 0.2, -0.3), frame=f"f{b}") for b in "ab"]
    return Mechanism(
        "two", coordinates=list(q.values()), frames=frames, bodies=bodies, points=points, contacts=[contact]
    )


_START = {
    "xa": 3.0,
    "ya": 4.0,
    "za": 1.0,
    "pa": 0.4,
    "qa": -0.7,
    "xb": 0.1,
    "yb": 0.2,
    "zb": -0.2,
    "pb": 0.3,
    "qb": 0.5,
}


def material(names: dict[str, float], b: str, planar: bool, place: sp.Matrix) -> sp.Matrix:
    """Where the point at ``place`` of body ``b``, in its axes, is in the world, at the values ``names``."""
    if planar:
        origin, turn = sp.Matrix([names[f"x{b}"], names[f"y{b}"], 0]), rotation("z", names[f"p{b}"])
    else:
        origin = sp.Matrix([names[f"{c}{b}"] for c in "xyz"])
        turn = rotation("x", names[f"p{b}"]) * rotation("z", names[f"q{b}"])
    return origin + turn * place


def turned(values: dict[str, float], b: str, planar: bool, vector: sp.Matrix) -> sp.Matrix:
    return material(values, b, planar, vector) - material(values, b, planar, sp.zeros(3, 1))


@pytest.mark.parametrize("kind", [kind for kind, of in CONTACTS.items() if of.radii < 3 and not of.lengths])
def test_gap_and_slip_are_those_of_the_material_points(kind: str) -> None:
    """Gap and slip against the motion of the two material points at the contact, by central differences."""
    mechanism = two_bodies(kind)
    (unilateral,) = mechanism.unilaterals
    planar = mechanism.dimension == 2
    centre = sp.zeros(3, 1) if planar else sp.Matrix([0.1, 0.2, -0.3])
    first, second = {0: (0, 0), 1: (0.25, 0), 2: (0.25, 0.5)}[CONTACTS[kind].radii]
    if kind.startswith("point") and CONTACTS[kind].radii:
        first, second = 0, 0.25
    generator = random.Random(3)
    values = {q.name: q.start for q in mechanism.coordinates}
    rates = {q.name: generator.uniform(-1, 1) for q in mechanism.coordinates}
    a, b = (material(values, body, planar, centre) for body in "ab")
    apart = a - b
    if CONTACTS[kind].normal:
        normal = turned(values, "b", planar, sp.Matrix([0.6, 0.8, 0]))
        gap = normal.dot(apart) - first
    else:
        normal = apart / apart.norm()
        gap = apart.norm() - first - second
    point = values | {f"{name}_dot": rate for name, rate in rates.items()}
    assert value_of(unilateral.gap, point) == pytest.approx(float(gap), rel=1e-13)
    on_first = a - first * normal  # in the axes of each body: the points that would touch
    on_second = on_first if CONTACTS[kind].normal else b + second * normal
    h = 1e-5
    moved = [{name: value + s * h * rates[name] for name, value in values.items()} for s in (1, -1)]
    velocity = sp.zeros(3, 1)
    for body, at, sign in (("a", on_first, 1), ("b", on_second, -1)):
        turn = sp.Matrix.hstack(*(turned(values, body, planar, sp.eye(3)[:, k]) for k in range(3)))
        place = turn.T * (at - material(values, body, planar, sp.zeros(3, 1)))
        ahead, behind = (material(where, body, planar, place) for where in moved)
        velocity += sign * (ahead - behind) / (2 * h)
    tangential = velocity - normal * normal.dot(velocity)
    slips = [value_of(slip, point) for slip in unilateral.slips]
    assert len(slips) == (1 if planar else 2)
    assert math.hypot(*slips) == pytest.approx(float(tangential.norm()), rel=1e-8)
    if planar:
        assert slips[0] == pytest.approx(float(sp.Matrix([normal[1], -normal[0], 0]).dot(velocity)), rel=1e-8)


def nearest(kind: str, at: dict[str, float]) -> tuple[float, sp.Matrix, sp.Matrix, sp.Matrix]:
    """The gap, the normal, and the touching points of both bodies of ``two_bodies``, found by minimisation."""
    centre = sp.Matrix([0.1, 0.2, -0.3])

    def place(body: str, own: Sequence[float]) -> np.ndarray[Any, Any]:
        return np.array(material(at, body, False, centre + sp.Matrix(own)), dtype=float).ravel()

    if kind == "ellipsoid_plane":
        normal = place("b", (0.6, 0.8, 0)) - place("b", (0, 0, 0))
        base, *ends = (place("a", x) for x in ((0, 0, 0), (0.3, 0, 0), (0, 0.2, 0), (0, 0, 0.1)))
        axes = np.array(ends) - base

        def height(angles: Any) -> float:
            s, c = np.sin(angles[0]), np.cos(angles[0])
            return float(normal @ (np.array([s * np.cos(angles[1]), s * np.sin(angles[1]), c]) @ axes))

        found = min((minimize(height, x, tol=1e-15) for x in ((1, 0), (1, 2), (1, 4), (2, 1))), key=lambda r: r.fun)
        s, c = np.sin(found.x[0]), np.cos(found.x[0])
        touching = base + np.array([s * np.cos(found.x[1]), s * np.sin(found.x[1]), c]) @ axes
        gap = float(normal @ (touching - place("b", (0, 0, 0))))
        return gap, sp.Matrix(normal), sp.Matrix(touching), sp.Matrix(touching)
    halves = (1.0, 0.0 if kind == "capsule_sphere" else 1.5)
    ends_a, ends_b = ([place(b, (0, 0, z)) for z in (-half, half)] for b, half in zip("ab", halves, strict=True))

    def spots(x: Any) -> tuple[Any, Any]:
        return ends_a[0] + x[0] * (ends_a[1] - ends_a[0]), ends_b[0] + x[1] * (ends_b[1] - ends_b[0])

    def apart(x: Any) -> float:
        on_a, on_b = spots(x)
        return float((on_a - on_b) @ (on_a - on_b))

    on_a, on_b = spots(minimize(apart, (0.5, 0.5), bounds=[(0, 1)] * 2, tol=1e-15, method="L-BFGS-B").x)
    length = float(np.linalg.norm(on_a - on_b))
    normal = (on_a - on_b) / length
    return length - 0.75, sp.Matrix(normal), sp.Matrix(on_a - 0.25 * normal), sp.Matrix(on_b + 0.5 * normal)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", [kind for kind, of in CONTACTS.items() if of.radii == 3 or of.lengths])
def test_gap_and_slip_are_those_of_the_nearest_points(kind: str, seed: int) -> None:
    """Ellipsoids and capsules against points that a minimisation finds, and against how these move with the bodies."""
    mechanism, generator = two_bodies(kind), random.Random(seed)
    (unilateral,) = mechanism.unilaterals
    values = {q.name: q.start + generator.uniform(-1, 1) for q in mechanism.coordinates}
    rates = {q.name: generator.uniform(-1, 1) for q in mechanism.coordinates}
    gap, normal, on_first, on_second = nearest(kind, values)
    point = values | {f"{name}_dot": rate for name, rate in rates.items()}
    assert value_of(unilateral.gap, point) == pytest.approx(gap, abs=1e-9)
    velocity, h = sp.zeros(3, 1), 1e-5
    moved = [{name: value + s * h * rates[name] for name, value in values.items()} for s in (1, -1)]
    for body, at, sign in (("a", on_first, 1), ("b", on_second, -1)):
        turn = sp.Matrix.hstack(*(turned(values, body, False, sp.eye(3)[:, k]) for k in range(3)))
        place = turn.T * (at - material(values, body, False, sp.zeros(3, 1)))
        ahead, behind = (material(where, body, False, place) for where in moved)
        velocity += sign * (ahead - behind) / (2 * h)
    ahead, behind = (value_of(unilateral.gap, where) for where in moved)
    assert (ahead - behind) / (2 * h) == pytest.approx(float(normal.dot(velocity)), abs=1e-6)
    tangential = velocity - normal * normal.dot(velocity)
    slips = [value_of(slip, point) for slip in unilateral.slips]
    assert math.hypot(*slips) == pytest.approx(float(tangential.norm()), rel=1e-6)


def test_a_flat_disc_rolls_on_its_rim_and_lies_on_its_face() -> None:
    """The rim's lowest point where it is tilted; flat on the plane its centre, without a jump of gap or slip."""
    tilt = coordinate("tilt", "rad", start=0.3)
    z, x = coordinate("z", "m", start=1.0), coordinate("x", "m")
    frame = Frame("f", origin=(x, 0, z), rotations=[("y", tilt)])
    body = Body("b", 1, frame=frame, inertia=(1, 1, 1, 0, 0, 0))
    rim = Contact("c", kind="ellipsoid_plane", between=("f", "world"), normal="z", radius=(0.2, 0.2, 0), friction=1)
    mechanism = Mechanism("coin", coordinates=[x, z, tilt], frames=[frame], bodies=[body], contacts=[rim])
    (found,) = mechanism.unilaterals
    at = {"x": 0.0, "z": 1.0, "x_dot": 0.0, "z_dot": 0.0, "tilt_dot": 1.0}
    for angle in (0.3, -0.8, 1.5):
        assert value_of(found.gap, at | {"tilt": angle}) == pytest.approx(1 - 0.2 * abs(math.sin(angle)), abs=1e-11)
        slips = math.hypot(*(value_of(slip, at | {"tilt": angle}) for slip in found.slips))
        assert slips == pytest.approx(0.2 * abs(math.sin(angle)), abs=1e-11)
    assert value_of(found.gap, at | {"tilt": 0.0}) == 1.0
    assert value_of(found.gap.diff("tilt"), at | {"tilt": 0.0}) == 0.0


def test_a_wheel_on_the_ground_slips_as_textbooks_have_it() -> None:
    text = (
        BALL
        + '[contacts.c]\nkind = "disc_line"\nbetween = ["ball", "world"]\nnormal = "y"\nradius = "r"\nfriction = 1\n'
    )
    (unilateral,) = read(text, "ball").unilaterals
    assert unilateral.gap == parse("y - r")
    assert unilateral.slips == (parse("x_dot + r*phi_dot"),)


PARTICLE = """
[mechanism]
name = "particle"
[coordinates]
x = { unit = "m" }
y = { unit = "m" }
z = { unit = "m", start = 1 }
[points]
A = { position = [1, 0, 0] }
[bodies.b]
mass = 1
position = ["x", "y", "z"]
[contacts.c]
kind = "point_plane"
friction = 0.1
normal = [0, 0, 2]
between = """


def test_a_slip_that_is_always_0_is_none() -> None:
    """As that across the plane of a robot which moves in one: no force along it does anything."""
    text = PARTICLE.replace('y = { unit = "m" }\n', "").replace('"y"', "0")
    (unilateral,) = read(text + '["b", "world"]', "particle").unilaterals
    assert [slip**2 for slip in unilateral.slips] == [symbol("x_dot") ** 2]


def test_a_particle_in_space_moves_relative_to_the_world() -> None:
    """It has coordinates for a position and no frame of its own; what rests there still does not move."""
    (unilateral,) = read(PARTICLE + '["b", "world"]', "particle").unilaterals
    assert unilateral.gap == symbol("z")
    assert {slip**2 for slip in unilateral.slips} == {symbol("x_dot") ** 2, symbol("y_dot") ** 2}
    with pytest.raises(MechanismError, match="'A' and 'world' do not move relative to each other"):
        read(PARTICLE + '["A", "world"]', "particle")


def test_a_compliant_contact_pushes_and_never_pulls() -> None:
    mechanism = hybrid()
    written = {d.name: d.expression for d in mechanism.definitions}
    assert {place: by for place, by in mechanism.origins.items() if by == "contacts.soft"} == dict.fromkeys(
        [f"definitions.soft_{x}" for x in ("gap", "force", "friction")]
        + [f"dampers.soft_{x}" for x in ("force", "friction")]
        + [f"outputs.soft_{x}" for x in ("gap", "force", "friction")],
        "contacts.soft",
    )

    def force(gap: float, rate: float) -> float:
        return value_of(written["soft_force"], {"y": gap, "y_dot": rate, "k": 1e6})

    assert force(-0.01, -0.5) == pytest.approx(1e6 * 0.01**1.5 * (1 + 0.1 * 0.5), rel=1e-13)
    assert [force(1e-9, -5.0), force(-0.01, 11.0)] == [0.0, 0.0]
    friction = value_of(written["soft_friction"], {"mu": 0.3, "soft_force": 10.0, "x_dot": 0.001})
    assert friction == pytest.approx(-0.3 * 10 / math.sqrt(2), rel=1e-13)
    dampers = {d.name: d for d in mechanism.dampers}
    assert dampers["soft_force"] == Damper("soft_force", rate=symbol("y_dot"), force=-symbol("soft_force"))


# ------------------------------------------------------------------------------------------------- what is refused

CONTACT = "[contacts.c]\n"
KIND = CONTACT + 'between = ["ball", "world"]\nnormal = "y"\nradius = "r"\n'

REFUSED = {
    "gap missing": (CONTACT, "contacts.c: 'gap' is missing; give it, or a 'kind'"),
    "gap negative": (
        CONTACT + 'gap = "y - 12*r"',
        "contacts.c: the gap is -0.2 m at the start, where y = 1 (SI); it cannot be negative: start apart or "
        "touching, or turn the sign",
    ),
    "gap without coordinates": (
        CONTACT + 'gap = "2*r - t"',
        "contacts.c: the gap '-t + 2*r' contains no coordinate, so no force can keep it open",
    ),
    "gap that is a condition": (
        CONTACT + 'gap = "y > r"',
        "contacts.c: the gap '(y - r > 0)' contains no coordinate outside of conditions, so no force",
    ),
    "gap that is a distance": (
        CONTACT + 'gap = "abs(y - r)"',
        "contacts.c: the gap 'abs(r - y)' is never below 0, so nothing tells that a body goes through",
    ),
    "gap that is a square, of a spring": (
        CONTACT + 'gap = "y**2 + r**2"\nlaw = "compliant"\nstiffness = 1',
        "contacts.c: the gap 'r**2 + y**2' is never below 0",
    ),
    "gap without a value": (
        CONTACT + 'gap = "log(y - 10*r)"',
        "contacts.c: the gap 'log(y - 10*r)' cannot be evaluated at the start, where r = 0.1, y = 1 (SI)",
    ),
    "slip not affine": (
        CONTACT + 'gap = "y"\nfriction = 1\nslip = "x_dot*abs(x_dot)"',
        "contacts.c.slip: 'x_dot*abs(x_dot)' is not affine in the velocities x_dot",
    ),
    "slip without velocity": (
        CONTACT + 'gap = "y"\nfriction = 1\nslip = "x"',
        "contacts.c.slip: 'x' is a coordinate, not a velocity; write x_dot",
    ),
    "slip of coordinates": (
        CONTACT + 'gap = "y"\nfriction = 1\nslip = "x + 2*y"',
        "contacts.c.slip: 'x + 2*y' contains coordinates and no velocity; give its rate, with x_dot, y_dot",
    ),
    "slip of a parameter": (
        CONTACT + 'gap = "y"\nfriction = 1\nslip = "r"',
        "contacts.c.slip: 'r' contains no velocity; give the relative velocity",
    ),
    "three slips": (CONTACT + 'gap = "y"\nslip = ["x_dot", "x_dot", "x_dot"]', "contacts.c.slip: has 3 entries"),
    "friction without slip": (CONTACT + 'gap = "y"\nfriction = "mu"', "contacts.c.friction: 'mu' without 'slip'"),
    "restitution too large": (
        CONTACT + 'gap = "y"\nrestitution = "4*mu"',
        "contacts.c.restitution: '4*mu' is 1.2 at the values given; Newton's coefficient is from 0 to 1",
    ),
    "stiffness of coordinates": (
        CONTACT + 'gap = "y"\nlaw = "compliant"\nstiffness = "x"',
        "contacts.c.stiffness: 'x' is a coordinate and cannot stand here",
    ),
    "negative friction": (
        CONTACT + 'gap = "y"\nfriction = -1\nslip = "x_dot"',
        "contacts.c.friction: -1; it has to be 0 or more",
    ),
    "static below sliding": (
        CONTACT + 'gap = "y"\nfriction = "mu"\nstatic_friction = 0.1\nslip = "x_dot"',
        "contacts.c.static_friction: 'mu' is 0.3 and above '0.1', which is 0.1",
    ),
    "gap of velocities": (
        CONTACT + 'gap = "y_dot"',
        "contacts.c.gap: 'y_dot' is a velocity and cannot stand here; a gap is between places",
    ),
    "mode in an output": (
        CONTACT + 'gap = "y"\n[outputs]\no = { expression = "c_mode" }',
        "outputs.o.expression: undefined symbol 'c_mode'; each FMU has it as a variable, and --output c_mode makes it",
    ),
    "load in a definition": (
        CONTACT + 'gap = "y"\n[definitions]\nN = "c_force"',
        "definitions.N.expression: 'c_force' is a contact force and cannot stand here; write it where a force",
    ),
    "gap of an input": (CONTACT + 'gap = "y - hold"', "contacts.c.gap: 'hold' is an input and cannot stand here"),
    "unknown kind": (
        KIND + 'kind = "disc_lyne"',
        "contacts.c.kind: 'disc_lyne' is no contact; did you mean 'disc_line'",
    ),
    "spatial kind": (
        KIND + 'kind = "sphere_plane"',
        "contacts.c.kind: positions have 2 entries; 'sphere_plane' is none",
    ),
    "gap and kind": (KIND + 'kind = "disc_line"\ngap = "y"', "contacts.c: 'gap' and 'kind' exclude each other"),
    "keys of a kind": (CONTACT + 'gap = "y"\nnormal = "y"', "contacts.c.normal: goes with 'kind'"),
    "radius unfit": (KIND + 'kind = "point_line"', "contacts.c.radius: does not go with 'point_line'"),
    "no ends": (CONTACT + 'kind = "point_line"\nnormal = "y"', "contacts.c: 'between' is missing"),
    "unknown end": (
        CONTACT + 'kind = "point_line"\nnormal = "y"\nbetween = ["bal", "world"]',
        "contacts.c.between: there is no frame, point or body 'bal'; did you mean 'ball'",
    ),
    "same ends": (
        CONTACT + 'kind = "point_line"\nnormal = "y"\nbetween = ["ball", "ball"]',
        "contacts.c.between: 'ball' and 'ball' do not move relative to each other",
    ),
    "normal out of the plane": (
        CONTACT + 'kind = "point_line"\nnormal = "z"\nbetween = ["ball", "world"]',
        "contacts.c.normal: 'z' is out of the plane",
    ),
    "a line that turns": (
        '[points.A]\nposition = ["x", 0]\n' + CONTACT + 'kind = "point_line"\nnormal = "y"\nbetween = ["ball", "A"]',
        "contacts.c.between: 'A' has no 'angle', which 'point_line' needs",
    ),
    "stiff and ideal": (CONTACT + 'gap = "y"\nstiffness = 1', "contacts.c.stiffness: goes with law = 'compliant'"),
    "compliant without stiffness": (CONTACT + 'gap = "y"\nlaw = "compliant"', "contacts.c: 'stiffness' is missing"),
    "compliant with restitution": (
        CONTACT + 'gap = "y"\nlaw = "compliant"\nstiffness = 1\nrestitution = 1',
        "contacts.c.restitution: a compliant contact loses energy by its 'damping'",
    ),
    "compliant without slip speed": (
        CONTACT + 'gap = "y"\nlaw = "compliant"\nstiffness = 1\nfriction = 1\nslip = "x_dot"',
        "contacts.c: 'slip_speed' is missing; 'friction' of a compliant contact goes with it",
    ),
    "unknown law": (CONTACT + 'gap = "y"\nlaw = "soft"', "contacts.c.law: 'soft' is unknown; give one of ideal"),
    "stop without bounds": ('[stops.s]\nof = "x"', "stops.s: 'lower' and 'upper' are missing"),
    "stop without coordinates": (
        '[stops.s]\nof = "x"\nlower = "x - r"',
        "stops.s.lower: the gap 'r' contains no coordinate",
    ),
    "stop upside down": (
        '[stops.s]\nof = "x"\nlower = "r"\nupper = "-r"',
        "stops.s: 'r' is 0.1 and above '-r', which is -0.1",
    ),
    "stop passed": (
        '[stops.s]\nof = "y"\nupper = 0.5',
        "stops.s.upper: the gap is -0.5 m at the start, where y = 1 (SI)",
    ),
    "friction not affine": (
        '[frictions.f]\non = "x_dot**2"\nforce = 1',
        "frictions.f.on: 'x_dot**2' is not affine in the velocities x_dot",
    ),
    "friction negative": (
        '[frictions.f]\non = "x_dot"\nforce = -1',
        "frictions.f.force: -1; a force",
    ),
    "holding less than sliding": (
        '[frictions.f]\non = "x_dot"\nforce = 2\nstatic = 1',
        "frictions.f.static: '2' is 2 and above '1', which is 1",
    ),
    "friction of nothing": (
        '[frictions.f]\non = "x_dot"\nforce = "floor_force"',
        "frictions.f.force: undefined symbol 'floor_force'",
    ),
    "condition without value": (
        '[constraints.holonomic]\nc = { expression = "x", while = "log(x)" }',
        "constraints.holonomic.c.while: 'log(x)' cannot be evaluated at the start, where x = 0 (SI)",
    ),
    "condition that is a number": (
        '[constraints.holonomic]\nc = { expression = "x", while = 1 }',
        "constraints.holonomic.c.while: '1' is a number",
    ),
    "condition of accelerations": (
        '[constraints.holonomic]\nc = { expression = "x", while = "x_ddot" }',
        "constraints.holonomic.c.while: 'x_ddot' is an acceleration and cannot stand here",
    ),
    "state that shadows": (
        "[states]\nx = { derivative = 1 }",
        "states.x: the name 'x' is already taken by coordinates.x",
    ),
    "state that is a velocity": (
        "[states]\nx_dot = { derivative = 1 }",
        "states.x_dot: the name 'x_dot' is already taken by the velocity of coordinate 'x'",
    ),
    "state without derivative": ("[states]\ni = { start = 1.0 }", "states.i: 'derivative' is missing"),
    "state in a constraint": (
        '[states]\ni = { derivative = 1 }\n[constraints.holonomic]\nc = "x - i"',
        "'i' is a further state and cannot stand here; a force may use it",
    ),
    "state in an energy": (
        '[states]\ni = { derivative = 1 }\n[energy]\npotential = "x*i"',
        "energy.potential: 'i' is a further state and cannot stand here; what has an energy is a coordinate",
    ),
    "state in a mass": (
        '[states]\ni = { derivative = 1 }\n[bodies.tank]\nmass = "i"\nposition = ["x", "y"]',
        "bodies.tank.mass: 'i' is a further state and cannot stand here; a mass or an inertia may use t and parameters",
    ),
    "coordinate in an inertia": (
        '[bodies.tank]\ninertia = "x"\nangle = "y"',
        "'x' is a coordinate and cannot stand here; a mass or an inertia may use t and parameters, energy.kinetic",
    ),
    "energy of a force": (
        '[contacts.c]\ngap = "y"\n[energy]\npotential = "c_force*x"',
        "energy.potential: 'c_force' is a contact force and cannot stand here",
    ),
    "state of no size": ("[states]\ni = { derivative = 1, nominal = 0 }", "states.i.nominal: 0.0 is not positive"),
    "generated name": (
        '[parameters.floor_gap]\nvalue = 1\n[contacts.floor]\ngap = "y"',
        "parameters.floor_gap: the name 'floor_gap' is already taken by the gap of the contact or stop 'floor'",
    ),
    "two of one name": (
        '[frictions.c]\non = "x_dot"\nforce = 1\n[contacts.c]\ngap = "y"',
        "the name 'c_force' is generated twice: the normal force of the contact or stop 'c'",
    ),
    "word as a name": (
        "[inputs.smooth]",
        "inputs.smooth: the name 'smooth' is already taken by a word of the language",
    ),
    "table that shadows": (
        "[tables.x]\ncolumns = [[0, 1], [1, 2]]",
        "tables.x: the name 'x' is already taken by coordinates.x; choose another one",
    ),
    "table with too many arguments": (
        '[tables.f]\ncolumns = [[0, 1], [1, 2]]\n[forces]\nx = "f(x, y)"',
        "forces.x.expression: 'f(x, y)' has 2 argument(s), the table has 1",
    ),
    "table in a constant": (
        '[tables.f]\ncolumns = [[0, 1], [1, 2]]\n[contacts.c]\ngap = "y"\nlaw = "compliant"\nstiffness = "f(1)"',
        "contacts.c.stiffness: 'f(1)': a table cannot stand in a constant",
    ),
    "table without an argument": (
        '[tables.f]\ncolumns = [[0, 1], [1, 2]]\n[forces]\nx = "-f"',
        "forces.x: the table 'f' has no argument at column 2 of '-f'; write f(...)",
    ),
    "no such table": ('[forces]\nx = "g(x)"', "forces.x: 'g' is not a function"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_wrong_is_named_with_place_value_and_remedy(case: str) -> None:
    lines, message = REFUSED[case]
    with pytest.raises(TextError, match=re.escape(message)) as caught:
        read(f"{BALL}{lines}\n", "ball.toml")
    assert str(caught.value).startswith("ball.toml: ")


X = coordinate("x", "m")
WRONG = {
    "no restitution": (lambda: Contact("c", X, restitution=None), "contacts.c.restitution: is None; give a value"),
    "no slips": (lambda: Contact("c", X, []), "contacts.c.slip: has no entries"),
    "one name": (lambda: Contact("c", between="ball"), "contacts.c.between: expected a list of names, got 'ball'"),
    "nothing stopped": (lambda: Stop("s", None, lower=0), "stops.s.of: is None; give a value"),
    "no force": (lambda: Friction("f", X.dot, None), "frictions.f.force: is None; give a value"),
    "text as start": (lambda: State("i", "A", "0", 1), "states.i.start: expected a number, got '0'"),
    "no nominal": (lambda: State("i", "A", 0, 1, None), "states.i.nominal: is None; give a value"),
    "number as unit": (lambda: State("i", 3, 0, 1), "states.i.unit: expected a unit such as 'm/s', got 3"),
    "unknown unit": (lambda: Table("f", columns=[[0, 1], [1, 2]], units=["m", "q"]), "tables.f.units: unit 'q'"),
    "one column": (lambda: Table("f", columns=5), "tables.f.columns: expected an array of columns, got 5"),
    "number as file": (lambda: Table("f", file=3), "tables.f.file: expected the path of a CSV file, got 3"),
    "relation": (lambda: Stop("s", Choice(X > 0, X, 0), 0), "stops.s.of: 'if(x > 0 > 0, x, 0)' has a derivative"),
    "no list": (lambda: Mechanism("m", coordinates=[X], stops=Stop("s", X, 0)), "stops: expected a list, got Stop"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_value_of_another_kind_is_named_in_python_too(case: str) -> None:
    build, message = WRONG[case]
    with pytest.raises(MechanismError, match=re.escape(message)):
        build()


def test_columns_may_be_arrays() -> None:
    table = Table("f", columns=np.array([[0, 1], [1, 2]]), units=["m", "N"])
    assert table == Table("f", columns=[[0.0, 1.0], [1.0, 2.0]], units=["m", "N"])


def test_impacts_are_sequential_or_simultaneous() -> None:
    with pytest.raises(TextError, match=r"mechanism.impacts: 'both' is unknown; give 'sequential' or 'simultaneous'"):
        read(BALL.replace('name = "ball"', 'name = "ball"\nimpacts = "both"'), "ball.toml")


UNITS = {
    "gap": (CONTACT + 'gap = "x_m"', "contacts.c.gap: 'x_m' is in kg, expected m"),
    "slip": (CONTACT + 'gap = "y"\nslip = "phi_dot"', "contacts.c.slip: 'phi_dot' is in 1/s, expected m/s"),
    "restitution": (CONTACT + 'gap = "y"\nrestitution = "r"', "contacts.c.restitution: 'r' is in m, expected 1"),
    "stiffness": (
        CONTACT + 'gap = "y"\nlaw = "compliant"\nstiffness = "N"',
        "contacts.c.stiffness: 'N' is in N, expected kg/m^0.5/s2",
    ),
    "bound": ('[stops.s]\nof = "x"\nupper = "phi + 7"', "stops.s.upper: '7 + phi' is in 1, expected m"),
    "friction": ('[frictions.f]\non = "phi_dot"\nforce = "N"', "frictions.f.force: 'N' is in N, expected N.m"),
    "state": ('[states]\ni = { unit = "A", derivative = "i" }', "states.i.derivative: 'i' is in A, expected A/s"),
    "condition": (
        '[constraints.holonomic]\nc = { expression = "x", while = "x - phi" }',
        "constraints.holonomic.c.while: 'x' is in m but '-phi' is in 1",
    ),
    "argument": (
        '[tables.f]\ncolumns = [[0, 1], [1, 2]]\nunits = ["rpm", "N"]\n[forces]\nx = "f(x)"',
        "forces.x.expression: the argument 'x' of 'f' is in m, its column is in 1/s",
    ),
    "value": (
        '[tables.f]\ncolumns = [[0, 1], [1, 2]]\nunits = ["m", "J"]\n[forces]\nx = "f(x)"',
        "forces.x.expression: 'f(x)' is in N.m, expected N",
    ),
    "cases": ('[forces]\nx = "if(x > 0, N, r)"', "forces.x.expression: 'N' is in N but 'r' is in m"),
}


@pytest.mark.parametrize("case", UNITS)
def test_units_that_do_not_fit_are_refused(case: str) -> None:
    lines, message = UNITS[case]
    more = 'strict_units = true\n[parameters]\nN = { value = 1, unit = "N" }\nx_m = { value = 1, unit = "kg" }\n'
    text = BALL.replace("[parameters]\n", more) + lines
    with pytest.raises(TextError, match=re.escape(message)) as caught:
        read(text, "ball.toml")
    assert isinstance(caught.value.__cause__, UnitError)


def test_numbers_of_a_compliant_contact_between_places_need_no_unit() -> None:
    """What the contact brings is not checked as if it had been written, so strict units take a number as a radius."""
    text = BALL.replace("[parameters]\n", "strict_units = true\n[parameters]\n") + KIND.replace('"r"', "0.1")
    law = 'kind = "disc_line"\nlaw = "compliant"\nstiffness = 1e5\nfriction = 0.3\nslip_speed = 0.01\n'
    assert read(text + law, "ball").warnings == ()
