"""A model as MuJoCo compiled it: names, and what it holds that is not taken."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from lag2fmu.formats.identifiers import identifier
from lag2fmu.formats.robots.poses import Floats

ROOT = "world"
_LISTS = {
    "body": "body_mass",
    "joint": "jnt_type",
    "tendon": "tendon_num",
    "actuator": "actuator_trntype",
    "equality": "eq_type",
    "sensor": "sensor_type",
}
"""{kind of object: a list of a model with one row for each}."""


def turned(quaternion: Iterable[float]) -> Floats:
    """The matrix (3, 3) of a quaternion, its scalar part first."""
    w, *v = quaternion
    e = np.array(v)
    skew = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    matrix: Floats = np.eye(3) + 2 * w * skew + 2 * skew @ skew
    return matrix


class Compiled:
    """The ``model`` (mjModel) of the module ``mujoco``; ``ignored`` collects what nothing is made of."""

    def __init__(self, mujoco: Any, model: Any) -> None:
        self.mujoco, self.model = mujoco, model
        self.ignored: list[str] = []
        self._made: dict[tuple[str, int], str] = {}
        self._names: dict[str, set[str]] = {}

    def name(self, kind: str, index: int) -> str:
        """The name of an object of a ``kind`` of mjtObj, made up where it has none."""
        found = self.mujoco.mj_id2name(self.model, self._type(kind), index)
        if found:
            return str(found)
        if (kind, index) not in self._made:
            self._made[kind, index] = self.fresh(kind, f"{kind}_{index}")
        return self._made[kind, index]

    def fresh(self, kind: str, wanted: str) -> str:
        """The name ``wanted``, with underscores behind as long as an object of this ``kind`` would be called alike."""
        if kind not in self._names:
            count = len(getattr(self.model, _LISTS[kind]))
            named = (self.mujoco.mj_id2name(self.model, self._type(kind), k) for k in range(count))
            self._names[kind] = {identifier(str(name)) for name in named if name}
        while identifier(wanted) in self._names[kind]:
            wanted += "_"
        self._names[kind].add(identifier(wanted))
        return wanted

    def disabled(self, flag: str) -> bool:
        """Whether the model's <flag> disables what MuJoCo calls mjDSBL_``flag``; a flag it does not know does not."""
        return _disabled(self.mujoco, self.model, flag)

    def senses(self, kind: str, index: int) -> bool:
        """Whether a sensor that MuJoCo calls mjSENS_``kind`` belongs to the object ``index``."""
        m = self.model
        own = np.asarray(m.sensor_type) == int(getattr(self.mujoco.mjtSensor, f"mjSENS_{kind}"))
        return bool(np.any(own & (np.asarray(m.sensor_objid) == index)))

    def _type(self, kind: str) -> Any:
        return getattr(self.mujoco.mjtObj, f"mjOBJ_{kind.upper()}")

    def body(self, index: int) -> str:
        """The name of a body, of the world too."""
        return self.name("body", index) if index else ROOT

    def note(self, kinds: Mapping[str, Iterable[str]], rows: Mapping[str, int]) -> None:
        """Put a text of ``kinds`` {text: lists of the model} on ``ignored`` where one of its lists is not 0.

        ``rows`` {what the names of lists begin with: index}. Lists that an older MuJoCo does not have are 0.
        """
        for text, lists in kinds.items():
            held = (getattr(self.model, x)[rows[x.partition("_")[0]]] for x in lists if hasattr(self.model, x))
            if any(np.any(row) for row in held):
                self.ignored.append(text)


def disabled_taken_out(mujoco: Any, model: Any) -> None:
    """Set to 0 in ``model`` what its <flag> disables: gravity, springs, dampers, actuators, limits and so on."""
    lists = {
        "GRAVITY": (model.opt.gravity,),
        "SPRING": (model.jnt_stiffness, model.tendon_stiffness),
        "DAMPER": (model.dof_damping, model.tendon_damping),
        "LIMIT": (model.jnt_limited, model.tendon_limited),
        "FRICTIONLOSS": (model.dof_frictionloss, model.tendon_frictionloss),
        "EQUALITY": (model.eq_active0,),
        "CONTACT": (model.geom_contype, model.geom_conaffinity),
    }
    lists["CONSTRAINT"] = sum((lists[name] for name in ("LIMIT", "FRICTIONLOSS", "EQUALITY", "CONTACT")), ())
    for name, entries in lists.items():
        if _disabled(mujoco, model, name):
            for entry in entries:
                entry[:] = 0


def _disabled(mujoco: Any, model: Any, name: str) -> bool:
    flag = getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}", None)
    return flag is not None and bool(model.opt.disableflags & int(flag))
