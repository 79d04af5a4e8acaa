"""Sensors of a model that MuJoCo compiled: what is told by coordinates, places and frames, and by sums over bodies."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from lag2fmu.formats.robots.compiled import Compiled, turned
from lag2fmu.formats.robots.mjcf_forces import tendon_of
from lag2fmu.formats.robots.poses import JointPose
from lag2fmu.formats.robots.tree import Geom, Sensor

_SLIDE = 2  # mjtJoint; the kinds below have several coordinates

_ALONG = {
    **{"JOINTPOS": "length", "JOINTVEL": "rate", "TENDONPOS": "length", "TENDONVEL": "rate"},
    "JOINTACTFRC": "force",
}
_DRIVEN = {"ACTUATORPOS": "length", "ACTUATORVEL": "rate", "ACTUATORFRC": "force"}
_PLACED = {
    "GYRO": ("angular_velocity", "frame"),
    "VELOCIMETER": ("origin_velocity", "frame"),
    "ACCELEROMETER": ("specific_force", "frame"),
    "FRAMEPOS": ("position", "world"),
    "FRAMEQUAT": ("quaternion", "world"),
    **{f"FRAME{axis.upper()}AXIS": (f"{axis}_axis", "world") for axis in "xyz"},
    "FRAMELINVEL": ("origin_velocity", "world"),
    "FRAMEANGVEL": ("angular_velocity", "world"),
    "FRAMELINACC": ("specific_force", "world"),
    "FRAMEANGACC": ("angular_acceleration", "world"),
}
"""{what MuJoCo calls mjSENS_...: the quantity of an output, and its axes}; MuJoCo's linear accelerations are specific
forces, too."""

_SUMMED = {"SUBTREECOM": "mass_centre", "SUBTREELINVEL": "mass_centre_velocity", "SUBTREEANGMOM": "angular_momentum"}
_HELD = {"FORCE": "holding_force", "TORQUE": "holding_torque"}
_TOUCH = "TOUCH"
_ZONES = {2: ("sphere", 1), 3: ("capsule", 2), 4: ("ellipsoid", 3), 5: ("cylinder", 2), 6: ("box", 3)}  # mjtGeom


def sensors(compiled: Compiled) -> Iterator[Sensor]:
    """The sensors that become outputs; the others, and what cuts a value off, are noted as ignored."""
    m = compiled.model
    words = (*_ALONG, *_DRIVEN, *_PLACED, *_SUMMED, *_HELD, _TOUCH)
    kinds = {int(getattr(compiled.mujoco.mjtSensor, f"mjSENS_{word}")): word for word in words}
    for k in range(m.nsensor):
        name, word = compiled.name("sensor", k), kinds.get(int(m.sensor_type[k]), "")
        found = _sensor(compiled, k, name, word)
        if found is None:
            kind = compiled.mujoco.mjtSensor(int(m.sensor_type[k])).name.removeprefix("mjSENS_").lower()
            compiled.ignored.append(f"the sensor {name}: {kind}{' there' if word else ''} has no output")
            continue
        compiled.note({f"the cutoff of the sensor {name}": ("sensor_cutoff",)}, {"sensor": k})
        yield found


def _sensor(compiled: Compiled, k: int, name: str, word: str) -> Sensor | None:
    """Sensor ``k``, which MuJoCo calls mjSENS_``word``; None where nothing is made of it."""
    m, target = compiled.model, int(compiled.model.sensor_objid[k])
    if word in _ALONG:
        return _along(compiled, target, name, word)
    if word in _DRIVEN:
        return Sensor(name, _DRIVEN[word], actuator=compiled.name("actuator", target))
    if word in _SUMMED:
        return Sensor(name, _SUMMED[word], subtree=compiled.body(target))
    if word == _TOUCH:
        return _touch(compiled, target, name)
    place = _POSES.get(_object(compiled, k)) if word in (*_PLACED, *_HELD) and m.sensor_refid[k] < 0 else None
    if place is None:
        return None
    body, origin, quaternion = place(m, target)
    link, pose = compiled.body(body), JointPose.of(origin.copy(), turned(quaternion))
    if word in _HELD:
        return Sensor(name, _HELD[word], place=(link, pose), axes="frame", subtree=link)
    quantity, axes = _PLACED[word]
    return Sensor(name, quantity, place=(link, pose), axes=axes)


def _along(compiled: Compiled, target: int, name: str, word: str) -> Sensor | None:
    """A sensor of a joint that has one coordinate, or of a tendon that is taken; None of others."""
    if word.startswith("TENDON"):
        length = tendon_of(compiled, target)
        return None if length is None else Sensor(name, _ALONG[word], length)
    single = compiled.model.jnt_type[target] >= _SLIDE
    return Sensor(name, _ALONG[word], ((compiled.name("joint", target), 1.0),)) if single else None


def _touch(compiled: Compiled, site: int, name: str) -> Sensor:
    """A sensor of what touches in a ``site``."""
    m, (body, origin, quaternion) = compiled.model, _POSES["SITE"](compiled.model, site)
    kind, count = _ZONES[int(m.site_type[site])]
    size, pose = tuple(map(float, m.site_size[site][:count])), JointPose.of(origin.copy(), turned(quaternion))
    return Sensor(name, "touch", zone=Geom(name, compiled.body(body), kind, pose, size))


def _object(compiled: Compiled, k: int) -> str:
    """The kind of what sensor ``k`` is on, in MuJoCo's words."""
    return str(compiled.mujoco.mjtObj(int(compiled.model.sensor_objtype[k])).name).removeprefix("mjOBJ_")


_UNIT = (1.0, 0.0, 0.0, 0.0)
"""The quaternion without a turn."""
_POSES: dict[str, Callable[[Any, int], tuple[int, Any, Any]]] = {
    "BODY": lambda m, i: (i, m.body_ipos[i], m.body_iquat[i]),
    "XBODY": lambda m, i: (i, 0 * m.body_ipos[i], _UNIT),
    "GEOM": lambda m, i: (int(m.geom_bodyid[i]), m.geom_pos[i], m.geom_quat[i]),
    "SITE": lambda m, i: (int(m.site_bodyid[i]), m.site_pos[i], m.site_quat[i]),
    "CAMERA": lambda m, i: (int(m.cam_bodyid[i]), m.cam_pos[i], m.cam_quat[i]),
}
"""{kind of object: (its body, its place and quaternion there) of a model and an index}."""
