"""What is seen of a robot: the visuals of its links, on the frames that carry them, in the colors of the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lag2fmu import load
from lag2fmu.errors import LoadError
from lag2fmu.mechanism.record import Mechanism

URDF = """<robot name="arm">
<material name="steel"><color rgba="0.5 0.5 1 1"/></material>
<link name="base"><visual><geometry><box size="1 2 3"/></geometry><material name="steel"/></visual></link>
<link name="upper"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>
  <visual><geometry><cylinder radius="0.1" length="2"/></geometry></visual>
  <visual name="cover"><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/>
    <geometry><mesh filename="{file}" scale="1 1 2"/></geometry>
    <material name="own"><color rgba="1 0 0 1"/></material></visual></link>
<link name="tip"><visual><origin xyz="0 0 1"/><geometry><sphere radius="0.2"/></geometry></visual></link>
<joint name="q" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="weld" type="fixed"><parent link="upper"/><child link="tip"/>
  <origin xyz="0 3 0" rpy="0 1.5707963267948966 0"/></joint>
</robot>"""


def robot(folder: Path, file: str = "meshes/cover.stl") -> Mechanism:
    path = folder / "arm.urdf"
    path.write_text(URDF.replace("{file}", file), "utf-8")
    return load(path)


def test_visuals_of_a_urdf_file(tmp_path: Path) -> None:
    """Two visuals of one link have names of their own; a link on a fixed joint is seen where it is lumped."""
    visuals = {x.name: x for x in robot(tmp_path).visuals}
    assert list(visuals) == ["base", "upper", "cover", "tip"]
    base, upper, cover, tip = visuals.values()
    assert (base.frame, base.shape, base.color) == ("world", "box", "#8080ff")
    assert (upper.frame, [*map(float, upper.size or ())], upper.color) == ("upper", [0.1, 2.0], "")
    assert (cover.file, cover.color, cover.folder) == ("meshes/cover.stl", "#ff0000", tmp_path)
    assert [*map(float, cover.quaternion)] == pytest.approx([0.5**0.5, 0, 0, 0.5**0.5])
    assert tip.frame == "upper"
    assert [*map(float, tip.origin)] == pytest.approx([1, 3, 0])


def test_a_mesh_without_a_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(LoadError, match=r"arm.urdf, line 7, <mesh>: the attribute 'filename' is missing"):
        robot(tmp_path, "")


MJCF = """<mujoco><asset><mesh name="m" file="part.obj" scale="1 2 3"/><material name="red" rgba="1 0 0 1"/></asset>
<worldbody><geom type="plane" size="1 1 1"/>
<body name="arm" pos="0 0 1" euler="10 20 30"><joint name="q" axis="0 1 0"/>
  <geom name="cover" type="mesh" mesh="m" pos=".1 .2 .3" euler="40 50 60" material="red"/>
  <geom type="capsule" size=".1" fromto="0 0 0 1 0 0"/><geom type="box" size=".1 .2 .3" group="3"/>
  <geom type="box" size=".1 .2 .3" rgba="0 1 0 1"/>
</body></worldbody></mujoco>"""


def test_visuals_of_a_mjcf_file_are_where_mujoco_shows_them(tmp_path: Path) -> None:
    """MuJoCo moves a mesh to its principal axes; the vertices of the file are seen where its own are."""
    mujoco = pytest.importorskip("mujoco", reason="MJCF is optional: pip install lag2fmu[mujoco]")
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + ["f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4"]
    (tmp_path / "part.obj").write_text("\n".join(lines), "utf-8")
    path = tmp_path / "arm.xml"
    path.write_text(MJCF, "utf-8")
    cover, capsule, box = load(path).visuals
    assert (cover.file, cover.color, cover.frame) == ("part.obj", "#ff0000", "arm")
    assert [*map(float, capsule.size or ())] == pytest.approx([0.1, 1.0])
    assert ([*map(float, box.size or ())], box.color) == ([0.2, 0.4, 0.6], "#00ff00")
    model = mujoco.MjModel.from_xml_path(str(path))
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[1])
    theirs = model.mesh_vert @ turn.reshape(3, 3).T + model.geom_pos[1]
    mujoco.mju_quat2Mat(turn, np.array([*map(float, cover.quaternion)]))
    ours = (vertices * [*map(float, cover.size or ())]) @ turn.reshape(3, 3).T + [*map(float, cover.origin)]
    distances = np.linalg.norm(theirs[:, None] - ours[None], axis=2)
    assert distances.min(axis=1).max() < 1e-6  # MuJoCo keeps vertices in single precision
