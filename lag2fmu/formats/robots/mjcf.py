"""Reading MJCF, the XML of MuJoCo (https://mujoco.readthedocs.io/en/stable/XMLreference.html), by MuJoCo itself.

Taken is what MuJoCo compiled: bodies with their inertia, joints, what acts on them, actuators without states of their
own, fixed tendons, and the equalities connect, weld and joint, which are exact here. The package mujoco is optional.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.tree import (
    Actuator,
    Closure,
    Coupling,
    Floats,
    Inertia,
    Joint,
    Pose,
    Robot,
    Sum,
    Tendon,
)
from lag2fmu.xml_tree import parse

_FREE, _BALL, _SLIDE, _HINGE = range(4)  # mjtJoint
_ROOT = "world"
_NAMELESS = ("", "MuJoCo Model")
_MOST_BYTES = 64 << 20
_READ = ("body_", "jnt_", "dof_", "tendon_", "actuator_", "eq_", "qpos")
"""What the names of the lists begin with that are read."""


def read_mjcf(path: Path) -> Robot:
    """The robot in the file ``path``; raises LoadError with the reason, and where the package mujoco is missing."""
    try:
        import mujoco
    except ImportError as error:
        raise LoadError(f"{path}: reading MJCF needs the package mujoco; pip install 'lag2fmu[mujoco]'") from error
    try:
        content = path.read_bytes()
    except OSError as error:
        raise LoadError(f"{path}: cannot be read: {error.strerror}") from error
    if len(content) > _MOST_BYTES:
        raise LoadError(f"{path}: has {len(content)} bytes; a robot of more than {_MOST_BYTES} is not read")
    tag = parse(content, str(path)).root.tag
    if tag != "mujoco":
        raise LoadError(f"{path}: its top element is <{tag}>; a MJCF file has <mujoco>, a URDF file ends in .urdf")
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise LoadError(f"{path}: MuJoCo refuses it: {' '.join(str(error).split())}") from error
    _check_finite(model, path)
    return _Reader(mujoco, model, path).robot()


def _check_finite(model: Any, path: Path) -> None:
    """Raise LoadError for a number that MuJoCo took although it is none, with MuJoCo's name of the list it is in."""
    numbers = {name: getattr(model, name) for name in dir(model) if name.startswith(_READ)}
    numbers["gravity"] = model.opt.gravity
    for name, values in numbers.items():
        if isinstance(values, np.ndarray) and values.dtype.kind == "f" and not np.isfinite(values).all():
            raise LoadError(f"{path}: a number in {name} is not finite; correct it in the file")


def _turned(quaternion: Iterable[float]) -> Floats:
    """The matrix (3, 3) of a quaternion, its scalar part first."""
    w, *v = quaternion
    e = np.array(v)
    skew = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    matrix: Floats = np.eye(3) + 2 * w * skew + 2 * skew @ skew
    return matrix


class _Reader:
    """What a compiled model holds, as a robot."""

    def __init__(self, mujoco: Any, model: Any, path: Path) -> None:
        self._mujoco, self._m, self._path = mujoco, model, path
        self._ignored: list[str] = []

    def robot(self) -> Robot:
        m = self._m
        links: dict[str, Inertia | None] = {_ROOT: None}
        joints: list[Joint] = []
        for body in range(1, m.nbody):
            for joint in self._joints_of(body):
                joints.append(joint)
                links[joint.child] = None
            links[self._body(body)] = self._inertia(body)
        actuators, tendons = tuple(self._actuators()), tuple(self._tendons())
        closures, couplings = self._equalities()
        self._list_ignored()
        x, y, z = m.opt.gravity
        name = m.names.split(b"\0", 1)[0].decode()
        return Robot(
            self._path.stem if name in _NAMELESS else name,
            _ROOT,
            links,
            _started(joints, couplings),
            tuple(self._ignored),
            (float(x), float(y), float(z)),
            actuators,
            tendons,
            closures,
            couplings,
        )

    def _name(self, kind: str, index: int) -> str:
        found = self._mujoco.mj_id2name(self._m, getattr(self._mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), index)
        return str(found) if found else f"{kind}_{index}"

    def _body(self, index: int) -> str:
        return self._name("body", index) if index else _ROOT

    def _inertia(self, body: int) -> Inertia | None:
        m, turn = self._m, _turned(self._m.body_iquat[body])
        mass, principal = float(m.body_mass[body]), m.body_inertia[body]
        if not mass and not principal.any():
            return None
        return Inertia(mass, m.body_ipos[body].copy(), turn @ np.diag(principal) @ turn.T)

    # ------------------------------------------------------------------------------------------------------ joints

    def _joints_of(self, body: int) -> Iterator[Joint]:
        """The joints of a body one after the other, with links of their own between them, and a last fixed one.

        Joint k turns about its anchor a_k in the axes of the body as the joints before left them.
        """
        m, name = self._m, self._body(body)
        link, pose = self._body(m.body_parentid[body]), Pose.of(m.body_pos[body].copy(), _turned(m.body_quat[body]))
        first, count = m.body_jntadr[body], m.body_jntnum[body]
        for k in range(first, first + count):
            free, anchor = m.jnt_type[k] == _FREE, m.jnt_pos[k].copy()
            place = Pose(np.zeros(3)) if free else Pose(pose.origin + pose.matrix @ anchor, pose.turns)
            last = k == first + count - 1 and (free or not anchor.any())
            child = name if last else f"{name}_at_{self._name('joint', k)}"
            yield self._joint(k, link, child, place)
            link, pose = child, Pose(np.zeros(3) if free else -anchor)
            if last:
                return
        yield Joint(f"fixed_{name}", "fixed", link, name, pose, np.array([1.0, 0.0, 0.0]))

    def _joint(self, k: int, parent: str, child: str, pose: Pose) -> Joint:
        m, kind = self._m, int(self._m.jnt_type[k])
        name, at, dof = self._name("joint", k), int(m.jnt_qposadr[k]), int(m.jnt_dofadr[k])
        axis = m.jnt_axis[k] / np.linalg.norm(m.jnt_axis[k])
        if kind in (_FREE, _BALL):
            if m.jnt_stiffness[k] or m.dof_damping[dof] or m.dof_armature[dof] or m.dof_frictionloss[dof]:
                self._ignored.append(f"stiffness, damping, armature and friction loss of the joint {name}")
            start = tuple(map(float, m.qpos0[at : at + (7 if kind == _FREE else 4)]))
            return Joint(name, "floating" if kind == _FREE else "spherical", parent, child, pose, axis, start=start)
        limited = bool(m.jnt_limited[k])
        return Joint(
            name,
            "revolute" if kind == _HINGE else "prismatic",
            parent,
            child,
            pose,
            axis,
            float(m.jnt_range[k][0]) if limited else None,
            float(m.jnt_range[k][1]) if limited else None,
            float(m.dof_damping[dof]),
            float(m.dof_frictionloss[dof]),
            start=(float(m.qpos0[at]),),
            reference=float(m.qpos0[at]),
            stiffness=float(np.ravel(m.jnt_stiffness[k])[0]),
            rest=float(m.qpos_spring[at]),
            armature=float(m.dof_armature[dof]),
        )

    # ------------------------------------------------------------------------------------------ actuators, tendons

    def _actuators(self) -> Iterator[Actuator]:
        """Those that are a force on coordinates, affine in the control, the length and its rate."""
        m, own = self._m, self._mujoco
        for k in range(m.nu):
            name = self._name("actuator", k)
            length = self._length(int(m.actuator_trntype[k]), int(m.actuator_trnid[k][0]), float(m.actuator_gear[k][0]))
            fixed = m.actuator_gaintype[k] == own.mjtGain.mjGAIN_FIXED
            affine = m.actuator_biastype[k] == own.mjtBias.mjBIAS_AFFINE
            plain = affine or m.actuator_biastype[k] == own.mjtBias.mjBIAS_NONE
            if length is None or not (fixed and plain and m.actuator_dyntype[k] == own.mjtDyn.mjDYN_NONE):
                self._ignored.append(f"the actuator {name}")
                continue
            b0, b1, b2 = (float(x) if affine else 0.0 for x in m.actuator_biasprm[k][:3])
            low, high = map(float, m.actuator_ctrlrange[k])
            limits = (low, high) if m.actuator_ctrllimited[k] else (None, None)
            yield Actuator(name, length, float(m.actuator_gainprm[k][0]), (b0, b1, b2), *limits)

    def _length(self, kind: int, target: int, gear: float) -> Sum | None:
        """The length of a transmission of joints that have one coordinate; None for others."""
        transmission = self._mujoco.mjtTrn
        if kind == transmission.mjTRN_TENDON:
            sums = self._tendon(target)
            return None if sums is None else tuple((joint, gear * factor) for joint, factor in sums)
        if kind not in (transmission.mjTRN_JOINT, transmission.mjTRN_JOINTINPARENT):
            return None
        return ((self._name("joint", target), gear),) if self._m.jnt_type[target] in (_SLIDE, _HINGE) else None

    def _tendon(self, index: int) -> Sum | None:
        """The joints of a fixed tendon with their factors; None for a spatial one."""
        m, first = self._m, self._m.tendon_adr[index]
        wraps = range(first, first + m.tendon_num[index])
        if any(m.wrap_type[w] != self._mujoco.mjtWrap.mjWRAP_JOINT for w in wraps):
            return None
        return tuple((self._name("joint", int(m.wrap_objid[w])), float(m.wrap_prm[w])) for w in wraps)

    def _tendons(self) -> Iterator[Tendon]:
        m = self._m
        for k in range(m.ntendon):
            name, length = self._name("tendon", k), self._tendon(k)
            stiffness, damping = float(np.ravel(m.tendon_stiffness[k])[0]), float(np.ravel(m.tendon_damping[k])[0])
            low, high = map(float, m.tendon_lengthspring[k])
            if length is None or low != high:
                if stiffness or damping:
                    self._ignored.append(f"the tendon {name}")
                continue
            if stiffness or damping:
                yield Tendon(name, length, stiffness, low, damping)
            if m.tendon_limited[k] or m.tendon_frictionloss[k]:
                self._ignored.append(f"limits and friction loss of the tendon {name}")

    # -------------------------------------------------------------------------------------------------- equalities

    def _equalities(self) -> tuple[tuple[Closure, ...], tuple[Coupling, ...]]:
        """The active ones of the kinds connect, weld and joint."""
        m, kinds, objects = self._m, self._mujoco.mjtEq, self._mujoco.mjtObj
        closures, couplings = [], []
        for k in (k for k in range(m.neq) if m.eq_active0[k]):
            name, kind, data = self._name("equality", k), int(m.eq_type[k]), m.eq_data[k]
            first, second = int(m.eq_obj1id[k]), int(m.eq_obj2id[k])
            if kind == kinds.mjEQ_JOINT:
                couplings.append(self._coupling(name, first, second, data))
            elif kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD) and int(m.eq_objtype[k]) == objects.mjOBJ_BODY:
                ends = (self._body(first), self._body(second))
                closures.append(_closure(name, ends, data, weld=bool(kind == kinds.mjEQ_WELD)))
            else:
                self._ignored.append(f"the equality {name}")
        return tuple(closures), tuple(couplings)

    def _coupling(self, name: str, first: int, second: int, data: Floats) -> Coupling:
        m = self._m

        def end(joint: int) -> tuple[str, float]:
            return self._name("joint", joint), float(m.qpos0[m.jnt_qposadr[joint]])

        return Coupling(name, end(first), end(second) if second >= 0 else None, tuple(map(float, data[:5])))

    def _list_ignored(self) -> None:
        """Note what is in the model besides and would act on the motion."""
        m = self._m
        touching = int(np.count_nonzero((m.geom_contype != 0) | (m.geom_conaffinity != 0)))
        kinds = {
            f"contacts of {touching} geoms": touching > 1,
            "the medium (density, viscosity, wind)": m.opt.density or m.opt.viscosity or m.opt.wind.any(),
            "compensation of gravity": np.any(m.body_gravcomp),
            "plugins": m.nplugin,
            "flexible bodies": m.nflex,
        }
        self._ignored += [what for what, present in kinds.items() if present]


def _started(joints: Iterable[Joint], couplings: Sequence[Coupling]) -> tuple[Joint, ...]:
    """``joints`` where the first one of a coupling starts as the second one says: MuJoCo's start need not meet it."""
    starts = {joint.name: joint.start for joint in joints}
    for _ in couplings:  # one may lead the next
        for coupling in couplings:
            first, zero = coupling.first
            away = starts[coupling.second[0]][0] - coupling.second[1] if coupling.second is not None else 0.0
            starts[first] = (zero + float(np.polyval(coupling.coefficients[::-1], away)),)
    return tuple(replace(joint, start=starts[joint.name]) for joint in joints)


def _closure(name: str, ends: tuple[str, str], data: Floats, *, weld: bool) -> Closure:
    """A connect: its anchor in both bodies. A weld: its anchor in the second, and the second's pose in the first."""
    if not weld:
        first, second = Pose(data[:3].copy()), Pose(data[3:6].copy())
        return Closure(name, "spherical", (ends[0], first), (ends[1], second))
    turn = _turned(data[6:10] / np.linalg.norm(data[6:10]))
    anchor = data[:3].copy()
    first = Pose.of(data[3:6] + turn @ anchor, turn)
    return Closure(name, "fixed", (ends[0], first), (ends[1], Pose(anchor)))
