"""Robots of the package example-robot-data at rest on their feet, their joints held by a PD law at 1 kHz."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import numpy as np
import pytest

from lag2fmu import export, load, simulate, start

pytestmark = pytest.mark.toolchain

ENDS = {"hyq_no_sensors.urdf": "{}{}_foot", "anymal.urdf": "{}{}_FOOT", "solo12.urdf": "{}{}_FOOT"}
"""{file: names of the feet}, by the letters of left, right, fore, hind."""
JOINTS = {
    "hyq_no_sensors.urdf": ("{}{}_haa_joint", "{}{}_hfe_joint", "{}{}_kfe_joint"),
    "anymal.urdf": ("{}{}_HAA", "{}{}_HFE", "{}{}_KFE"),
    "solo12.urdf": ("{}{}_HAA", "{}{}_HFE", "{}{}_KFE"),
}


def file_of(name: str) -> Path:
    """The file of a robot; skips without the package."""
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("the package example-robot-data is not installed; 'make test-all' does so")
    return next(Path(str(file.locate())) for file in files if file.name == name)


def legs(name: str) -> list[tuple[str, str, bool]]:
    """The two letters of each leg, and whether it is a hind one."""
    pairs = [(a, b) for a in "fh" for b in "lr"]
    if name == "hyq_no_sensors.urdf":
        return [(b, a, a == "h") for a, b in pairs]
    return [
        (a.upper(), b.upper(), a == "h") if name == "solo12.urdf" else (b.upper(), a.upper(), a == "h")
        for a, b in pairs
    ]


def pose_of(name: str) -> dict[str, float]:
    """Legs bent by 0.75 rad, hind ones the other way; those of hyq spread by 0.2 rad, on which it settles faster."""
    found, spread = {}, -0.2 if name == "hyq_no_sensors.urdf" else 0.0
    for a, b, hind in legs(name):
        for joint, angle in zip(JOINTS[name], (spread, -0.75 if hind else 0.75, 1.5 if hind else -1.5), strict=True):
            found[joint.format(a, b)] = angle
    return found


@pytest.mark.parametrize(
    ("name", "solver"),
    [
        ("hyq_no_sensors.urdf", "dopri5"),
        ("anymal.urdf", "moreau"),
        ("solo12.urdf", "moreau"),
    ],
)
def test_a_robot_stands_still_and_its_feet_bear_its_weight(name: str, solver: str, tmp_path: Path) -> None:
    """m g to 1e-9 after 10 s, and no creep; solo12 has 104 contacts, the corners of its feet."""
    path = file_of(name)
    pose = pose_of(name)
    feet = ",".join(ENDS[name].format(a, b) for a, b, _ in legs(name))
    robot = load(path, {"base": "floating", "ground": feet, "pose": pose})
    mass = sum(p.value for p in robot.parameters if p.name.startswith("mass_"))
    joints, rest = list(pose), np.array([*pose.values()])
    rates, torques = [f"{joint}_dot" for joint in joints], [f"Q_{joint}" for joint in joints]
    forces = [f"{contact.name}_force" for contact in robot.contacts]
    base = [q.name for q in robot.coordinates if q.name not in pose]
    stood = []
    with start(export(robot, tmp_path / "robot.fmu", solver=solver)) as sim:
        for k in range(10_000):
            if k >= 8000 and k % 500 == 0:
                stood.append(sim[base])
            torque = 10 * mass * (rest - sim[joints]) - 0.3 * mass * sim[rates]
            sim.step(1e-3, dict(zip(torques, torque, strict=True)))
        assert sim[forces].sum() == pytest.approx(mass * 9.81, rel=1e-9)
    assert np.ptp(stood, axis=0).max() < 1e-9


def test_feet_of_a_robot_that_folds_give_way_one_after_the_other(tmp_path: Path) -> None:
    """Two feet of A1 slip slowly when the third reaches its limit: the forces that decide are those of the motion."""
    feet = "FL_foot,FR_foot,RL_foot,RR_foot"
    fmu = export(load(file_of("a1.urdf"), {"base": "floating", "ground": feet}), tmp_path / "a1.fmu")
    coarse, fine = (simulate(fmu, stop_time=0.2, step=0.01, tolerance=tolerance) for tolerance in (1e-6, 1e-9))
    assert float(fine["base_z"][-1]) < 0.2  # it has come down from 0.34 m
    assert coarse.values == pytest.approx(fine.values, rel=1e-4, abs=1e-6)
