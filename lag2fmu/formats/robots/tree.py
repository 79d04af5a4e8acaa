"""The records that all formats of robots are read into: links with their inertia, and joints that carry links.

Lengths are in m, angles in rad, masses in kg, inertias in kg.m2; vectors (3,) and matrices (3, 3) are NumPy arrays.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from lag2fmu.formats.robots.poses import Floats, JointPose, LinkInertia

MOVING = ("revolute", "prismatic", "planar", "spherical", "floating")
"""The kinds of joints that have coordinates; a "fixed" one has none."""


@dataclass(frozen=True)
class Mimic:
    """A joint's coordinate that is ``factor`` times that of the joint ``leader``, plus ``offset``."""

    leader: str
    factor: float
    offset: float


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
    """A length: the way along ``spots``, straight from each to the next, times the ``gear``."""

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
class Muscle:
    """The curves of a muscle, by MuJoCo's words: ``lmin``, ``lmax``, ``vmax`` (1/s), ``fpmax``, ``fvmax``.

    ``peak`` is the greatest active force at rest, at the ``optimal`` length; lengths count in the ``unit``. Activation
    follows with the times ``rise`` and ``fall`` (s), one going over into the other in a width ``smoothing``.
    """

    peak: float
    optimal: float
    unit: float
    lmin: float
    lmax: float
    vmax: float
    fpmax: float
    fvmax: float
    rise: float
    fall: float
    smoothing: float


@dataclass(frozen=True)
class Actuator:
    """A force ``along`` something: the sum of ``gain`` times (1, length, length') times u, and ``bias`` times these.

    u is its input, or its ``state`` if it has one; a ``muscle`` has curves instead of gain and bias. Input and force
    saturate at ``control_limits``, ``force_limits``.
    """

    name: str
    along: Transmission
    gain: tuple[float, float, float]
    bias: tuple[float, float, float]
    control_limits: Limits | None = None
    force_limits: Limits | None = None
    state: Activation | None = None
    muscle: Muscle | None = None


@dataclass(frozen=True)
class Tendon:
    """A spring of ``stiffness``, a damper, the ``armature``, dry friction and ``limits`` along the ``length``.

    The spring is slack between the two lengths of ``rest``.
    """

    name: str
    length: Sum | Span
    stiffness: float
    rest: tuple[float, float]
    damping: float
    armature: float
    friction: float
    limits: Limits | None

    @property
    def has_more(self) -> bool:
        """Whether more acts than a spring and a damper."""
        return bool(self.armature or self.friction or self.limits)

    @property
    def acts(self) -> bool:
        """Whether anything acts along it."""
        return self.has_more or bool(self.stiffness or self.damping)


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
    """A ``quantity`` along joints, of an ``actuator``, of a ``place`` or of a ``subtree``.

    It is "length" or "rate" ``along`` joints or places, or of the actuator, or its "force"; along a joint this is the
    sum of all actuators' forces. A ``place`` is a link and a
    pose in its axes; its quantities are those of outputs, along the ``axes`` "world" or "frame". A subtree is a link
    with all that it carries; what holds it is told at the place. "touch" is the sum of the normal forces on the link of
    a ``zone``.
    """

    name: str
    quantity: str
    along: Sum | Span = ()
    actuator: str = ""
    place: tuple[str, JointPose] | None = None
    axes: str = "world"
    subtree: str = ""
    zone: Geom | None = None


@dataclass(frozen=True)
class Geom:
    """A shape of a ``kind`` on a ``link``, at a ``pose`` in its axes; its name is unique.

    ``size`` (m): "sphere" its radius; "capsule" and "cylinder" radius and half the length along z, which a capsule has
    between the centres of its ends; "box" and "ellipsoid" three halves; "points" none, but ``vertices`` (n, 3). A
    "plane" is that of x and y. The link of what stands in the world is "".
    """

    name: str
    link: str
    kind: str
    pose: JointPose
    size: tuple[float, ...] = ()
    vertices: Floats | None = None


@dataclass(frozen=True)
class Touch:
    """Two geoms that touch when they are ``margin`` (m) apart; ``second`` is a plane, or both are round.

    ``friction`` is the coefficient of sliding.
    """

    first: Geom
    second: Geom
    friction: float
    margin: float = 0.0


@dataclass(frozen=True)
class Look:
    """What is seen of a ``link`` at a ``pose`` in its axes: ``shape``, ``size``, ``file``, ``color`` are a Visual's."""

    name: str
    link: str
    shape: str
    pose: JointPose
    size: tuple[float, ...] = ()
    file: str = ""
    color: str = ""


@dataclass(frozen=True)
class Robot:
    """A tree: ``links`` by name with their inertia, None without, the ``root`` among them, ``joints`` parents first.

    ``gravity`` (3,) is in m/s2. ``ignored`` lists everything in the file that is not used. ``lifted`` {link: mass} are
    masses (kg) whose weight a force at the link's mass centre compensates.
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
    touches: tuple[Touch, ...] = ()
    looks: tuple[Look, ...] = ()
    lifted: Mapping[str, float] = field(default_factory=dict)


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
