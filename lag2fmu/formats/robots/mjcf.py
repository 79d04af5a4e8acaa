"""Reading MJCF, the XML of MuJoCo (https://mujoco.readthedocs.io/en/stable/XMLreference.html), by MuJoCo itself.

Taken is what MuJoCo compiled: bodies with their inertia, joints, what acts on them, actuators whose force is affine in
their control or in a state that filters or integrates it, tendons of joints and from site to site, and the equalities
connect, weld, joint and tendon, which are exact here, and sensors of joints, tendons, actuators, places and frames. The
package mujoco is optional.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.errors import LoadError
from lag2fmu.formats.robots.compiled import ROOT, Compiled, disabled_taken_out, turned
from lag2fmu.formats.robots.ground import Ground
from lag2fmu.formats.robots.mjcf_forces import actuators, limits_of, tendon_of, tendons
from lag2fmu.formats.robots.mjcf_geoms import touches
from lag2fmu.formats.robots.mjcf_looks import looks
from lag2fmu.formats.robots.mjcf_sensors import sensors
from lag2fmu.formats.robots.mjcf_size import check_size
from lag2fmu.formats.robots.poses import Floats, JointPose, LinkInertia
from lag2fmu.formats.robots.tree import Closure, Coupling, Robot, RobotJoint, Span, Sum
from lag2fmu.xml_tree import parse

_FREE, _BALL, _SLIDE, _HINGE = range(4)  # mjtJoint
_NAMELESS = ("", "MuJoCo Model")
_MOST_BYTES = 64 << 20
_READ = ("body_", "jnt_", "dof_", "tendon_", "actuator_", "eq_", "qpos", "geom_", "pair_", "mesh_vert")
"""The beginnings of the names of the lists that are read."""


def read_mjcf(path: Path, ground: Ground | None = None) -> Robot:
    """The robot in the file ``path``, with what touches by the ``ground``.

    Raises LoadError with the reason, and where the package mujoco is missing.
    """
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
    root = parse(content, str(path)).root
    tag = root.tag
    if tag != "mujoco":
        raise LoadError(f"{path}: its top element is <{tag}>; a MJCF file has <mujoco>, a URDF file ends in .urdf")
    check_size(root, path)
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise LoadError(f"{path}: MuJoCo refuses it: {' '.join(str(error).split())}") from error
    _check_finite(model, path)
    disabled_taken_out(mujoco, model)
    return _MjcfReader(Compiled(mujoco, model), path).robot(ground)


def _check_finite(model: Any, path: Path) -> None:
    """Raise LoadError for a number that MuJoCo took although it is none, with MuJoCo's name of the list it is in."""
    numbers = {name: getattr(model, name) for name in dir(model) if name.startswith(_READ)}
    numbers["gravity"] = model.opt.gravity
    for name, values in numbers.items():
        if isinstance(values, np.ndarray) and values.dtype.kind == "f" and not np.isfinite(values).all():
            raise LoadError(f"{path}: a number in {name} is not finite; correct it in the file")


class _MjcfReader:
    """Reads a compiled model as a robot."""

    def __init__(self, compiled: Compiled, path: Path) -> None:
        self._compiled, self._mujoco, self._m, self._path = compiled, compiled.mujoco, compiled.model, path
        self._name, self._body, self._ignored = compiled.name, compiled.body, compiled.ignored

    def robot(self, ground: Ground | None) -> Robot:
        m = self._m
        links: dict[str, LinkInertia | None] = {ROOT: None}
        joints: list[RobotJoint] = []
        for body in range(1, m.nbody):
            for joint in self._joints_of(body):
                joints.append(joint)
                links[joint.child] = None
            links[self._body(body)] = self._inertia(body)
        driving, stretching = tuple(actuators(self._compiled)), tuple(tendons(self._compiled))
        closures, couplings = self._equalities()
        measured = tuple(sensors(self._compiled))
        touching = () if ground is None else touches(self._compiled, ground, str(self._path))
        self._check_lifts()
        self._list_ignored(contacts=ground is None)
        x, y, z = m.opt.gravity
        name = m.names.split(b"\0", 1)[0].decode()
        return Robot(
            self._path.stem if name in _NAMELESS else name,
            ROOT,
            links,
            _started(joints, couplings),
            tuple(self._ignored),
            (float(x), float(y), float(z)),
            driving,
            stretching,
            closures,
            couplings,
            measured,
            touching,
            tuple(looks(self._compiled, self._path.parent)),
            {self._body(k): float(m.body_gravcomp[k] * m.body_mass[k]) for k in range(1, m.nbody)},
        )

    def _inertia(self, body: int) -> LinkInertia | None:
        m, turn = self._m, turned(self._m.body_iquat[body])
        mass, principal = float(m.body_mass[body]), m.body_inertia[body]
        if not mass and not principal.any():
            return None
        return LinkInertia(mass, m.body_ipos[body].copy(), turn @ np.diag(principal) @ turn.T)

    # ------------------------------------------------------------------------------------------------------ joints

    def _joints_of(self, body: int) -> Iterator[RobotJoint]:
        """The joints of a body one after the other, with links of their own between them, and a last fixed one.

        Joint k turns about its anchor a_k in the axes of the body as the joints before left them.
        """
        m, name = self._m, self._body(body)
        link, pose = self._body(m.body_parentid[body]), JointPose.of(m.body_pos[body].copy(), turned(m.body_quat[body]))
        first, count = m.body_jntadr[body], m.body_jntnum[body]
        for k in range(first, first + count):
            free, anchor = m.jnt_type[k] == _FREE, m.jnt_pos[k].copy()
            place = JointPose(np.zeros(3)) if free else JointPose(pose.origin + pose.matrix @ anchor, pose.turns)
            last = k == first + count - 1 and (free or not anchor.any())
            child = name if last else self._compiled.fresh("body", f"{name}_at_{self._name('joint', k)}")
            yield self._joint(k, link, child, place)
            link, pose = child, JointPose(np.zeros(3) if free else -anchor)
            if last:
                return
        yield RobotJoint(
            self._compiled.fresh("joint", f"fixed_{name}"), "fixed", link, name, pose, np.array([1.0, 0.0, 0.0])
        )

    def _joint(self, k: int, parent: str, child: str, pose: JointPose) -> RobotJoint:
        m, kind = self._m, int(self._m.jnt_type[k])
        name, at, dof = self._name("joint", k), int(m.jnt_qposadr[k]), int(m.jnt_dofadr[k])
        self._compiled.note(
            {
                f"polynomial stiffness and damping of the joint {name}": ("jnt_stiffnesspoly", "dof_dampingpoly"),
                f"yield of the spring of the joint {name}": ("jnt_springyield",) if m.jnt_stiffness[k].any() else (),
                f"limits of the joint {name}": ("jnt_limited",) if kind in (_FREE, _BALL) else (),
            },
            {"jnt": k, "dof": dof},
        )
        axis = m.jnt_axis[k] / np.linalg.norm(m.jnt_axis[k])
        if kind in (_FREE, _BALL):
            if m.dof_frictionloss[dof]:
                self._ignored.append(f"friction loss of the joint {name}")
            return RobotJoint(
                name,
                "floating" if kind == _FREE else "spherical",
                parent,
                child,
                pose,
                axis,
                damping=float(m.dof_damping[dof]),
                start=tuple(map(float, m.qpos0[at : at + (7 if kind == _FREE else 4)])),
                stiffness=float(np.ravel(m.jnt_stiffness[k])[0]),
                armature=float(m.dof_armature[dof]),
            )
        limited = bool(m.jnt_limited[k])
        return RobotJoint(
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
            force_limits=limits_of(m.jnt_actfrcrange[k]) if m.jnt_actfrclimited[k] else None,
        )

    # -------------------------------------------------------------------------------------------------- equalities

    def _equalities(self) -> tuple[tuple[Closure, ...], tuple[Coupling, ...]]:
        """The active equalities of the kinds connect, weld, joint and tendon, the last of tendons of joints."""
        m, kinds, objects = self._m, self._mujoco.mjtEq, self._mujoco.mjtObj
        closures, couplings = [], []
        lengths = {int(kinds.mjEQ_JOINT): self._angle, int(kinds.mjEQ_TENDON): self._tendon}
        for k in (k for k in range(m.neq) if m.eq_active0[k]):
            name, kind, data = self._name("equality", k), int(m.eq_type[k]), m.eq_data[k]
            first, second = int(m.eq_obj1id[k]), int(m.eq_obj2id[k])
            found = [lengths[kind](x) for x in (first, second) if x >= 0] if kind in lengths else []
            coupled = [end for end in found if end is not None]
            if coupled and len(coupled) == len(found):
                coefficients = tuple(map(float, data[:5]))
                couplings.append(Coupling(name, coupled[0], coupled[1] if second >= 0 else None, coefficients))
            elif kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD) and int(m.eq_objtype[k]) == objects.mjOBJ_BODY:
                ends = (self._body(first), self._body(second))
                closures.append(_closure(name, ends, data, weld=bool(kind == kinds.mjEQ_WELD)))
            else:
                self._ignored.append(f"the equality {name}")
        return tuple(closures), tuple(couplings)

    def _angle(self, joint: int) -> tuple[Sum, float]:
        """The coordinate of a ``joint``, and its reference."""
        return ((self._name("joint", joint), 1.0),), float(self._m.qpos0[self._m.jnt_qposadr[joint]])

    def _tendon(self, index: int) -> tuple[Sum, float] | None:
        """The length of a tendon of joints, and its reference; None for one in space, and for one of no joint."""
        length = tendon_of(self._compiled, index)
        if length is None or isinstance(length, Span) or not any(factor for _, factor in length):
            return None
        return length, float(self._m.tendon_length0[index])

    def _check_lifts(self) -> None:
        """Note where it matters that compensation of gravity counts to what actuators do: by limits and by sensors."""
        m = self._m
        for k in range(m.njnt):
            if m.jnt_actgravcomp[k] and (m.jnt_actfrclimited[k] or self._compiled.senses("JOINTACTFRC", k)):
                joint = self._name("joint", k)
                self._ignored.append(
                    f"that compensation of gravity counts to the actuators' force on the joint {joint}"
                )

    def _list_ignored(self, *, contacts: bool) -> None:
        """Note everything else in the model that would act on the motion, with all ``contacts`` if none is taken."""
        m = self._m
        touching = int(np.count_nonzero((m.geom_contype != 0) | (m.geom_conaffinity != 0)))
        pairs = 0 if self._compiled.disabled("CONTACT") else m.npair
        kinds = {
            f"contacts of {touching} geoms (ground takes them)": contacts and touching > 1,
            f"contacts of {pairs} pairs of geoms (ground takes them)": contacts and pairs,
            "the medium (density, viscosity, wind)": m.opt.density or m.opt.viscosity or m.opt.wind.any(),
            "plugins": m.nplugin,
            "flexible bodies": m.nflex,
        }
        self._ignored += [what for what, present in kinds.items() if present]


def _started(joints: Iterable[RobotJoint], couplings: Sequence[Coupling]) -> tuple[RobotJoint, ...]:
    """``joints`` with starts that meet the ``couplings``, which MuJoCo's starts need not do."""
    starts = {joint.name: joint.start for joint in joints}

    def at(length: Sum) -> float:
        return sum(factor * starts[joint][0] for joint, factor in length)

    for _ in couplings:  # the first joint of one coupling may be the second one of the next
        for coupling in couplings:
            length, zero = coupling.first
            joint, factor = next(end for end in length if end[1])
            away = at(coupling.second[0]) - coupling.second[1] if coupling.second is not None else 0.0
            open_by = at(length) - zero - float(np.polyval(coupling.coefficients[::-1], away))
            starts[joint] = (starts[joint][0] - open_by / factor,)
    return tuple(replace(joint, start=starts[joint.name]) for joint in joints)


def _closure(name: str, ends: tuple[str, str], data: Floats, *, weld: bool) -> Closure:
    """A connect: its anchor in both bodies. A weld: its anchor in the second, and the second's pose in the first."""
    if not weld:
        first, second = JointPose(data[:3].copy()), JointPose(data[3:6].copy())
        return Closure(name, "spherical", (ends[0], first), (ends[1], second))
    turn = turned(data[6:10] / np.linalg.norm(data[6:10]))
    anchor = data[:3].copy()
    first = JointPose.of(data[3:6] + turn @ anchor, turn)
    return Closure(name, "fixed", (ends[0], first), (ends[1], JointPose(anchor)))
