"""The joined places of one FMU: their motion is read, and the forces of joints on them are set.

A wrench is force and torque, (6,) in N and N.m; a twist is velocity and angular velocity, (6,) in m/s and rad/s. All
places of an FMU stand one after the other in one vector. The plane is z = 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lag2fmu.description.outputs import QUANTITIES
from lag2fmu.description.places import AXES
from lag2fmu.systems.components import ComponentTerminal
from lag2fmu.systems.joint_shapes import PlaceMotion
from lag2fmu.systems.member import Member
from lag2fmu.verify.run import Floats


def _entries(*quantities: str) -> tuple[str, ...]:
    return tuple(f"{quantity}_{axis}" for quantity in quantities for axis in AXES)


_POSITION, _TWIST, _WRENCH = _entries("position"), _entries("velocity", "angular_velocity"), _entries("force", "torque")
_MATRIX, _QUATERNION = (tuple(f"{name}_{x}" for x in QUANTITIES[name][1]) for name in ("rotation", "quaternion"))
_READ = (*_POSITION, *_TWIST, *_MATRIX, *_QUATERNION, "angle_z")
_ABOUT_Z = {name: f"{name}_z" for name in ("angle", "angular_velocity", "torque")}
"""{member of a place in the plane: that of a place in space}."""


class Places:
    """The places of the ``member`` that are joined: ``terminals`` by their names."""

    def __init__(self, member: Member, terminals: Mapping[str, ComponentTerminal]) -> None:
        """Look up the variables."""
        self.member, self.names = member, tuple(terminals)
        spatial = [{_ABOUT_Z.get(m, m): x for m, x in terminal.members.items()} for terminal in terminals.values()]
        read = [(i, m) for i, members in enumerate(spatial) for m in _READ if m in members]
        driven = [(i, m) for i, members in enumerate(spatial) for m in _WRENCH if m in members]
        self._moving = member.channel([spatial[i][m] for i, m in read])
        self._wrench = member.channel([spatial[i][m] for i, m in driven])
        self.driven = [6 * i + _WRENCH.index(m) for i, m in driven]
        at = {key: row for row, key in enumerate(read)}
        self._rows = [_rows(at, i) for i in range(len(self.names))]

    def motions(self) -> dict[str, PlaceMotion]:
        """{place: its motion} at present."""
        values = np.append(self._moving.read(), 0.0)  # the last one is what a place does not have
        return {name: _motion(values, rows) for name, rows in zip(self.names, self._rows, strict=True)}

    def twists(self) -> Floats:
        """The twists of all places at present, (6 p,)."""
        return np.concatenate([part for motion in self.motions().values() for part in (motion.v, motion.omega)])

    def set(self, wrenches: Floats) -> None:
        """Set the ``wrenches`` (6 p,) on all places."""
        self._wrench.write(wrenches[self.driven])

    def drive(self, wrenches: Floats, slopes: Floats) -> None:
        """Let the wrenches (6 p,) in the next step grow from ``wrenches`` by ``slopes`` (6 p,), in N/s and N.m/s."""
        self.set(wrenches)
        rates = np.array([slopes[self.driven], np.zeros(len(self.driven))])
        self.member.drive(self._wrench, wrenches[self.driven], rates)


def _rows(at: Mapping[tuple[int, str], int], place: int) -> list[list[int]]:
    """Where position, twist and the three forms of a rotation of a ``place`` are read, -1 for what it does not have."""
    groups = (_POSITION, _TWIST, _MATRIX, _QUATERNION, ("angle_z",))
    return [[at.get((place, member), -1) for member in group] for group in groups]


def _motion(values: Floats, rows: Sequence[list[int]]) -> PlaceMotion:
    """The motion of a place whose entries are the ``rows`` of ``values``: position, twist, rotation in three forms."""
    position, twist, matrix, quaternion, angle = (values[row] for row in rows)
    if rows[2][0] >= 0:
        rotation = matrix.reshape(3, 3)
    elif rows[3][0] >= 0:
        rotation = _by_quaternion(quaternion)
    else:
        (c,), (s,) = np.cos(angle), np.sin(angle)
        rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return PlaceMotion(position, rotation, twist[:3], twist[3:])


def _by_quaternion(e: Floats) -> Floats:
    """The matrix (3, 3) of the unit quaternion ``e`` (4,), scalar first: R v = v + 2 e0 e x v + 2 e x (e x v)."""
    w, x, y, z = e
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found: Floats = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    return found
