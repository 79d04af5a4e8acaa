"""The records that all formats of robots are read into: links with their inertia, and joints that carry links.

Lengths are in m, angles in rad, masses in kg, inertias in kg.m2; vectors (3,) and matrices (3, 3) are NumPy arrays.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOVING = ("revolute", "prismatic", "planar", "spherical", "floating")
"""The kinds of joints that have coordinates; a "fixed" one has none."""


@dataclass(frozen=True)
class LinkInertia:
    """The ``mass`` of a rigid body, its ``center`` (3,) and the ``tensor`` (3, 3) about it, in the axes of its link."""

    mass: float
    center: Floats
    tensor: Floats

    def moved(self, turn: Floats, place: Floats) -> LinkInertia:
        """The inertia in the axes of a frame in which the link is at ``place`` (3,), turned by ``turn`` (3, 3)."""
        return LinkInertia(self.mass, place + turn @ self.center, turn @ self.tensor @ turn.T)

    def __add__(self, other: LinkInertia) -> LinkInertia:
        """Both as one body, by the parallel axis theorem: Goldstein, Classical Mechanics, section 5.3."""
        mass = self.mass + other.mass
        if not mass:
            return LinkInertia(0.0, self.center, self.tensor + other.tensor)
        center = (self.mass * self.center + other.mass * other.center) / mass
        tensors = (part.tensor + part.mass * _offset(part.center - center) for part in (self, other))
        return LinkInertia(mass, center, np.sum([*tensors], axis=0))


def _offset(d: Floats) -> Floats:
    """The tensor (3, 3) of a unit mass at a distance ``d`` (3,)."""
    tensor: Floats = d @ d * np.eye(3) - np.outer(d, d)
    return tensor


@dataclass(frozen=True)
class Mimic:
    """A joint's coordinate that is ``factor`` times that of the joint ``leader``, plus ``offset``."""

    leader: str
    factor: float
    offset: float


@dataclass(frozen=True)
class JointPose:
    """Where a joint stands in its parent link: ``origin`` (3,) and turns by (axis, angle) about the moving axes."""

    origin: Floats
    turns: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, origin: Floats, matrix: Floats) -> JointPose:
        """The pose of an origin (3,) and a matrix (3, 3) of turns: by yaw, pitch and roll, about z, y and x.

        The roll is that of the matrix turned back by the yaw, so that the three are exact to rounding also where the
        pitch is nearly a quarter turn and yaw and roll are nearly the same.
        """
        cosine = math.hypot(matrix[0, 0], matrix[1, 0])
        pitch = math.atan2(-matrix[2, 0], cosine)
        if cosine > ROUNDING:
            yaw = math.atan2(matrix[1, 0], matrix[0, 0])
            c, s = math.cos(yaw), math.sin(yaw)
            roll = math.atan2(s * matrix[0, 2] - c * matrix[1, 2], c * matrix[1, 1] - s * matrix[0, 1])
        else:  # both turn about the same axis
            yaw, roll = math.atan2(-matrix[0, 1], matrix[1, 1]), 0.0
        return cls(origin, tuple((axis, angle) for axis, angle in zip("zyx", (yaw, pitch, roll), strict=True) if angle))

    @property
    def matrix(self) -> Floats:
        """The turns as one matrix (3, 3)."""
        return reduce(lambda product, turn: product @ about(*turn), self.turns, np.eye(3))


def about(axis: str, angle: float) -> Floats:
    """The matrix (3, 3) of a turn by ``angle`` (rad) about the ``axis`` x, y or z; quarter turns are exact."""
    quarters = round(angle / (np.pi / 2))
    exact = abs(angle - quarters * np.pi / 2) < QUARTER
    c, s = ((1, 0, -1, 0)[quarters % 4], (0, 1, 0, -1)[quarters % 4]) if exact else (np.cos(angle), np.sin(angle))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return matrix


ROUNDING = 1e-14
"""The cosine of a pitch that is a quarter turn, to the rounding of products of some matrices."""
QUARTER = 6e-12
"""rad; an angle so near to quarter turns is one: files round them to 12 digits."""


Limits = tuple[float, float]
"""The least and the greatest value."""


@dataclass(frozen=True)
class RobotJoint:
    """A joint of a ``kind`` in ``MOVING``, or "fixed", by which the link ``child`` stands on the link ``parent``.

    ``axis`` is the unit vector (3,) that it turns about or moves along, of a planar one the normal, in the axes of the
    child. ``lower``, ``upper``: its limits, None without. ``damping`` in N.s/m or N.m.s/rad, ``friction`` in N or N.m.
    It turns or moves by its coordinate less the ``reference``. ``start``: of its coordinates, none where 0 or no turn.
    ``stiffness`` (N/m, N.m/rad) of a spring at rest at ``rest``; ``armature`` (kg or kg.m2) moves with the coordinate.
    A spherical or floating joint has them along all its velocities, with its spring at rest at its ``start``.
    """

    name: str
    kind: str
    parent: str
    child: str
    pose: JointPose
    axis: Floats
    lower: float | None = None
    upper: float | None = None
    damping: float = 0.0
    friction: float = 0.0
    mimic: Mimic | None = None
    start: tuple[float, ...] = ()
    reference: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0
    armature: float = 0.0
    force_limits: Limits | None = None


Sum = tuple[tuple[str, float], ...]
"""A length: pairs of a joint and the factor of its coordinate."""


@dataclass(frozen=True)
class Turning:
    """The rate ``gear`` times the angular velocity of a spherical ``joint``, or velocity and this of a floating one.

    The velocity is along the axes of the parent, the angular velocity along those of the child or, ``in_parent``, of
    the parent.
    """

    joint: str
    gear: tuple[float, ...]
    in_parent: bool


Spot = tuple[str, tuple[float, ...]]
"""A link, and a place (3,) in its axes."""


@dataclass(frozen=True)
class Span:
    """A length: the way along ``spots``, straight from each to the next, times the ``gear``.

    Only a force that depends on neither length nor rate acts along more than two.
    """

    spots: tuple[Spot, ...]
    gear: float = 1.0


@dataclass(frozen=True)
class Wrench:
    """What a force of 1 is: a ``force`` and a ``torque``, (3,), at a ``place`` of a ``link``, in the link's axes."""

    link: str
    place: tuple[float, ...]
    force: tuple[float, ...]
    torque: tuple[float, ...]


Transmission = Sum | Turning | Span | Wrench


@dataclass(frozen=True)
class Activation:
    """The state of an actuator, which its control drives: ``kind`` "integrator", z' = u, or "filter", z' = (u - z)/T.

    T is the ``time_constant`` (s). At its ``limits`` the state stays.
    """

    kind: str
    time_constant: float
    limits: Limits | None


@dataclass(frozen=True)
class Actuator:
    """A force ``along`` something: the sum of ``gain`` times (1, length, length') times u, and ``bias`` times these.

    u is its input, or its ``state`` if it has one. Input and force saturate at ``control_limits``, ``force_limits``.
    """

    name: str
    along: Transmission
    gain: tuple[float, float, float]
    bias: tuple[float, float, float]
    control_limits: Limits | None = None
    force_limits: Limits | None = None
    state: Activation | None = None


@dataclass(frozen=True)
class Tendon:
    """A spring of ``stiffness`` with the ``rest`` length, and a damper, along the ``length``."""

    name: str
    length: Sum | Span
    stiffness: float
    rest: float
    damping: float


@dataclass(frozen=True)
class Closure:
    """The ``kind`` "spherical" or "fixed" of a joint that closes a loop between poses of two links."""

    name: str
    kind: str
    first: tuple[str, JointPose]
    second: tuple[str, JointPose]


@dataclass(frozen=True)
class Coupling:
    """The length ``first`` is a polynomial of ``second``, both less their references; or a constant without it."""

    name: str
    first: tuple[Sum, float]
    second: tuple[Sum, float] | None
    coefficients: tuple[float, ...]


@dataclass(frozen=True)
class Sensor:
    """A ``quantity`` along joints, of an ``actuator`` or of a ``place``.

    It is "length" or "rate" ``along`` joints or of the actuator, or its "force". A place is a link and a pose in its
    axes; its quantities are those of outputs, along the ``axes`` "world" or "frame".
    """

    name: str
    quantity: str
    along: Sum = ()
    actuator: str = ""
    place: tuple[str, JointPose] | None = None
    axes: str = "world"


@dataclass(frozen=True)
class Robot:
    """A tree: ``links`` by name with their inertia, None without, the ``root`` among them, ``joints`` parents first.

    ``gravity`` (3,) is in m/s2. ``ignored`` lists everything in the file that is not used.
    """

    name: str
    root: str
    links: Mapping[str, LinkInertia | None]
    joints: tuple[RobotJoint, ...]
    ignored: tuple[str, ...] = ()
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    actuators: tuple[Actuator, ...] = ()
    tendons: tuple[Tendon, ...] = ()
    closures: tuple[Closure, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    sensors: tuple[Sensor, ...] = ()


def in_order(root: str, joints: Iterable[RobotJoint]) -> tuple[RobotJoint, ...]:
    """``joints`` that can be reached from the link ``root``, in their order, but each behind that of its parent."""
    below: dict[str, list[RobotJoint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    found: list[RobotJoint] = []
    waiting = [root]
    while waiting:
        own = below.get(waiting.pop(), [])
        found += own
        waiting += [joint.child for joint in reversed(own)]
    return tuple(found)
