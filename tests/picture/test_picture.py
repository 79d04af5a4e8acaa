"""The scene of a mechanism: where things are, against closed forms; that each is there; joints read from positions."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest
import sympy as sp

from lag2fmu.dynamics import derive
from lag2fmu.errors import DerivationError
from lag2fmu.formats.loading import bundled, load
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Body, Damper, Gravity, Load, Mechanism, Point, Spring, coordinate, parameter, signal
from lag2fmu.picture import Disc, Layout, Scene, Stroke, draw, drawable, layout_of, posture, pretty
from lag2fmu.picture.arms import ARM, CONSTANT, SHIFT, steps
from lag2fmu.picture.attachments import attach, attachments
from lag2fmu.picture.layout import GAP
from lag2fmu.picture.pulleys import hung
from lag2fmu.picture.shapes import BALL, DISC, PARTICLE, ROD
from lag2fmu.reference import integrate


def layout(model: str, **arguments: object) -> Layout:
    return layout_of(derive(load(model, arguments)).mechanism)


def marks_of(scene: Scene, part: str) -> list[Stroke | Disc]:
    return [mark for mark in scene.marks if mark.part == part]


def center(scene: Scene, body: str) -> np.ndarray:
    return scene.unit * np.array(next(m.center for m in marks_of(scene, f"bodies.{body}") if isinstance(m, Disc)))


# ------------------------------------------------------------------------------------------------ positions


def test_what_only_falls_is_round_and_what_is_held_is_a_block() -> None:
    (ball,) = marks_of(draw(layout("bouncing_ball")), "bodies.ball")
    assert isinstance(ball, Disc)
    assert all(isinstance(mark, Stroke) for mark in marks_of(draw(layout("hopper_leg")), "bodies.foot"))


def test_a_name_far_from_its_thing_is_led_there() -> None:
    scene = draw(layout("two_armed_robot"))
    leaders = {mark.part: mark for mark in scene.marks if isinstance(mark, Stroke) and mark.style == "leader"}
    assert "coordinates.left_shoulder" in leaders
    for label in scene.labels:
        start = np.array(leaders[label.part].points[0]) if label.part in leaders else np.array(label.at)
        assert (np.abs(start - label.at) < [0.3 * len(label.text) * label.size + 1e-3, 0.51 * label.size + 1e-3]).all()
    assert not any(mark.style == "leader" for mark in draw(layout("double_pendulum")).marks)


def test_time_is_no_coordinate_and_axes_stand_free() -> None:
    scene = draw(layout("moving_frame"))
    assert {label.text for label in scene.labels if label.style == "coordinate"} == {"x, y"}
    sleigh = draw(layout("chaplygin_sleigh"))
    axes = [mark for mark in sleigh.marks if mark.part == "world" and isinstance(mark, Stroke)]
    left = min(x for mark in marks_of(sleigh, "bodies.sleigh") if isinstance(mark, Stroke) for x, _ in mark.points)
    assert max(x for mark in axes for x, _ in mark.points) < left - 1.0


def test_a_double_pendulum_stands_where_its_angles_say() -> None:
    scene = draw(layout("double_pendulum"))
    upper = np.array([np.sin(0.5), -np.cos(0.5)])
    lower = upper + np.array([np.sin(-0.3), -np.cos(-0.3)])
    np.testing.assert_allclose(center(scene, "upper"), upper, atol=1e-4)
    np.testing.assert_allclose(center(scene, "lower"), lower, atol=1e-4)
    rods = [scene.unit * np.array(m.points) for m in scene.marks if m.style == "link"]
    np.testing.assert_allclose(rods, [[[0, 0], upper], [upper, lower]], atol=1e-4)


def test_balls_that_touch_are_drawn_as_large_as_their_contacts_say() -> None:
    scene = draw(layout("newtons_cradle"))
    (second,), (third,) = (marks_of(scene, f"bodies.{name}") for name in ("second", "third"))
    assert isinstance(second, Disc)
    assert isinstance(third, Disc)
    assert scene.unit * (second.radius + third.radius) == pytest.approx(2 * 0.02, rel=1e-6)
    assert np.linalg.norm(np.subtract(third.center, second.center)) == pytest.approx(second.radius + third.radius)


@pytest.mark.parametrize(("model", "h"), [("pendulum", 1.0), ("cart_pole", 0.5)])
def test_other_states_are_drawn_with_the_same_scale(model: str, h: float) -> None:
    seen = layout(model)
    name = {"pendulum": "bob", "cart_pole": "pole"}[model]
    marks = posture(seen, {**seen.values, "theta": 0.2, "x": 0.0})
    place = next(m.center for m in marks if isinstance(m, Disc) and m.part == f"bodies.{name}")
    np.testing.assert_allclose(seen.unit * np.array(place), [h * np.sin(0.2), -h * np.cos(0.2)], atol=1e-4)


def test_frames_are_composed_as_by_the_direct_integration() -> None:
    mechanism = derive(load("six_axis_arm")).mechanism
    seen = layout_of(mechanism)
    run = integrate(mechanism, np.array([0.0, 1e-3]), rtol=1e-6).trajectory
    flange = [run[f"{name}"][0] for name, output in mechanism.output_names.items() if output.point == "flange"][:3]
    np.testing.assert_allclose(seen.positions[seen.skeleton.place["flange"]], flange, atol=1e-12)


@pytest.mark.parametrize("model", ["double_pendulum", "andrews_squeezer", "particle_on_cone", "slides_problem_6"])
def test_reading_a_position_does_not_move_it(model: str) -> None:
    """The spot of a body, a sum of arms, is its position as the user wrote it, at all samples."""
    seen = layout(model)
    s = seen.skeleton
    for body in s.mechanism.bodies:
        written = s.vector(tuple(s.mechanism.place(body.name)), s.samples)
        np.testing.assert_allclose(s.positions(s.samples)[s.place[body.name]][: len(written)], written, atol=1e-12)


def test_the_loop_of_a_four_bar_linkage_closes() -> None:
    scene = draw(layout("four_bar_linkage"))
    ends = Counter(
        tuple(np.round(end, 1)) for m in scene.marks if m.style == "link" for end in (m.points[0], m.points[-1])
    )
    rocker_end = [scene.unit * np.array(m.points[-1]) for m in scene.marks if m.part == "links.constraints.loop_x"]
    coupler_middle = center(scene, "coupler")
    assert any(np.allclose(end, coupler_middle, atol=1e-3) for end in rocker_end)
    assert max(ends.values()) >= 2


# ------------------------------------------------------------------------------------------------ what is there


@pytest.mark.long
@pytest.mark.parametrize("model", bundled())
def test_every_model_has_a_scene_or_a_sentence(model: str) -> None:
    mechanism = derive(load(model)).mechanism
    if not drawable(mechanism):
        with pytest.raises(DerivationError, match="no bodies or points: there is nothing to draw; give it a point"):
            layout_of(mechanism)
        return
    scene = draw(layout_of(mechanism))
    for table in ("bodies", "points", "springs", "dampers", "loads"):
        for part in getattr(mechanism, table):
            told = any(note.startswith(f"Not drawn: {table[:-1]} {part.name},") for note in scene.notes)
            assert (f"{table}.{part.name}" in scene.parts()) != told
    left, bottom, right, top = scene.box
    points = np.vstack([m.points if isinstance(m, Stroke) else [m.center] for m in scene.marks])
    assert np.isfinite(points).all()
    assert (points >= [left, bottom]).all()
    assert (points <= [right, top]).all()
    assert max(right - left, top - bottom) < 160
    assert ("gravity" in scene.parts()) == (mechanism.gravity is not None)


@pytest.mark.long
@pytest.mark.parametrize("model", [m for m in bundled() if m not in ("humanoid_planar", "andrews_squeezer")])
def test_labels_do_not_cover_each_other(model: str) -> None:
    mechanism = derive(load(model)).mechanism
    labels = draw(layout_of(mechanism)).labels if drawable(mechanism) else ()
    for k, one in enumerate(labels):
        for other in labels[:k]:
            gap = np.abs(np.array(one.at) - other.at)
            room = np.array([0.5 * (len(one.text) + len(other.text)) / 2, 1.0]) * one.size
            assert (gap >= room * 0.99).any(), (one, other)


def test_the_scene_does_not_depend_on_the_hash_seed() -> None:
    code = (
        "from lag2fmu import load, derive; from lag2fmu.picture import draw, layout_of\n"
        "print([repr(draw(layout_of(derive(load(m)).mechanism))) for m in ('four_bar_linkage', 'furuta_pendulum')])"
    )
    texts = {
        subprocess.run(
            [sys.executable, "-c", code], env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, check=True
        ).stdout
        for seed in ("1", "2", "3")
    }
    assert len(texts) == 1


# ------------------------------------------------------------------------------------------------ reading expressions


def test_positions_are_read_as_arms() -> None:
    a, b, x, r = sp.symbols("a b x r", real=True)
    order = {"x": 0, "a": 1, "b": 2}
    position = (3 + x + r * sp.sin(a) + 2 * r * sp.sin(a + b), -r * (sp.cos(a) + 2 * sp.cos(a + b)))
    found = steps(position, order)
    assert [step.kind for step in found] == [CONSTANT, SHIFT, ARM, ARM]
    assert [step.names for step in found] == [(), ("x",), ("a",), ("a", "b")]
    assert found[2].end == (3 + x + r * sp.sin(a), -r * sp.cos(a))
    assert sp.simplify(sp.Matrix(found[-1].end) - sp.Matrix(position)).is_zero_matrix


def test_constants_in_angles_do_not_part_an_arm() -> None:
    a, r = sp.symbols("a r", real=True)
    (step,) = steps((r * sp.cos(a + sp.pi / 6) + r * sp.sin(a), r * sp.sin(sp.pi / 6 - a)), {"a": 0, "r": 1})
    assert step.angles == {a}
    assert step.lengths == ("r",)


@pytest.mark.parametrize(
    ("model", "kinds"),
    [
        ("double_pendulum", {PARTICLE: 2}),
        ("cart_pole", {PARTICLE: 1, ROD: 1}),
        ("slides_problem_6", {DISC: 1, ROD: 1}),
        ("rolling_disc", {DISC: 1}),
        ("sphere_on_turntable", {BALL: 1}),
        ("furuta_pendulum", {ROD: 2}),
    ],
)
def test_inertia_tells_the_shape(model: str, kinds: dict[str, int]) -> None:
    assert Counter(shape.kind for shape in layout(model).shapes.values()) == kinds


def test_shapes_have_the_moments_of_their_bodies() -> None:
    """I = m r^2/2 of the disc gives its radius R, I = m l^2/12 of the pole its length, I = 2/5 m R^2 of the ball R."""
    values = {p.name: p.value for p in load("slides_problem_2").parameters}
    assert layout("slides_problem_2").shapes["disc"].size[0] == pytest.approx(values["R"])
    assert layout("cart_pole").shapes["pole"].size[0] == pytest.approx(0.5)
    assert layout("sphere_on_turntable").shapes["sphere"].size[0] == pytest.approx(0.03)


# ------------------------------------------------------------------------------------------------ forces


def test_springs_are_put_where_their_elongation_says() -> None:
    found = {part.name: a for part, a in attachments(layout("slides_problem_1").skeleton)}
    assert found["spring"] is not None
    assert found["spring"].share == pytest.approx(-2.0)  # the other end of the rod: a = l/3 above, l/6 below the pivot
    chain = layout("triatomic_molecule")
    place = chain.skeleton.place
    ends = [a.ends for _, a in chain.attached if a is not None]
    assert ends == [(place["left"], place["middle"]), (place["middle"], place["right"])]
    along = [a.along for _, a in layout("slides_problem_5").attached if a is not None]
    assert [np.sign(x) for x, _, _ in along] == [-1, 1]


def test_a_damper_with_a_force_has_its_own_name() -> None:
    x, rate = coordinate("x", "m", start=0.2), sp.Symbol("rate")
    damper = Damper("shock", force=rate**3, rate=x.dot)
    scene = draw(layout_of(Mechanism("damped", coordinates=[x], bodies=[Body("b", 1, (x, 0))], dampers=[damper])))
    assert [label.text for label in scene.labels if label.style == "damper"] == ["shock"]


def test_hinges_have_torsion_springs() -> None:
    arm = layout("humanoid_planar")
    knee = next(a for part, a in arm.attached if isinstance(part, Spring) and part.name == "knee_l")
    assert knee is not None
    assert knee.hinge == arm.skeleton.origins["shank_l"]


def test_what_cannot_be_placed_is_told() -> None:
    x, y = coordinate("x", "m", start=1.0), coordinate("y", "m")
    k, m = parameter("k", 1.0, "N/m"), parameter("m", 1.0, "kg")
    odd = Spring("odd", k, elongation=x * y)
    mechanism = Mechanism("odd", coordinates=[x, y], parameters=[k, m], bodies=[Body("b", m, (x, y))], springs=[odd])
    seen = layout_of(mechanism)
    assert attach(seen.skeleton, odd, {}) is None
    assert "Not drawn: spring odd, x*y." in draw(seen).notes


def test_loads_point_where_they_pull() -> None:
    x, y = coordinate("x", "m"), coordinate("y", "m", start=2.0)
    m, g, F = parameter("m", 1.0, "kg"), parameter("g", 9.81, "m/s2"), signal("F", "N")
    mechanism = Mechanism(
        "loaded",
        coordinates=[x, y],
        parameters=[m, g],
        inputs=[F],
        gravity=Gravity(g, (1, 0)),
        bodies=[Body("b", m, (x, y))],
        points=[Point("O", (0, 0))],
        loads=[Load("push", point="b", force=(0, -F))],
    )
    scene = draw(layout_of(mechanism))

    def way(part: str) -> np.ndarray:
        shaft = np.array(marks_of(scene, part)[0].points)
        return (shaft[1] - shaft[0]) / np.linalg.norm(shaft[1] - shaft[0])

    # gravity pulls along x, and is drawn downwards: y then points to the right
    np.testing.assert_allclose(way("gravity"), [0, -1], atol=1e-6)
    np.testing.assert_allclose(way("loads.push"), [-1, 0], atol=1e-3)


def test_bodies_at_one_place_are_drawn_side_by_side() -> None:
    scene = draw(layout("coupled_masses"))
    boxes = [np.array(marks_of(scene, f"bodies.body{i}")[0].points)[:, 0] for i in (1, 2, 3)]
    assert boxes[0].max() < boxes[1].min()
    assert boxes[1].max() < boxes[2].min()
    assert any("drawn apart" in note for note in scene.notes)


def test_a_body_stands_above_the_foot_on_which_it_hops() -> None:
    """The elongation y - z - l counts the body's way forward."""
    found = layout("hopper_leg")
    body, foot = (found.at_start[found.skeleton.place[name]] for name in ("body", "foot"))
    assert body[1] - foot[1] > GAP


def test_a_point_that_only_a_motion_moves_does_not_hide_what_stands_on_it() -> None:
    """A quarter car by displacements, whose road is a point: the body stands above the wheel."""
    zs, zu, road, k = coordinate("zs", "m"), coordinate("zu", "m"), signal("road", "m", motion=True), parameter("k", 1)
    car = Mechanism(
        "car",
        coordinates=[zs, zu],
        inputs=[road],
        parameters=[k],
        bodies=[Body("body", 3, (0, zs)), Body("wheel", 1, (0, zu))],
        points=[Point("patch", (0, road))],
        springs=[Spring("suspension", k, elongation=zs - zu), Spring("tyre", k, elongation=zu - road)],
    )
    found = layout_of(car)
    body, wheel = (found.at_start[found.skeleton.place[name]] for name in ("body", "wheel"))
    assert body[1] - wheel[1] >= GAP


def test_a_slack_rope_is_drawn_between_its_ends() -> None:
    found = layout("crane")
    place = found.skeleton.place
    assert [(part, set(ends)) for part, ends in found.ropes] == [("contacts.rope", {place["trolley"], place["load"]})]
    assert not layout("bouncing_ball").ropes


def test_the_arrow_of_a_motion_points_where_it_moves() -> None:
    arrow = marks_of(draw(layout("motion_driven_pendulum")), "coordinates.y0")
    across, up = np.ptp(np.vstack([mark.points for mark in arrow]), axis=0)
    assert up > 2 * across


def test_an_atwood_machine_hangs_on_its_ropes() -> None:
    """Ropes go straight up from the masses to the rims; the lower pulley hangs between the masses it carries."""
    scene = draw(layout("double_atwood"))
    rims = [m for m in scene.marks if isinstance(m, Disc) and (m.part, m.style) == ("pulleys", "shape")]
    ropes = [np.array(m.points) for m in scene.marks if m.style == "rope"]
    lower, fixed = sorted(rims, key=lambda disc: disc.center[1])
    assert np.hypot(*np.subtract(fixed.center, lower.center)) > fixed.radius + lower.radius
    assert all(rope[0, 0] == pytest.approx(rope[1, 0]) for rope in ropes)
    assert lower.center[0] == pytest.approx(fixed.center[0] + fixed.radius)
    x = {name: np.mean(np.array(marks_of(scene, f"bodies.{name}")[0].points)[:4, 0]) for name in BODIES}
    assert x["first"] == pytest.approx(fixed.center[0] - fixed.radius)
    assert lower.center[0] == pytest.approx((x["second"] + x["third"]) / 2)
    arrow = next(np.array(m.points) for m in scene.marks if m.part == "coordinates.x")
    assert arrow[-1, 1] < arrow[0, 1], "x grows downwards"
    assert hung({0: np.array([1.0]), 1: np.array([1.0])}) is None


def test_a_load_hangs_from_its_trolley() -> None:
    """Where the position of the load is written from the tower, the rope is drawn from what keeps its distance."""
    mechanism = read(TOWER, "tower.toml")
    found = layout_of(mechanism).skeleton
    ends = {link.part: link.ends for link in found.links}
    assert ends["load"] == (found.place["trolley"], found.place["load"])
    assert found.hinges["a"] == found.place["trolley"]
    assert found.stretches["l"] == ends["load"]


def test_a_sleeve_hangs_on_both_rods_of_its_governor() -> None:
    found = layout("governor").skeleton
    rods = {link.ends for link in found.links if link.part == "sleeve"}
    assert rods == {(found.place[weight], found.place["sleeve"]) for weight in ("weight1", "weight2")}


BODIES = ("first", "second", "third")
TOWER = """
[mechanism]
name = "tower"
[coordinates]
phi = { start = 0.3 }
s = { start = 12 }
a = { start = 0.2 }
[inputs]
l = { start = 8, motion = true }
[bodies.trolley]
mass = 1
position = ["s*cos(phi)", "s*sin(phi)", "20"]
[bodies.load]
mass = 1
position = ["(s + l*sin(a))*cos(phi)", "(s + l*sin(a))*sin(phi)", "20 - l*cos(a)"]
"""


def test_names_are_written_by_hand() -> None:
    assert [pretty(x) for x in ("theta_1", "theta12", "k*x**2", "push", "theta_F", "lambda")] == [
        *("θ₁", "θ₁₂", "k x²", "push", "θ_F", "λ")
    ]
