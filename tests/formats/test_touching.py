"""Contacts from a robot's geometry: as MuJoCo finds them, and what is wrong in a file is named."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

from lag2fmu import derive, export, load, simulate
from lag2fmu.errors import LoadError
from lag2fmu.fmu.deriving import derived
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.graph.batches import Evaluator
from lag2fmu.language.vocabulary import value_of
from lag2fmu.mechanism.record import Mechanism

Robot = Callable[..., Mechanism]
Floats = np.ndarray[Any, np.dtype[np.float64]]


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """What makes a mechanism of a text and options, by its first letters a MJCF or a URDF file."""

    def made(text: str, **options: object) -> Mechanism:
        path = tmp_path / ("robot.xml" if text.lstrip().startswith("<mujoco") else "robot.urdf")
        path.write_text(text)
        return load(path, options)

    return made


# -------------------------------------------------------------------------------------------------- as MuJoCo has it

SHAPES = {
    "sphere": 'type="sphere" size="0.15"',
    "capsule": 'type="capsule" size="0.1 0.2"',
    "box": 'type="box" size="0.1 0.2 0.3"',
    "cylinder": 'type="cylinder" size="0.2 0.1"',
    "ellipsoid": 'type="ellipsoid" size="0.1 0.2 0.3"',
}
SCENE = """<mujoco model="scene"><worldbody>
<geom name="floor" type="plane" size="1 1 1" pos="0.1 -0.2 0.3" euler="10 -20 0"/>
<body name="part" pos="0 0 3"><freejoint name="part"/><geom name="shape" {shape} pos="0.1 0.05 -0.1" euler="30 40 50"/>
</body>{others}</worldbody></mujoco>"""


def values_of(body: str, place: Floats, q: Floats) -> dict[str, float]:
    """The coordinates of a free ``body``."""
    named = zip((f"{body}_{x}" for x in ("x", "y", "z", "e0", "e1", "e2", "e3")), (*place, *q), strict=True)
    return {name: float(x) for name, x in named}


CHAIN = SCENE.replace(
    "</body>{others}",
    """<body name="arm" pos="0.2 -0.1 0.3" euler="-50 20 70"><joint name="h" axis="1 2 -1" pos="0.1 0 -0.2"/>
<geom name="tip" {shape} pos="-0.1 0.2 0.1" euler="70 -10 20"/></body></body>""",
)
RATES = 7
"""How many velocities MuJoCo's chain has: 3 along the axes of the world, 3 about those of the part, 1 of the hinge."""


class OnFloor:
    """The contacts of the chain on a plane at states of MuJoCo, and that they move as MuJoCo's points of the bodies."""

    def __init__(self, mujoco: Any, mechanism: Mechanism, own: Sequence[int]) -> None:
        """``own`` (k,) are the indices of the contacts that are looked at."""
        equations, n = derive(mechanism), len(mechanism.contacts)
        rows = equations.rows
        self._mujoco, self._gaps = mujoco, Evaluator(equations.graph, [rows.positions[c] for c in own])
        three = [rows.velocities[k] for c in own for k in (c, n + 2 * c, n + 2 * c + 1)]
        self._rates = Evaluator(equations.graph, three)
        self._names = [q.name for q in mechanism.coordinates]
        self._values = {p.name: p.value for p in mechanism.parameters} | {"t": 0.0}
        self._bodies = [2 if mechanism.contacts[c].name.startswith("tip") else 1 for c in own]

    def gaps(self, data: Any) -> Floats:
        """The gaps (k,) in m at the places of ``data``."""
        return self._gaps(self._at(data))

    def found(self, model: Any, data: Any) -> list[tuple[float, ...]]:
        """Gap, normal and the middle between the touching points of all contacts that overlap, sorted.

        The rates of a gap and of two slips at each of MuJoCo's velocities give the axes d of the contact, by the
        velocities of the part's origin o, and (p - o) x d, by its turns, for the touching point p. The sum of
        d x ((p - o) x d) over the three axes is 2 (p - o). By the hinge, p moves as MuJoCo says.
        """
        q, o = data.qpos[3:7], data.qpos[:3]
        moving = np.zeros((len(self._names), RATES))
        moving[:3, :3], moving[7, 6] = np.eye(3), 1.0
        moving[3:7, 3:6] = np.array([[-w @ q[1:], *(q[0] * w + np.cross(q[1:], w))] for w in np.eye(3)]).T / 2
        at = self._at(data) | {f"{name}_dot": row for name, row in zip(self._names, moving, strict=True)}
        rates = self._rates(at).reshape(-1, 3, RATES)
        found = []
        for gap, body, rate in zip(self.gaps(data), self._bodies, rates, strict=True):
            axes, turn = rate[:, :3], data.xmat[1].reshape(3, 3)
            point = o + np.cross(axes, rate[:, 3:6] @ turn.T).sum(axis=0) / 2
            self._mujoco.mj_jac(model, data, jacobian := np.zeros((3, RATES)), None, point, body)
            assert np.allclose(axes @ jacobian, rate, rtol=0, atol=1e-12)
            if gap < 0:
                found.append((float(gap), *axes[0], *(point - axes[0] * gap / 2)))
        return sorted(found)

    def _at(self, data: Any) -> dict[str, Any]:
        return self._values | dict(zip(self._names, data.qpos.tolist(), strict=True))


@pytest.mark.parametrize("shape", SHAPES)
def test_contact_points_on_a_plane_are_those_of_mujoco(robot: Robot, shape: str) -> None:
    """Number, gaps, normals and places in random states that are apart, touch and overlap; 1e-9.

    MuJoCo puts a contact midway between the surfaces. The plane is inclined, one shape is on a free body and one on its
    arm, both off the origins. Of a cylinder the lowest points of both rims are compared: MuJoCo has two more on the
    near face, equally deep, that move about its axis where we have four on each face that do not.
    """
    mujoco = pytest.importorskip("mujoco")
    text = CHAIN.format(shape=SHAPES[shape])
    mechanism, model = robot(text, ground="all"), mujoco.MjModel.from_xml_string(text)
    data, rng, counts = mujoco.MjData(model), np.random.default_rng(5), set()
    mujoco.mj_forward(model, data)
    up, on_plane = data.geom_xmat[0].reshape(3, 3)[:, 2].copy(), data.geom_xpos[0].copy()
    kinds = [contact.kind for contact in mechanism.contacts]
    own = [k for k, kind in enumerate(kinds) if shape != "cylinder" or kind == "ellipsoid_plane"]
    on_floor = OnFloor(mujoco, mechanism, own)
    for _ in range(100):
        q = rng.normal(size=4)
        data.qpos[:] = (*(on_plane + rng.normal(size=3)), *(q / np.linalg.norm(q)), rng.uniform(-4, 4))
        data.qpos[:3] -= up * (min(on_floor.gaps(data)) + rng.choice([-0.02, 0.0005, 0.03, 0.08]))
        mujoco.mj_forward(model, data)
        depths = [c.dist for c in data.contact]
        expected = sorted(
            (c.dist, *c.frame[:3], *c.pos) for c in data.contact if shape != "cylinder" or depths.count(c.dist) == 1
        )
        found = on_floor.found(model, data)
        assert len(found) == len(expected)
        assert np.allclose(found, expected, rtol=0, atol=1e-9)
        counts.add(len(found))
    assert {0, 1} <= counts
    assert shape in ("sphere", "ellipsoid") or max(counts) > 1


def test_a_cylinder_stands_on_points_within_its_faces(robot: Robot) -> None:
    """Upright all are as deep as the faces; on its side none is as low as its rims, so that it rolls on these."""
    pytest.importorskip("mujoco")
    others = '<body name="wheel" pos="2 0 2"><freejoint name="wheel"/><geom type="cylinder" size="0.2 0.1"/></body>'
    text = SCENE.format(shape=SHAPES["sphere"], others=others).replace(' pos="0.1 -0.2 0.3" euler="10 -20 0"', "")
    mechanism = robot(text, ground="all")
    gaps = {x.name: x.gap for x in mechanism.unilaterals if x.name.startswith("wheel")}
    assert len(gaps) == 10
    for tilt in (0.0, 0.3, -1.1, np.pi / 2):
        at = values_of("wheel", np.array([2.0, 0.0, 2.0]), np.array([np.cos(tilt / 2), 0.0, np.sin(tilt / 2), 0.0]))
        found = {name: value_of(gap, at) for name, gap in gaps.items()}
        lowest = 2 - 0.1 * np.cos(tilt) - 0.2 * abs(np.sin(tilt))
        assert min(found.values()) == pytest.approx(lowest, abs=1e-11)
        standing = [name for name, gap in found.items() if gap < lowest + 1e-9]
        assert len(standing) == (5 if tilt == 0.0 else 2 if tilt == np.pi / 2 else 1)


ROUND = """<body name="{name}" pos="{x} 0 3"><freejoint name="{name}"/>
<geom name="{name}" {shape} pos="0.1 0.05 -0.1" euler="30 40 50"/></body>"""


def slope(expression: sp.Expr, at: dict[str, float], name: str) -> float:
    """The derivative of ``expression`` by ``name``, from differences of fourth order with steps of .02 mm."""
    weights = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
    return sum(w * value_of(expression, at | {name: at[name] + 2e-5 * k}) for k, w in weights.items()) / 2e-5


@pytest.mark.parametrize(("first", "second"), [("sphere", "sphere"), ("capsule", "sphere"), ("capsule", "capsule")])
def test_spheres_and_capsules_touch_each_other_as_in_mujoco(robot: Robot, first: str, second: str) -> None:
    """Gap, normal and place in random states; 1e-9."""
    mujoco = pytest.importorskip("mujoco")
    bodies = "".join(
        ROUND.format(name=name, x=x, shape=SHAPES[shape]) for name, x, shape in (("a", 3, first), ("b", 5, second))
    )
    text = SCENE.format(shape=SHAPES["sphere"], others=bodies)
    mechanism, model = robot(text, ground="all", pairs=True), mujoco.MjModel.from_xml_string(text)
    data, rng, met = mujoco.MjData(model), np.random.default_rng(8), 0
    (gap,) = (x.gap for x in mechanism.unilaterals if x.name == "a_b")
    b = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "b")
    data.qpos[2], data.qpos[3] = 50.0, 1.0
    for _ in range(10 if second == "capsule" else 30):
        at: dict[str, float] = {}
        for k, body in enumerate("ab", 1):
            q = rng.normal(size=4)
            q /= np.linalg.norm(q)
            place = np.array([0.0, 0.0, 2.0]) + 0.15 * rng.normal(size=3)
            at |= values_of(body, place, q)
            data.qpos[7 * k : 7 * k + 7] = (*place, *q)
        mujoco.mj_forward(model, data)
        contacts = [c for c in data.contact if 0 not in c.geom]
        value = value_of(gap, at)
        assert len(contacts) == (value < 0)
        for c in contacts:
            met += 1
            assert value == pytest.approx(c.dist, abs=1e-9)
            normal = np.array([slope(gap, at, f"b_{x}") for x in "xyz"])
            assert np.allclose(normal if c.geom[1] == b else -normal, c.frame[:3], rtol=0, atol=1e-9)
    assert 1 < met < 30


def test_what_touches_is_what_mujoco_lets_touch(robot: Robot) -> None:
    """Masks, excludes, parents, pairs, priority, margin, condim: all contacts of a heap by MuJoCo are among ours.

    The heap is so deep in the ground and in itself that everything touches that may.
    """
    mujoco = pytest.importorskip("mujoco")
    text = """<mujoco model="rules"><worldbody>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 1" friction="0.6" margin="0.01"/>
    <geom name="sky" type="plane" size="1 1 1" contype="0" conaffinity="0"/>
    <body name="a"><freejoint name="a"/><geom name="a" size="0.2" friction="0.3" priority="2" condim="1"/>
      <body name="a1" pos="0.1 0 0"><joint name="h" axis="0 1 0"/><geom name="a1" size="0.2" friction="0.9"/>
        <body name="a2" pos="0.1 0 0"><joint name="k" axis="0 1 0"/><geom name="a2" size="0.2" margin="0.02"/></body>
      </body></body>
    <body name="b" pos="0 0.1 0"><freejoint name="b"/><geom name="b" size="0.2" contype="2" conaffinity="1"/></body>
    <body name="c" pos="0.1 0.1 0"><freejoint name="c"/><geom name="c" size="0.2" contype="2" conaffinity="2"/></body>
    <body name="d" pos="0 0 0.1"><freejoint name="d"/><geom name="d" size="0.2" contype="0" conaffinity="0"/></body>
    <body name="e" pos="0 0 -0.1"><freejoint name="e"/><geom name="e" size="0.2" friction="1.5"/></body>
    </worldbody><contact><exclude body1="a2" body2="e"/>
    <pair geom1="d" geom2="floor" friction="0.4 0.4 0 0 0" margin="0.03"/>
    <pair geom1="a1" geom2="e" friction="0.2 0.2 0 0 0" condim="3"/></contact></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    mujoco.mj_forward(model, data := mujoco.MjData(model))
    name = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, k) for k in range(model.ngeom)]
    expected = {}
    for c in data.contact:
        ends = frozenset(name[k] for k in c.geom) - {"floor"}
        expected[ends] = (0.0 if c.dim == 1 else c.friction[0], c.includemargin)
    mechanism = robot(text, ground="all", pairs=True, law="compliant")
    parameters = {p.name: p.value for p in mechanism.parameters}
    places = {point.name: point for point in mechanism.points}
    found = {}
    for contact in mechanism.contacts:
        apart = places[str(contact.between[1])].position[2] - 1 if contact.normal else contact.radius[0] - 0.2
        found[frozenset(contact.name.split("_"))] = (contact.friction, float(apart))
    assert found.keys() == expected.keys()
    for pair, (friction, margin) in expected.items():
        coefficient, apart = found[pair]
        assert (value_of(coefficient, parameters), apart) == pytest.approx((friction, margin), abs=1e-12)


# -------------------------------------------------------------------------------------------- what stands, and starts

BODY = """<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="0.02" iyy="0.02" izz="0.02"/></inertial>
{collision}</link>"""
SHAPE = '<collision><origin xyz="{at}"/><geometry>{shape}</geometry></collision>'


def urdf(collision: str, feet: str = "") -> str:
    """A robot of one link with ``collision`` elements, and others by ``feet``."""
    return f'<robot name="box">{BODY.format(name="base", mass=2, collision=collision)}{feet}</robot>'


BOX = SHAPE.format(at="0.1 0 0", shape='<box size="0.2 0.4 0.6"/>')
CUBE = SHAPE.format(at="0 0 0", shape='<box size="0.2 0.2 0.2"/>')


def test_what_floats_is_raised_onto_the_ground(robot: Robot) -> None:
    """The lowest corners stand on z = 0; what the start has apart stays where it is."""
    mechanism = robot(urdf(BOX), base="floating", ground="all", friction="0.7", restitution=0.25)
    assert len(mechanism.contacts) == 8
    starts = {q.name: q.start for q in mechanism.coordinates}
    assert starts["base_z"] == pytest.approx(0.3, abs=1e-15)
    gaps = sorted(value_of(x.gap, starts) for x in mechanism.unilaterals)
    assert gaps == pytest.approx([0.0] * 4 + [0.6] * 4, abs=1e-15)
    values = {p.name: p.value for p in mechanism.parameters}
    assert (values["contact_friction"], values["contact_restitution"]) == (0.7, 0.25)
    assert read(write(mechanism), "again").contacts == mechanism.contacts


ARM = BODY.format(name="arm", mass=1, collision=SHAPE.format(at="0 0 -0.4", shape='<sphere radius="0.05"/>'))
HINGE = """<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="2"/></joint>"""


@pytest.mark.parametrize("pose", [{"hinge": 1.0}, "hinge=1"])
@pytest.mark.parametrize("law", ["ideal", "compliant"])
def test_a_base_that_floats_stands_on_the_ground_in_its_pose(robot: Robot, pose: object, law: str) -> None:
    """The arm turns up by 1 rad, and the base goes down until the sphere at its end touches."""
    mechanism = robot(urdf(CUBE, ARM + HINGE), base="floating", ground="arm", pose=pose, law=law)
    starts = {q.name: q.start for q in mechanism.coordinates}
    assert starts["hinge"] == 1.0
    assert starts["base_z"] == pytest.approx(0.05 + 0.4 * np.cos(1), abs=1e-15)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        ("hinges=1", "no joint 'hinges' has a coordinate of its own; did you mean 'hinge'?"),
        ("hinge", "'hinge' is no JOINT=VALUE; give the angles of joints in rad, or m"),
        ("hinge=up", "hinge = 'up' is no number; give rad, or m"),
        ({"hinge": 3}, "hinge = 3 is not within its limits, -1 to 2"),
        ({"hinge": float("nan")}, "hinge = nan is not within its limits"),
        ([0.3], "pose = [0.3]; give {joint: rad or m}, or a text as 'knee=0.8,hip=-0.4'"),
    ],
)
def test_a_pose_that_cannot_be_taken_is_said(robot: Robot, pose: object, message: str) -> None:
    with pytest.raises(LoadError) as raised:
        robot(urdf(CUBE, ARM + HINGE), base="floating", pose=pose)
    assert message in str(raised.value)


def test_what_cannot_be_raised_is_left_out_and_said(robot: Robot) -> None:
    """A contact that overlaps at the start, of a link that does not float, is told with its depth."""
    arm = BODY.format(name="arm", mass=1, collision=SHAPE.format(at="0 0 0", shape='<sphere radius="0.05"/>'))
    joint = '<joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>'
    mechanism = robot(urdf(BOX, arm + joint), ground="all")
    assert mechanism.contacts == ()
    assert mechanism.not_taken == ("the contact arm: it overlaps at the start by 0.05 m",)


def test_what_keeps_its_gap_is_left_out(robot: Robot) -> None:
    """A ball on the axis of its joint beside one that may touch; it is told if it touches always."""
    arm = BODY.format(name="arm", mass=1, collision="".join(
        SHAPE.format(at=at, shape='<sphere radius="0.05"/>') for at in ("0 0 0", "2 0 0")))  # fmt: skip
    joint = '<joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>'
    for height, told in ((1.0, ()), (0.05, ("the contact arm_1: it touches in all poses",))):
        mechanism = robot(urdf("", f'{arm}{joint}<origin xyz="0 0 {height}"/></joint>'), ground=["arm"])
        assert [contact.name for contact in mechanism.contacts] == ["arm_2"]
        assert mechanism.not_taken == told


def test_compliant_contacts_bear_the_robot_on_a_point(robot: Robot) -> None:
    """They begin where they touch; one point bears the whole weight at 1 mm."""
    mechanism = robot(urdf(BOX), base="floating", ground="base", law="compliant")
    assert {contact.law for contact in mechanism.contacts} == {"compliant"}
    assert next(q.start for q in mechanism.coordinates if q.name == "base_z") == pytest.approx(0.3, abs=1e-15)
    values = {p.name: p.value for p in mechanism.parameters}
    assert values["contact_stiffness"] * 1e-3**1.5 == pytest.approx(2 * 9.81, rel=0.01)


def stl(path: Path, triangles: Floats) -> None:
    """Write ``triangles`` (n, 3, 3) as a binary STL file."""
    rows = [struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in triangles]
    path.write_bytes(bytes(80) + struct.pack("<I", len(rows)) + b"".join(rows))


def test_a_mesh_touches_by_the_corners_of_its_hull(robot: Robot, tmp_path: Path) -> None:
    """A turned box with points inside, as STL in binary and as OBJ: 8 corners, scaled."""
    rng = np.random.default_rng(4)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)]) @ turn.T
    points = np.concatenate([corners, rng.uniform(-0.5, 0.5, size=(91, 3))])
    stl(tmp_path / "hull.stl", points.reshape(-1, 3, 3))
    (tmp_path / "hull.obj").write_text("".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist()))
    for file in ("hull.stl", "package://" + tmp_path.name + "/hull.obj"):
        shape = f'<mesh filename="{file}" scale="0.1 0.1 0.1"/>'
        mechanism = robot(urdf(SHAPE.format(at="0 0 0", shape=shape)), base="floating", ground="all")
        touching = {str(contact.between[0]) for contact in mechanism.contacts}
        found = [[float(x) for x in point.position] for point in mechanism.points if point.name in touching]
        assert np.allclose(sorted(found), sorted((0.1 * corners).tolist()), rtol=0, atol=1e-6)


LEG = """<body name="{name}" pos="{x} {y} 0"><joint name="{name}" axis="0 1 0" frictionloss="30"/>
<geom type="capsule" fromto="0 0 0 {x} 0 -0.3" size="0.02" mass="0.5" contype="0" conaffinity="0"/>
<geom name="{name}_foot" size="0.03" pos="{x} 0 -0.3" mass="0.1"/></body>"""
STANDING = """<mujoco model="standing"><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="trunk"><freejoint name="trunk"/><geom type="box" size="0.3 0.2 0.05" mass="8" pos="0.04 0.02 0.1"/>{legs}
</body></worldbody></mujoco>"""


@pytest.mark.parametrize(("boxes", "solver"), [(2, "dopri5"), (3, "moreau")])
def test_many_contacts_are_stepped_over(robot: Robot, boxes: int, solver: str) -> None:
    """From 24 of them on an export takes moreau by itself, with the reason."""
    shapes = "".join(SHAPE.format(at=f"{k} 0 0", shape='<box size="0.2 0.2 0.2"/>') for k in range(boxes))
    mechanism = robot(urdf(shapes), base="floating", ground="all")
    assert len(mechanism.contacts) == 8 * boxes
    found = derived(mechanism, None)
    assert found.solver == solver
    assert (f"impacts at {8 * boxes} contacts at once" in found.choice) == (solver == "moreau")
    assert derived(mechanism, "dopri5").solver == "dopri5"


@pytest.mark.fmu
def test_a_robot_stands_on_its_feet(robot: Robot, tmp_path: Path) -> None:
    """On four feet, of which one is redundant: they bear m g to 1e-9 for 10 s, nothing creeps."""
    pytest.importorskip("mujoco")
    at = {"front_left": (0.3, 0.2), "front_right": (0.3, -0.2), "hind_left": (-0.3, 0.2), "hind_right": (-0.3, -0.2)}
    legs = "".join(LEG.format(name=name, x=x, y=y) for name, (x, y) in at.items())
    feet = [f"{name}_foot" for name in at]
    text = STANDING.format(legs=legs).replace("frictionloss", 'armature="0.01" frictionloss')
    mechanism = robot(text, ground=",".join(at))
    assert [contact.name for contact in mechanism.contacts] == feet
    wanted = [*(f"{foot}_{what}" for foot in feet for what in ("force", "mode")), "trunk_z", "trunk_x"]
    run = simulate(export(mechanism, tmp_path / "standing.fmu"), stop_time=10, step=0.5, outputs=wanted)
    mass = sum(p.value for p in mechanism.parameters if p.name.startswith("mass_"))
    borne = sum(run[f"{foot}_force"] for foot in feet)
    assert np.allclose(borne[1:], mass * 9.81, rtol=1e-9, atol=0)
    assert all(run[f"{foot}_mode"][-1] == 2 for foot in feet)
    assert np.ptp(run["trunk_z"]) < 1e-9
    assert np.ptp(run["trunk_x"]) < 1e-9


@pytest.mark.fmu
@pytest.mark.parametrize(("solver", "sinks", "grows"), [("dopri5", 1e-10, 2e-5), ("moreau", 1e-3, 5e-5)])
def test_boxes_that_are_dropped_come_to_rest(
    robot: Robot, tmp_path: Path, solver: str, sinks: float, grows: float
) -> None:
    """Random poses and velocities: energy grows no more than by tolerance, none sinks, all rest and bear m g.

    With moreau a corner sinks for a step of 1 ms by what an impact of another one makes it move, and energies of 20 J
    are right to second order. Of 30 boxes some fall nearly flat, where not all corners can rebound and stick.
    """
    mechanism = robot(urdf(CUBE), base="floating", ground="all", friction=0.5, restitution=0.3)
    fmu, rng = export(mechanism, tmp_path / "box.fmu", solver=solver), np.random.default_rng(2)
    corners = [contact.name for contact in mechanism.contacts]
    wanted = ["total_energy", "kinetic_energy", *(f"{c}_{what}" for c in corners for what in ("gap", "force"))]
    for _ in range(30):
        q, turning, moving = rng.normal(size=4), 3 * rng.normal(size=3), rng.normal(size=3)
        q /= np.linalg.norm(q)
        rates = np.array([-q[1:] @ turning, *(q[0] * turning + np.cross(q[1:], turning))]) / 2
        values = values_of("base", np.array([0.0, 0.0, 1.0]), q)
        values |= {f"{name}_dot": x for name, x in zip(values, (*moving, *rates), strict=True)}
        run = simulate(fmu, stop_time=6, step=0.01, values=values, outputs=wanted)
        assert np.diff(run["total_energy"]).max() < grows
        assert min(run[f"{c}_gap"].min() for c in corners) > -sinks
        assert run["kinetic_energy"][-1] < 1e-24
        assert sum(run[f"{c}_force"][-1] for c in corners) == pytest.approx(2 * 9.81, rel=1e-9)


# ---------------------------------------------------------------------------------------------------- what is wrong


@pytest.mark.parametrize(
    ("collision", "options", "message"),
    [
        (BOX, {"ground": "foot"}, "ground = 'foot': no such link touches; .*base"),
        ("", {"ground": "all"}, "no link has a shape that could touch the ground; leave ground out"),
        (BOX, {"friction": 0.5}, "friction goes with ground"),
        (BOX, {"ground": "all", "friction": -1}, "friction = -1 is no coefficient"),
        (BOX, {"ground": "all", "restitution": 2}, "restitution = 2; Newton's coefficient is from 0 to 1"),
        (BOX, {"ground": "all", "restitution": "much"}, "restitution expects float, got 'much'"),
        (BOX, {"ground": "all", "law": "soft"}, "law = 'soft' is unknown; give one of ideal, compliant"),
        (BOX, {"ground": "all", "law": "compliant", "restitution": 0.5}, "restitution belongs to ideal contacts"),
        (BOX, {"ground": "all", "pairs": True}, "does not say which links touch each other; leave pairs out"),
        ("<collision/>", {"ground": "all"}, "line 2, <collision>: of the link 'base' has no shape"),
        (SHAPE.format(at="0 0", shape="<sphere/>"), {"ground": "all"}, "xyz = '0 0' has 2 numbers"),
        (SHAPE.format(at="0 0 0", shape="<sphere/>"), {"ground": "all"}, "line 2, <sphere>.*'radius' is missing"),
        (SHAPE.format(at="0 0 0", shape="<box/>"), {"ground": "all"}, "line 2, <box>.*'size' is missing"),
        (SHAPE.format(at="0 0 0", shape='<box size="1 0 1"/>'), {"ground": "all"}, "size that is not positive"),
        (SHAPE.format(at="0 0 0", shape='<box size="1 x 1"/>'), {"ground": "all"}, "size = 'x' is no number"),
        (SHAPE.format(at="0 0 0", shape='<mesh filename="no.stl"/>'), {"ground": "all"}, "no.stl: the mesh cannot be"),
        (
            SHAPE.format(at="0 0 0", shape='<mesh filename="no.ply"/>'),
            {"ground": "all"},
            "read from .stl, .obj and .dae",
        ),
        (
            SHAPE.format(at="0 0 0", shape='<mesh filename="package://p/a.stl"/>'),
            {"ground": "all"},
            "a folder 'p' above",
        ),
        (
            SHAPE.format(at="0 0 0", shape='<mesh filename="big.stl"/>'),
            {"ground": "all"},
            "has 10000000 triangles; one",
        ),
        (SHAPE.format(at="0 0 0", shape='<mesh filename="empty.obj"/>'), {"ground": "all"}, "has no vertices"),
        (
            SHAPE.format(at="0 0 0", shape='<mesh filename="bad.obj"/>'),
            {"ground": "all"},
            "a vertex of the mesh is no num",
        ),
    ],
)
def test_what_is_wrong_is_said(
    robot: Robot, tmp_path: Path, collision: str, options: dict[str, Any], message: str
) -> None:
    with (tmp_path / "big.stl").open("wb") as file:  # sparse: 500 MB that take no room
        file.write(bytes(80) + struct.pack("<I", 10**7))
        file.truncate(84 + 50 * 10**7)
    (tmp_path / "empty.obj").write_text("# nothing\n")
    (tmp_path / "bad.obj").write_text("v 1 2 three\n")
    with pytest.raises(LoadError, match=message):
        robot(urdf(collision), base="floating", **options)


def test_a_collada_file_touches_where_its_scene_puts_it(robot: Robot, tmp_path: Path) -> None:
    """A box of 2 m, of which the scene makes one of 1 m that stands 3 m higher."""
    trimesh = pytest.importorskip("trimesh", reason="meshes are optional: pip install lag2fmu[meshes]")
    pytest.importorskip("collada", reason="meshes are optional: pip install lag2fmu[meshes]")
    path = tmp_path / "box.dae"
    path.write_bytes(trimesh.exchange.dae.export_collada(trimesh.creation.box((2, 2, 2))))
    half = "<matrix>.5 0 0 0 0 .5 0 0 0 0 .5 3 0 0 0 1</matrix>"
    path.write_text(path.read_text().replace("<instance_geometry", f"{half}<instance_geometry"))
    mesh = SHAPE.format(at="0 0 0", shape='<mesh filename="box.dae"/>')
    found = robot(urdf(mesh), base="floating", ground="all")
    points = [point for point in found.points if point.name in {str(contact.between[0]) for contact in found.contacts}]
    corners = sorted(tuple(map(float, point.position)) for point in points)
    assert [*map(list, corners)] == [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (2.5, 3.5)]
    path.write_text("<COLLADA>")
    with pytest.raises(LoadError, match=r"box.dae: the mesh cannot be read: .*; export it anew"):
        robot(urdf(mesh), base="floating", ground="all")


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ('<geom type="box"/>', "MuJoCo refuses it: .*size"),
        ('<geom size="0.1" class="nowhere"/>', "MuJoCo refuses it: .*nowhere"),
        ('<geom type="mesh" mesh="none"/>', "MuJoCo refuses it: .*none"),
    ],
)
def test_what_is_wrong_in_mjcf_is_said(robot: Robot, wrong: str, message: str) -> None:
    pytest.importorskip("mujoco")
    text = f"<mujoco><worldbody><body><freejoint/><geom size='1'/>{wrong}</body></worldbody></mujoco>"
    with pytest.raises(LoadError, match=message):
        robot(text, ground="all")


def test_a_mesh_of_many_triangles_is_refused_before_mujoco_reads_it(robot: Robot, tmp_path: Path) -> None:
    """In the folder of meshes that the file names; 500 MB would take MuJoCo long."""
    pytest.importorskip("mujoco")
    (tmp_path / "meshes").mkdir()
    with (tmp_path / "meshes" / "big.stl").open("wb") as file:  # sparse: it takes no room
        file.write(bytes(80) + struct.pack("<I", 10**7))
        file.truncate(84 + 50 * 10**7)
    text = """<mujoco><compiler meshdir="meshes"/><asset><mesh name="big" file="big.stl"/></asset><worldbody>
<body><freejoint/><geom type="mesh" mesh="big"/></body></worldbody></mujoco>"""
    with pytest.raises(LoadError, match=r"big\.stl: the mesh has 10000000 triangles; .*give its convex hull, or a box"):
        robot(text)


def test_pairs_of_unknown_names_and_bodies_without_geoms_are_said(robot: Robot) -> None:
    pytest.importorskip("mujoco")
    scene = SCENE.format(shape=SHAPES["sphere"], others="")
    pair = scene.replace("</mujoco>", '<contact><pair geom1="shape" geom2="who"/></contact></mujoco>')
    with pytest.raises(LoadError, match=r"MuJoCo refuses it: .*who"):
        robot(pair, ground="all")
    with pytest.raises(LoadError, match=r"ground = 'leg': no such link touches; .*part"):
        robot(scene, ground="leg")


def test_what_is_not_taken_is_said(robot: Robot) -> None:
    """Height fields, boxes on boxes, the round ones without ``pairs``; friction that turns is taken as sliding."""
    pytest.importorskip("mujoco")
    others = "".join(
        f'<body name="{n}" pos="{k} 9 9"><freejoint name="{n}"/><geom {shape}/></body>'
        for k, (n, shape) in enumerate({"b": SHAPES["box"], "c": SHAPES["box"], "d": SHAPES["capsule"]}.items())
    )
    text = SCENE.format(shape=SHAPES["sphere"] + ' condim="6"', others=others)
    text = text.replace(
        "<worldbody>", '<asset><hfield name="hills" nrow="3" ncol="3" size="1 1 1 1"/></asset><worldbody>'
    )
    text = text.replace("</worldbody>", '<geom type="hfield" hfield="hills"/></worldbody>')
    told = robot(text, ground="all").not_taken
    assert "contacts of box with hfield: 2 pairs" in told
    assert "contacts of box with box: 1 pair" in told
    assert "contacts of 1 pair of spheres and capsules (pairs takes them)" in told
    assert "turning and rolling friction of 1 pair of geoms" in told


@pytest.mark.parametrize(
    ("floor", "shape", "told"),
    [
        ("", 'surfacevel="1 0 0 0 0 0"', ("velocities of the surfaces of 1 pair of geoms",)),
        ('condim="1"', 'condim="1" surfacevel="1 0 0 0 0 0"', ()),
        ("", 'adhesion="2"', ("adhesion of 1 pair of geoms",)),
    ],
)
def test_belts_and_adhesion_are_told(robot: Robot, floor: str, shape: str, told: tuple[str, ...]) -> None:
    """MuJoCo's geoms have had both since version 4; where nothing rubs, a surface may move as it likes."""
    mujoco = pytest.importorskip("mujoco")
    if not hasattr(mujoco.MjModel, "geom_surfacevel"):
        pytest.skip("this MuJoCo has no such geoms")
    text = SCENE.format(shape=f"{SHAPES['sphere']} {shape}", others="").replace('name="floor"', f'name="floor" {floor}')
    assert robot(text, ground="all").not_taken == told
