"""Joints in the plane against closed forms; what they bear, in N and N.m."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sympy import cos, sin

import lag2fmu
from lag2fmu.errors import MechanismError
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.mechanism import Body, Joint, Mechanism, Point, coordinate
from lag2fmu.reference import Trajectory

G = 9.81


def free(name: str, x: float, y: float, angle: float, rates: tuple[float, float, float] = (0, 0, 0)) -> list:
    """x, y and angle, all of them guesses."""
    rows = zip(("x", "y", "angle"), ("m", "m", "rad"), (x, y, angle), rates, strict=True)
    return [coordinate(f"{name}_{k}", unit, guess=value, guess_velocity=rate) for k, unit, value, rate in rows]


def run(mechanism: Mechanism, stop: float) -> Trajectory:
    assert read(write(mechanism), "text") == mechanism
    return lag2fmu.simulate(mechanism, stop_time=stop, step=stop / 20, tolerance=1e-10)


@pytest.mark.fmu
def test_a_slider_on_a_slope_bears_its_weight_across_it() -> None:
    """s'' = -g sin(tilt); the guide bears m g cos(tilt); the same with the tilt in the axis and in an angle."""
    m, tilt, arm = 2.0, 0.4, 0.3
    x, y, angle = free("block", 0.5 * np.cos(tilt) - arm * np.sin(tilt), 0.5 * np.sin(tilt) + arm * np.cos(tilt), tilt)
    shoe = Point("shoe", (x + arm * sin(angle), y - arm * cos(angle)), angle=angle)
    guide = Joint(
        "guide", "prismatic", ("world", "shoe"), axis=(float(np.cos(tilt)), float(np.sin(tilt)), 0), reactions=True
    )
    level = Point("rail", (0, 0), angle=tilt)
    for joint, points in (
        (guide, [Point("shoe", shoe.position, angle=angle - tilt)]),
        (Joint("guide", "prismatic", ("rail", "shoe"), axis="x", reactions=True, axes="frame"), [shoe, level]),
    ):
        block = Body("block", m, (x, y), angle=angle, inertia=0.1)
        sliding = Mechanism(
            "slope", coordinates=[x, y, angle], bodies=[block], points=points, gravity=G, joints=[joint]
        )
        found = run(sliding, 1.0)
        way = 0.5 - G * np.sin(tilt) * found.time**2 / 2
        assert found["block_x"] == pytest.approx(way * np.cos(tilt) - arm * np.sin(tilt), abs=1e-9)
        assert found["block_angle"] == pytest.approx(np.full(21, tilt), abs=1e-10)
        along, across = (0, 1) if joint.axes == "frame" else (-np.sin(tilt), np.cos(tilt))
        assert found["guide_force_x"] == pytest.approx(np.full(21, m * G * np.cos(tilt) * along), abs=1e-7)
        assert found["guide_force_y"] == pytest.approx(np.full(21, m * G * np.cos(tilt) * across), abs=1e-7)
        # the shoe is below the centre, seen across the slope
        assert found["guide_torque_z"] == pytest.approx(np.zeros(21), abs=1e-7)
        assert "guide_torque_x" not in found.names


@pytest.mark.fmu
def test_a_particle_in_a_turning_slot() -> None:
    """r'' = w^2 r in a slot that turns with w, kept by a large inertia; it pushes with 2 m w r'."""
    m, w = 1.5, 2.0
    phi = coordinate("phi", "rad", start=0.3, velocity=w)
    x = coordinate("x", "m", start=float(0.2 * np.cos(0.3)), velocity=float(-0.2 * w * np.sin(0.3)))
    y = coordinate("y", "m", guess=0.05)
    slot = Mechanism(
        "slot",
        coordinates=[phi, x, y],
        bodies=[Body("wheel", 1, (0, 0), angle=phi, inertia=1e9), Body("bead", m, (x, y))],
        joints=[Joint("slot", "prismatic", ("wheel", "bead"), axis="x", reactions=True, axes="frame")],
    )
    assert [c.name for c in slot.constraints] == ["slot_across_1"]
    found = run(slot, 1.0)
    r = 0.2 * np.cosh(w * found.time)
    assert np.hypot(found["x"], found["y"]) == pytest.approx(r, abs=1e-8)
    push = 2 * m * w * 0.2 * w * np.sinh(w * found.time)
    assert found["slot_force_y"] == pytest.approx(push, abs=1e-6)
    assert found["slot_force_x"] == pytest.approx(np.zeros(21), abs=1e-9)


@pytest.mark.fmu
def test_a_body_fixed_to_another_bears_what_it_weighs() -> None:
    """A pendulum of two bodies in one; the clamp bears the second one's weight and makes it turn."""
    l, m, I = 0.6, 1.2, 0.03  # noqa: E741
    q = coordinate("q", "rad", start=0.8)
    x, y, angle = free("tip", l * np.sin(0.8), -l * np.cos(0.8), 0.8)
    rod = Body("rod", m, (l / 2 * sin(q), -l / 2 * cos(q)), angle=q, inertia=m * l**2 / 12)
    end = Point("end", (l * sin(q), -l * cos(q)), angle=q)
    clamped = Mechanism(
        "clamped",
        coordinates=[q, x, y, angle],
        bodies=[rod, Body("tip", m, (x, y), angle=angle, inertia=I)],
        points=[end],
        gravity=G,
        joints=[Joint("clamp", "fixed", ("end", "tip"), reactions=True)],
    )
    found = run(clamped, 1.5)
    J, weight = m * l**2 / 3 + m * l**2 + I, 1.5 * m * G * l
    rates = lambda t, z: [z[1], -weight / J * np.sin(z[0])]  # noqa: E731
    truth, rate = solve_ivp(rates, (0, 1.5), [0.8, 0], "DOP853", found.time, rtol=1e-12, atol=1e-12).y
    turning = -weight / J * np.sin(truth)
    assert found["tip_angle"] == pytest.approx(truth, abs=1e-8)
    assert found["clamp_torque_z"] == pytest.approx(I * turning, abs=1e-6)
    up = m * (G + l * (np.sin(truth) * turning + np.cos(truth) * rate**2))
    assert found["clamp_force_y"] == pytest.approx(up, abs=1e-6)


@pytest.mark.fmu
@pytest.mark.parametrize("written_on_it", [True, False])
def test_a_disc_rolls_down_a_slope(written_on_it: bool) -> None:
    """s'' = g sin(tilt) / (1 + I/(m r^2)); friction I s''/r^2; also with the centre written on its line."""
    m, r, I, tilt = 2.0, 0.3, 0.05, 0.5  # noqa: E741
    along, normal = np.array([np.cos(tilt), np.sin(tilt)]), np.array([-np.sin(tilt), np.cos(tilt)])
    start = along + r * normal
    if written_on_it:
        s, turn = coordinate("s", "m", start=1.0), coordinate("turn", "rad", start=0.0)
        q, place = [s, turn], tuple(s * float(a) + r * float(n) for a, n in zip(along, normal, strict=True))
        slope = Point("slope", (0, 0), angle=0)
    else:
        x, y, turn = free("disc", *start, 0.0)
        q, place, slope = [x, y, turn], (x, y), Point("slope", (0, 0), angle=0)
    rolling = Mechanism(
        "rolling",
        coordinates=q,
        bodies=[Body("disc", m, place, angle=turn, inertia=I)],
        points=[slope],
        gravity=G,
        joints=[
            Joint(
                "contact",
                "rolling_disc",
                ("slope", "disc"),
                axis=(*map(float, normal), 0),
                radius=r,
                reactions=not written_on_it,
            )
        ],
    )
    assert [c.name for c in rolling.constraints][-1] == "contact_slip_1"
    assert len(rolling.constraints) == (1 if written_on_it else 2)
    found = run(rolling, 1.0)
    fall = G * np.sin(tilt) / (1 + I / (m * r**2))
    angle = found["turn"] if written_on_it else found["disc_angle"]
    assert angle == pytest.approx(fall * found.time**2 / 2 / r, abs=1e-8)  # downhill is to the left
    if not written_on_it:
        friction, bears = I * fall / r**2, m * G * np.cos(tilt)
        force = bears * normal + friction * along
        assert found["contact_force_x"] == pytest.approx(np.full(21, force[0]), abs=1e-7)
        assert found["contact_force_y"] == pytest.approx(np.full(21, force[1]), abs=1e-7)


def test_a_gear_joins_the_angles_of_planar_wheels() -> None:
    a, b = coordinate("a", "rad", start=0.2, velocity=1.0), coordinate("b", "rad")
    wheels = [Body("one", 1, (0, 0), angle=a, inertia=1), Body("other", 1, (1, 0), angle=b, inertia=1)]
    geared = Mechanism("geared", coordinates=[a, b], bodies=wheels, joints=[Joint("g", "gear", ("a", "b"), ratio=-3)])
    assert str(geared.constraints[0].expression) == "a + 3*b"


@pytest.mark.parametrize(
    ("joint", "sentence"),
    [
        ({"kind": "spherical"}, "'spherical' joins frames, .* in the plane there are revolute, prismatic"),
        ({"kind": "prismatic", "axis": "z"}, "joints.j.axis: 'z' is out of the plane; give 'x', 'y' or"),
        ({"kind": "prismatic", "axis": "x", "between": ("place", "disc")}, "'place' has no 'angle', .* 0 if it"),
        ({"kind": "prismatic", "axis": "x", "between": ("dot", "disc")}, "'dot' has no 'angle', .* with an inertia"),
        ({"kind": "rolling_disc", "axis": "y", "radius": 1, "between": ("world", "dot")}, "'dot' has no 'angle'"),
        ({"kind": "rolling_disc", "axis": "y", "radius": 1, "second_axis": "z"}, "a disc turns about z; leave it out"),
        ({"kind": "rolling_disc", "axis": "y", "radius": -1}, "joints.j.radius: '-1' is -1.0; give a positive length"),
        ({"kind": "fixed", "between": ("disc", "disc")}, "'disc' and 'disc' are the same"),
        ({"kind": "fixed", "between": ("disc", "twin")}, "'disc' and 'twin' are both on 'world'"),
    ],
)  # fmt: skip
def test_what_does_not_fit_in_the_plane(joint: dict, sentence: str) -> None:
    x, y, q = coordinate("x", "m"), coordinate("y", "m"), coordinate("q", "rad")
    places = [Point("place", (0, 1)), Point("twin", (x, 0), angle=q)]
    bodies = [Body("disc", 1, (x, 0), angle=q, inertia=1), Body("dot", 1, (0, y))]
    with pytest.raises(MechanismError, match=sentence):
        Mechanism(
            "odd",
            coordinates=[x, y, q],
            bodies=bodies,
            points=places,
            joints=[Joint("j", **{"between": ("world", "disc"), **joint})],
        )
    with pytest.raises(MechanismError, match=r"points.p.angle: goes with a position of 2 entries"):
        Mechanism("odd", coordinates=[x], points=[Point("p", (x, 0, 0), angle=0)], bodies=[Body("b", 1, (x, 0, 0))])
