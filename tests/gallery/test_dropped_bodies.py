"""Bodies that are dropped into corners, on a slope and into a box: whatever the start, the laws of contact hold."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from lag2fmu import simulate
from lag2fmu.fmu import Fmu
from lag2fmu.formats.text import read
from tests.support.stepping import Stepping

pytestmark = pytest.mark.fmu

Array = NDArray[np.float64]
Plane = tuple[Sequence[float], Sequence[float]]
"""The normal of a plane, and a point of it in m."""
STARTS = range(4)
"""Seeds of random starts."""


def world(name: str, bodies: int, planes: Sequence[Plane]) -> str:
    """The text of a mechanism with gravity and planes, and coordinates of bodies that move freely."""
    heights = [0.3 * (i + 1) for i in range(bodies)]
    coordinates = "".join(
        f'x{i} = {{ unit = "m" }}\ny{i} = {{ unit = "m" }}\nz{i} = {{ unit = "m", start = {z} }}\n'
        f"e{i}0 = {{ guess = 1 }}\ne{i}1 = {{}}\ne{i}2 = {{}}\ne{i}3 = {{}}\n"
        for i, z in enumerate(heights)
    )
    walls = "".join(f"[frames.wall{j}]\norigin = {list(origin)}\n" for j, (_, origin) in enumerate(planes))
    gravity = "[gravity]\nacceleration = 9.81\ndirection = [0, 0, -1]\n"
    return f'[mechanism]\nname = "{name}"\n[coordinates]\n{coordinates}{gravity}{walls}'


def body(i: int, mass: float, inertia: Sequence[float], places: Array, planes: Sequence[Plane], laws: str) -> str:
    """The text of body ``i``, with ``inertia`` (3,) in kg m^2 and contacts of ``places`` (k, 3) in m with planes."""
    kind = "sphere_plane" if "radius" in laws else "point_plane"
    text = (
        f'[frames.f{i}]\norigin = ["x{i}", "y{i}", "z{i}"]\nquaternion = ["e{i}0", "e{i}1", "e{i}2", "e{i}3"]\n'
        f'[bodies.b{i}]\nframe = "f{i}"\nmass = {mass}\ninertia = {[*inertia, 0, 0, 0]}\n'
    )
    for k, place in enumerate(places.tolist()):
        text += f'[points.p{i}{k}]\nframe = "f{i}"\nposition = {place}\n'
        for j, (normal, _) in enumerate(planes):
            text += (
                f'[contacts.c{i}{k}{j}]\nkind = "{kind}"\nbetween = ["p{i}{k}", "wall{j}"]\n'
                f"normal = {(np.array(normal) / np.linalg.norm(normal)).tolist()}\n{laws}\n"
            )
    return text


def drop(fmu: Fmu, start: dict[str, float], stop: float) -> None:
    """No gap is negative by more than what counts as closed, no contact pulls, no energy grows, and impacts end."""
    names = [v.name for v in fmu.description.variables]
    gaps, forces, impacts = ([x for x in names if x.endswith(end)] for end in ("_gap", "_force", "_impacts"))
    run = simulate(fmu, stop_time=stop, step=0.002, values=start, outputs=[*gaps, *forces, *impacts, "total_energy"])
    assert min(run[name].min() for name in gaps) > -1e-8
    assert min(run[name].min() for name in forces) > -1e-8
    assert np.diff(run["total_energy"]).max() < 1e-5
    assert sum(run[name][-1] for name in impacts) < 1500  # five contacts that accumulate together have some hundreds


def thrown(random: np.random.Generator, i: int, place: Sequence[float], speed: float) -> dict[str, float]:
    """A start of body ``i`` at a ``place`` (m), in any attitude, with velocities of about ``speed`` (m/s)."""
    quaternion = random.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    velocity = speed * random.normal(size=3)
    start = {f"e{i}{k}": float(x) for k, x in enumerate(quaternion)}
    for name, x, v in zip("xyz", place, velocity, strict=True):
        start |= {f"{name}{i}": float(x), f"{name}{i}_dot": float(v)}
    return start


def test_a_box_slides_down_and_stops(exported: Callable[..., Fmu]) -> None:
    """Feet that slide share loads evenly, until one of them would have to be pulled: it leaves the slope."""
    slope = [((np.sin(0.35), 0.0, np.cos(0.35)), (0, 0, 0))]
    corners = np.array([[a, b, c] for a in (-0.05, 0.05) for b in (-0.1, 0.1) for c in (-0.15, 0.15)])
    inertia = [(0.1**2 + 0.15**2) / 3, (0.05**2 + 0.15**2) / 3, (0.05**2 + 0.1**2) / 3]
    text = world("slope", 1, slope) + body(0, 1.0, inertia, corners, slope, "friction = 0.6\nrestitution = 0.3")
    fmu = exported(read(text, "slope.toml"))
    for seed in STARTS:
        drop(fmu, thrown(np.random.default_rng(seed), 0, (0, 0, 0.4), 1.0), 1.5)


def test_a_tetrahedron_falls_into_a_corner(exported: Callable[..., Fmu]) -> None:
    """Two walls of the corner are perpendicular: a foot in their edge is a dead centre of the others' slips.

    A foot that touches two walls has rows which others nearly hold, and an impact may turn the slip of another foot.
    Start 7 comes to a friction that gives way so slowly that rounding turns its force; start 56 to many ways to rest.
    """
    walls = [(n, (0, 0, 0)) for n in ((1, 1, 1), (-1, 1, 1), (0, -1, 1))]
    feet = 0.1 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    text = world("corner", 1, walls) + body(0, 1.0, [0.01] * 3, feet, walls, "friction = 0.3\nrestitution = 0.2")
    fmu = exported(read(text, "corner.toml"), optimised=True)
    for seed in (*STARTS, 7, 56):
        drop(fmu, thrown(np.random.default_rng(seed), 0, (0, 0, 0.8), 0.5), 1.5)


def test_balls_in_a_box_miss_no_impact(exported: Callable[..., Fmu]) -> None:
    """Balls that roll along walls have forces and gaps of rounding there, whose roots must not hide an impact.

    In start 26 the force of a contact jumps where another one's slip comes to rest, and in start 64 a trial step that
    comes to such a rest is given up: neither leaves a rest that hides the next event. In start 45 the impacts of five
    contacts accumulate together, and end.
    """
    around = [
        ((1, 0, 0), (-0.3, 0, 0)),
        ((-1, 0, 0), (0.3, 0, 0)),
        ((0, 1, 0), (0, -0.3, 0)),
        ((0, -1, 0), (0, 0.3, 0)),
    ]
    walls = [((0, 0, 1), (0, 0, 0)), *around]
    laws = "friction = 0.3\nrestitution = 0.4"
    text = world("box", 3, walls)
    for i in range(3):
        text += body(i, 1.0 + i, [0.01 * (1 + i)] * 3, np.zeros((1, 3)), walls, f"radius = 0.1\n{laws}")
        for j in range(i):
            ends = f'between = ["p{i}0", "p{j}0"]\nradius = [0.1, 0.1]'
            text += f'[contacts.s{i}{j}]\nkind = "sphere_sphere"\n{ends}\n{laws}\n'
    fmu = exported(read(text, "box.toml"), optimised=True)
    for seed in (*STARTS, 26, 45, 64):
        random = np.random.default_rng(seed)
        start: dict[str, float] = {}
        for i in range(3):
            x, y = random.uniform(-0.15, 0.15, 2)
            start |= thrown(random, i, (x, y, 0.15 + 0.25 * i), 2.0)
        drop(fmu, start, 1.0)


def test_both_ends_of_an_edge_give_way_together(exported: Callable[..., Fmu]) -> None:
    """A brick that falls flat on an edge sticks, tips over, and begins to slip with both corners of it at once."""
    floor = [((0, 0, 1), (0, 0, 0))]
    a, b, c = 0.05, 0.05, 0.3
    corners = np.array([[x, y, z] for x in (-a, a) for y in (-b, b) for z in (-c, c)])
    inertia = [(b**2 + c**2) / 3, (a**2 + c**2) / 3, (a**2 + b**2) / 3]
    text = world("brick", 1, floor) + body(0, 1.0, inertia, corners, floor, "friction = 1.05\nrestitution = 0")
    start = {"z0": 0.579799, "e00": -0.0681067, "e01": 0.583609, "e02": -0.378704, "e03": 0.715084}
    drop(exported(read(text, "brick.toml")), start | {"x0_dot": -0.189143, "y0_dot": 0.3559, "z0_dot": -0.160585}, 1.0)


def pile() -> str:
    """The text of three boxes of 1 kg on one another, each a little aside; the lowest slides when they land."""
    inertia = (0.0325 / 12, 0.05 / 12, 0.0625 / 12)
    text = '[mechanism]\nname = "pile"\n[gravity]\nacceleration = 9.81\ndirection = [0, 0, -1]\n'
    for i, below in enumerate(("world", "top0", "top1")):
        starts = {f"x{i}": 0.02 * i, f"y{i}": 0.01 * i, f"z{i}": 0.06 + 0.11 * i, f"e{i}0": 1.0}
        starts |= {f"e{i}{k}": 0.0 for k in (1, 2, 3)}
        for name, start in starts.items():
            text += f"[coordinates.{name}]\nstart = {start}\nnominal = {0.1 if name[0] in 'yz' else 1.0}\n"
        text += body(i, 1.0, inertia, np.zeros((0, 3)), [], "")
        text += f'[points.top{i}]\nframe = "f{i}"\nposition = [0, 0, 0.05]\n'
        for k, (x, y) in enumerate(((0.1, 0.075), (0.1, -0.075), (-0.1, 0.075), (-0.1, -0.075))):
            text += f'[points.k{i}{k}]\nframe = "f{i}"\nposition = [{x}, {y}, -0.05]\n'
            text += f'[contacts.c{i}{k}]\nkind = "point_plane"\nbetween = ["k{i}{k}", "{below}"]\nnormal = "z"\n'
            text += "friction = 0.5\nrestitution = 0\n"
    return text.replace("[coordinates.x0]\n", "[coordinates.x0]\nvelocity = 0.5\n")


def test_a_foot_that_stops_beside_feet_that_slide_holds_by_its_own_load(exported: Callable[..., Fmu]) -> None:
    """Loads of least norm tell what the foot bears; for 2 microseconds it held 1.1 N more than its friction can."""
    names = [f"c{i}{k}_{of}" for i in range(3) for k in range(4) for of in ("force", "friction_1", "friction_2")]
    with Stepping(exported(read(pile(), "pile.toml")).path) as stepping:
        stepping.start(tolerance=1e-6)
        stepping.step(0.08838)
        for _ in range(40):
            stepping.step(0.5e-6)
            loads = np.reshape(stepping.get(names), (12, 3))
            assert (np.hypot(loads[:, 1], loads[:, 2]) - 0.5 * loads[:, 0]).max() < 1e-7
