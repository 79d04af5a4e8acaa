"""Touch sensors of MJCF: the normal forces in their zones, as MuJoCo tells them of a foot at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lag2fmu.formats.robots.measuring import _holds, _is_apart
from lag2fmu.formats.robots.parts import Touched
from lag2fmu.formats.robots.poses import JointPose
from lag2fmu.formats.robots.tree import Geom
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.direct_integration import integrate

MJCF = """<mujoco><worldbody><geom name="floor" type="plane" size="9 9 1" condim="1"/>
<body name="foot" pos="0 0 0.04"><joint name="z" type="slide" axis="0 0 1"/><joint name="turn" axis="0 1 0"/>
  <inertial pos="0.02 0 0.03" mass="2" diaginertia="1 1 1"/>
  <geom type="capsule" condim="1" size="0.04 0.125" euler="0 90 0" pos="0.045 0 0"/>
  <site name="toe" pos="0.17 0 0" size="0.05"/><site name="heel" pos="-0.08 0 0" size="0.05"/>
  <site name="all" type="box" pos="0.045 0 0" size="0.2 0.05 0.05"/><site name="part" pos="0.17 0 0" size="0.03"/>
</body></worldbody>
<sensor><touch name="at_toe" site="toe"/><touch name="at_heel" site="heel"/><touch name="whole" site="all"/>
  <touch name="some" site="part"/></sensor></mujoco>"""


def foot(folder: Path, **options: object) -> Mechanism:
    pytest.importorskip("mujoco", reason="MJCF is optional: pip install lag2fmu[mujoco]")
    from lag2fmu import load

    path = folder / "foot.xml"
    path.write_text(MJCF, "utf-8")
    return load(path, options)


def test_forces_in_the_zones_are_those_of_mujoco(tmp_path: Path) -> None:
    """The weight is shared by the lever: 0.15 m and 0.1 m. MuJoCo's contacts give way a little."""
    mechanism = foot(tmp_path, ground="all")
    run = integrate(mechanism, np.array([0.0, 0.1]))
    found = [run.trajectory[name][-1] for name in ("at_toe", "at_heel", "whole")]
    weight = 2 * 9.81
    assert found == pytest.approx([0.4 * weight, 0.6 * weight, weight], rel=1e-9)
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(tmp_path / "foot.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 5000)
    assert data.sensordata[:3] == pytest.approx(found, rel=2e-3)


def test_a_zone_that_is_smaller_than_what_touches_is_told(tmp_path: Path) -> None:
    assert "the sensor some: no ideal contact is always in its site" in foot(tmp_path, ground="all").not_taken


def test_compliant_contacts_tell_nothing(tmp_path: Path) -> None:
    mechanism = foot(tmp_path, ground="all", law="compliant")
    assert not {"at_toe", "at_heel", "whole"} & {x.name for x in mechanism.outputs}
    assert "the sensor whole: no ideal contact is always in its site" in mechanism.not_taken


def test_without_contacts_sensors_read_0_which_is_told(tmp_path: Path) -> None:
    mechanism = foot(tmp_path)
    assert (
        "the touch told by at_toe, at_heel, whole, some: it is 0, as no contact of their bodies is taken"
        in mechanism.not_taken
    )
    run = integrate(mechanism, np.array([0.0, 0.1]))
    assert all((run.trajectory[name] == 0).all() for name in ("at_toe", "at_heel", "whole", "some"))


def test_a_contact_that_is_left_out_is_in_no_sensor(tmp_path: Path) -> None:
    """The toe is below the floor at the start, and its contact left out; the heel's is as it was."""
    pytest.importorskip("mujoco", reason="MJCF is optional: pip install lag2fmu[mujoco]")
    from lag2fmu import load

    path = tmp_path / "foot.xml"
    path.write_text(MJCF.replace('"9 9 1"', '"9 9 1" euler="0 -1 0"'), "utf-8")
    mechanism = load(path, {"ground": "all"})
    assert [x for x in mechanism.not_taken if x.startswith("the contact")] != []
    assert [str(x.expression) for x in mechanism.outputs if x.name in ("at_toe", "at_heel")].count("0") == 1


@pytest.mark.parametrize(
    ("kind", "size", "holds"),
    [
        ("sphere", (0.3,), [True, False, False]),
        ("box", (0.5, 0.2, 0.2), [True, True, False]),
        ("capsule", (0.2, 0.3), [True, False, True]),
        ("cylinder", (0.2, 0.4), [True, False, True]),
        ("ellipsoid", (0.6, 0.3, 0.2), [True, True, False]),
    ],
)
def test_a_zone_holds_a_ball(kind: str, size: tuple[float, ...], holds: list[bool]) -> None:
    """Balls of 0.1 m about the middle, 0.3 m along x and 0.3 m along z, seen from a frame that is turned about y."""
    turned = JointPose(np.array([1.0, 2.0, 3.0]), (("y", 0.7),))
    zone = Geom("zone", "link", kind, turned, size)
    places = ([0.0, 0, 0], [0.3, 0, 0], [0, 0, 0.3])
    balls = [Touched("c", turned.origin + turned.matrix @ np.array(x), 0.1, "floor") for x in places]
    assert [_holds(zone, ball) for ball in balls] == holds


def test_a_ball_is_apart_only_if_no_pose_above_the_plane_lets_the_ray_meet_the_zone() -> None:
    """Against random poses of two balls that stand on a plane: the zone is a ball about the second one."""
    generator = np.random.default_rng(3)
    for _ in range(300):
        distance, r, big, more = generator.uniform((0.05, 0.02, 0.02, 0.0), (0.4, 0.1, 0.1, 0.2))
        zone = Geom("zone", "link", "sphere", JointPose(np.array([distance, 0.0, 0.0])), (big + more,))
        balls = (Touched("c", np.zeros(3), r, "floor"), Touched("d", np.array([distance, 0, 0]), big, "floor"))
        rise = np.linspace(-np.pi / 2, np.pi / 2, 2001)
        centre = distance * np.column_stack((np.cos(rise), np.sin(rise)))  # of the zone, from the ball that rests
        centre = centre[centre[:, 1] >= big - r]
        below = -np.hypot(0.0, r)  # the ray begins at the plane and goes down
        reach = (big + more) ** 2 - centre[:, 0] ** 2
        met = (reach >= 0) & (centre[:, 1] - np.sqrt(np.maximum(reach, 0.0)) <= below)
        assert not (_is_apart(zone, *balls) and met.any())
