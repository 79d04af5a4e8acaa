"""The joined places of one FMU: their motion is read, and the forces of joints on them are set.

A wrench is force and torque, (6,) in N and N.m; a twist is velocity and angular velocity, (6,) in m/s and rad/s. All
places of an FMU stand one after the other in one vector. The plane is z = 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lag2fmu.description.outputs import QUANTITIES
from lag2fmu.description.places import AXES
from lag2fmu.errors import LoadError
from lag2fmu.systems.components import ComponentTerminal
from lag2fmu.systems.joint_shapes import PlaceMotion
from lag2fmu.systems.member import Member
from lag2fmu.verify.run import Floats


def _entries(*quantities: str) -> tuple[str, ...]:
    return tuple(f"{quantity}_{axis}" for quantity in quantities for axis in AXES)


_POSITION, _TWIST, _WRENCH = _entries("position"), _entries("velocity", "angular_velocity"), _entries("force", "torque")
_MATRIX, _QUATERNION = (tuple(f"{name}_{x}" for x in QUANTITIES[name][1]) for name in ("rotation", "quaternion"))
_TURNS = (_MATRIX, _QUATERNION, ("angle_z",))
"""The forms in which a place may tell its rotation."""
_ABOUT_Z = {name: f"{name}_z" for name in ("angle", "angular_velocity", "torque")}
"""{member of a place in the plane: that of a place in space}."""


_EMPTY: Floats = np.zeros(0)


class Places:
    """The places of the ``member`` that are joined: ``terminals`` by their names.

    Speeds that a place does not tell are the derivatives of its pose, as the FMU gives them.
    """

    def __init__(self, member: Member, terminals: Mapping[str, ComponentTerminal]) -> None:
        """Look up the variables. Raises LoadError for a place whose speed nothing tells."""
        self.member, self.names = member, tuple(terminals)
        spatial = [{_ABOUT_Z.get(m, m): x for m, x in terminal.members.items()} for terminal in terminals.values()]
        self._lying = _Reading(member, spatial, (_POSITION, *_TURNS))
        self._moving = _Reading(member, spatial, (_TWIST,))
        driven = [(i, m) for i, members in enumerate(spatial) for m in _WRENCH if m in members]
        self._wrench = member.channel([spatial[i][m] for i, m in driven])
        self.driven = [6 * i + _WRENCH.index(m) for i, m in driven]
        self._derived = [i for i, members in enumerate(spatial) if _lacks_speed(members)]
        if self._derived and not member.gives_orders:
            name = self.names[self._derived[0]].removesuffix("_port")
            raise LoadError(
                f"the FMU of '{member.name}' tells no speed of '{name}' and no derivatives of outputs; export it with "
                f"--port velocities={name}"
            )

    def motions(self) -> dict[str, PlaceMotion]:
        """{place: its motion} at present."""
        poses, twists = self._lying.values(), self._moving.values()
        rates = self._lying.rates() if self._derived else poses
        found = {}
        for i, name in enumerate(self.names):
            position, *turns = poses[i]
            found[name] = PlaceMotion(position, _rotation(turns), twists[i][0][:3], twists[i][0][3:])
            if i in self._derived:
                found[name] = found[name]._replace(v=rates[i][0], omega=_angular_velocity(turns, rates[i][1:]))
        return found

    def twists(self) -> Floats:
        """The twists of all places at present, (6 p,)."""
        return np.concatenate([part for motion in self.motions().values() for part in (motion.v, motion.omega)])

    def set(self, wrenches: Floats) -> None:
        """Set the ``wrenches`` (6 p,) on all places."""
        self._wrench.write(wrenches[self.driven])

    def drive(self, terms: Floats) -> None:
        """Let the wrenches in the next step go on from terms[0] (6 p,) by their derivatives, ``terms`` (3, 6 p)."""
        self.set(terms[0])
        value, *rates = terms[:, self.driven]
        self.member.drive(self._wrench, value, np.array(rates))


class _Reading:
    """The members ``groups`` of all places, read together; ``spatial``: {member: variable} of each place."""

    def __init__(self, member: Member, spatial: Sequence[Mapping[str, str]], groups: Sequence[Sequence[str]]) -> None:
        self._member = member
        read = [(i, m) for i, known in enumerate(spatial) for group in groups for m in group if m in known]
        self._channel, at = member.channel([spatial[i][m] for i, m in read]), {key: row for row, key in enumerate(read)}
        # what a place does not have is empty, or 0 in the plane
        self._rows = [
            [np.array([at.get((i, m), -1) for m in g]) if any(m in known for m in g) else None for g in groups]
            for i, known in enumerate(spatial)
        ]
        self._padded = np.zeros(len(read) + 1)

    def values(self) -> list[list[Floats]]:
        """The present values of each place, by groups."""
        return self._sorted(self._channel.read())

    def rates(self) -> list[list[Floats]]:
        """The derivatives of the values by time."""
        return self._sorted(self._member.derivatives(self._channel)[0])

    def _sorted(self, numbers: Floats) -> list[list[Floats]]:
        self._padded[:-1] = numbers
        return [[_EMPTY if rows is None else self._padded[rows] for rows in groups] for groups in self._rows]


def _lacks_speed(members: Mapping[str, str]) -> bool:
    """Whether a place has a pose, but not its speed."""
    turns = any(form[0] in members for form in _TURNS)
    return _TWIST[0] not in members or (turns and _TWIST[5] not in members)


def _rotation(turns: Sequence[Floats]) -> Floats:
    """The matrix (3, 3) of a rotation in one of the forms ``turns``: matrix, quaternion, angle about z."""
    matrix, quaternion, angle = turns
    if matrix.size:
        return matrix.reshape(3, 3)
    if quaternion.size:
        return _by_quaternion(quaternion)
    c, s = (np.cos(angle[0]), np.sin(angle[0])) if angle.size else (1.0, 0.0)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _angular_velocity(turns: Sequence[Floats], rates: Sequence[Floats]) -> Floats:
    """The angular velocity (3,), in rad/s, of a rotation in one of the forms ``turns`` with these ``rates``.

    Source: P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems, sections 6.4 and 6.6.
    """
    (matrix, quaternion, _), (matrix_rate, quaternion_rate, angle_rate) = turns, rates
    if matrix.size:
        turning = matrix_rate.reshape(3, 3) @ matrix.reshape(3, 3).T
        return np.array([turning[2, 1], turning[0, 2], turning[1, 0]])
    if quaternion.size:
        (e0, *e), (d0, *d) = quaternion, quaternion_rate
        found: Floats = 2 * (e0 * np.array(d) - d0 * np.array(e) + np.cross(e, d))
        return found
    return np.array([0.0, 0.0, *(angle_rate if angle_rate.size else (0.0,))])


def _by_quaternion(e: Floats) -> Floats:
    """The matrix (3, 3) of the unit quaternion ``e`` (4,), scalar first: R v = v + 2 e0 e x v + 2 e x (e x v)."""
    w, x, y, z = e
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found: Floats = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    return found
