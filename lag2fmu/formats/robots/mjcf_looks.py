"""What is seen in a model that MuJoCo compiled: the geoms that its viewer shows unless it is asked for more.

Planes and height fields are left out. MuJoCo moves meshes to their principal axes; a file is seen where it was.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.description.visuals import name_from
from lag2fmu.formats.robots.compiled import Compiled, turned
from lag2fmu.formats.robots.poses import Floats, JointPose
from lag2fmu.formats.robots.tree import Look

_KINDS = {2: "sphere", 3: "capsule", 4: "ellipsoid", 5: "cylinder", 6: "box", 7: "mesh"}  # mjtGeom
_SIZES = {"sphere": [1.0], "capsule": [1.0, 2.0], "ellipsoid": [1.0] * 3, "cylinder": [1.0, 2.0], "box": [2.0] * 3}
"""{kind: factors by which its size in MuJoCo, which has halves of lengths, becomes that of a Look}."""
_HIDDEN = 3
"""The groups of geoms that are not shown begin here."""


def looks(compiled: Compiled, folder: Path) -> Iterator[Look]:
    """All that is seen; meshes of files are named from ``folder`` on, so that no name tells where a user keeps them."""
    m, name_of = compiled.model, compiled.mujoco.mj_id2name
    for geom in map(int, np.flatnonzero(m.geom_group < _HIDDEN)):
        kind, body = _KINDS.get(int(m.geom_type[geom]), ""), compiled.body(int(m.geom_bodyid[geom]))
        name = name_of(m, compiled.mujoco.mjtObj.mjOBJ_GEOM, geom) or f"{body}_{kind}"
        pose, color = JointPose.of(m.geom_pos[geom].copy(), turned(m.geom_quat[geom])), _color(m, geom)
        if kind in _SIZES:
            factors = _SIZES[kind]
            size = tuple(float(x) * by for x, by in zip(m.geom_size[geom], factors, strict=False))
            yield Look(name, body, kind, pose, size, color=color)
        elif kind and (file := _file(m, int(m.geom_dataid[geom]), folder)):
            mesh = int(m.geom_dataid[geom])
            back = turned(m.mesh_quat[mesh]).T
            turn = pose.matrix @ back
            place = JointPose.of(pose.origin - turn @ m.mesh_pos[mesh], turn)
            yield Look(name, body, kind, place, tuple(map(float, m.mesh_scale[mesh])), file, color)


def _color(m: Any, geom: int) -> str:
    """The color of the material of a ``geom``, or its own."""
    material = int(m.geom_matid[geom])
    rgba: Floats = m.mat_rgba[material] if material >= 0 else m.geom_rgba[geom]
    return "#" + "".join(f"{round(255 * min(max(float(x), 0.0), 1.0)):02x}" for x in rgba[:3])


def _file(m: Any, mesh: int, folder: Path) -> str:
    """The name of the file of a ``mesh`` from ``folder`` on, "" where it is made of vertices."""
    begin = int(m.mesh_pathadr[mesh])
    if begin < 0:
        return ""
    return name_from(Path(m.paths[begin : m.paths.index(b"\0", begin)].decode()), folder)
