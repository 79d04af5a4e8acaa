"""The record ``Ports``: inputs and outputs of an FMU beside coordinates, velocities and declared signals.

Places are points, bodies and frames by name; where two have one name, 'frames.NAME', 'bodies.NAME' or 'points.NAME'.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from lag2fmu.description.keys import key
from lag2fmu.description.places import WORLD, Frame, Place
from lag2fmu.errors import MechanismError

ALL, NONE = "all", "none"
"""Words for every input, and for none of them."""

ACTING = ("forces", "torques")
MOVING = ("poses", "velocities", "accelerations")
"""The fields with places at which forces or torques act, and those with places whose motion is an output."""

PLACE, JOINED = "org.lag2fmu.place", "org.lag2fmu.joint"
"""The kind of the terminal of a place that is a port, and its matching rule: an ideal joint is between two of them."""
ROTATIONS = ("quaternion", "rotation", "angles")


class Acting(NamedTuple):
    """A force or torque at a ``place``, along the ``axes`` of the "world" or of the "frame" of the place."""

    place: str
    axes: str


Spot = str | Place | Frame
"""A place as Python may give it."""


@dataclass(frozen=True)
class Ports:
    """Inputs and outputs of an FMU beside those that are declared in other tables.

    - ``inputs``: the inputs that the FMU has, of Q_<coordinate>, [inputs] and [loads]; None for all. The other inputs
      keep their start values.
    - ``forces`` (N), ``torques`` (N.m): the places at which one acts, or {place: axes} with the axes "world" or
      "frame". They are the inputs PLACE_force_x ..., PLACE_torque_x ...
    - ``drives``: prescribed motions whose force F_NAME is an output. With a coordinate among them the drives bear what
      constraints bear that other motions move: put on its coordinates, the forces F move the mechanism so.

    The other fields list places whose motion is an output, in world axes: PLACE_position_x ... (m) and ``rotation``,
    PLACE_velocity_x ... (m/s) and PLACE_angular_velocity_x ... (rad/s), PLACE_acceleration_x ... (m/s2) and
    PLACE_angular_acceleration_x ... (rad/s2). Raises MechanismError for unknown axes, and for a place that stands
    twice.
    """

    inputs: Sequence[str] | str | None = key(
        "choice", 'The inputs that the FMU has: "all", "none", or names of Q_COORDINATE, inputs, loads.', default=None
    )
    forces: Sequence[Spot] | Mapping[str, str] | tuple[Acting, ...] = key(
        "acting",
        'Points, bodies, frames where a force comes in; or { PLACE = "frame" }, along the axes of its frame.',
        default=(),
    )
    torques: Sequence[Spot] | Mapping[str, str] | tuple[Acting, ...] = key(
        "acting",
        'Bodies, frames where a torque comes in; or { PLACE = "frame" }, along the axes of its frame.',
        default=(),
    )
    poses: Sequence[Spot] = key("places", "Points, bodies, frames whose position and rotation go out.", default=())
    velocities: Sequence[Spot] = key("places", "Places whose velocity and angular velocity go out.", default=())
    accelerations: Sequence[Spot] = key(
        "places", "Places whose acceleration and angular acceleration go out.", default=()
    )
    rotation: str = key(
        ROTATIONS, "How poses in space tell the rotation; by default a quaternion.", default=ROTATIONS[0]
    )

    drives: Sequence[str] = key(
        "motions",
        "Prescribed motions whose force F_NAME goes out, which closes the bond; or coordinates, whose drives act in "
        "place of all motions that are not listed.",
        default=(),
    )

    def __post_init__(self) -> None:
        vars(self).update(
            inputs=_chosen(self.inputs),
            **{name: _acting(getattr(self, name), name) for name in ACTING},
            **{name: tuple(map(_name, getattr(self, name))) for name in (*MOVING, "drives")},
        )
        for name, places in {**self.listed(), "drives": tuple(self.drives)}.items():
            twice = next((place for i, place in enumerate(places) if place in places[:i]), None)
            if twice is not None:
                raise MechanismError(f"ports.{name}: '{twice}' stands twice; leave one out")
        if self.rotation not in ROTATIONS:
            raise MechanismError(f"ports.rotation: '{self.rotation}' is unknown; give one of {', '.join(ROTATIONS)}")

    def acting(self, name: str) -> tuple[Acting, ...]:
        """The places with axes in the field ``name``, one of ACTING."""
        found: tuple[Acting, ...] = getattr(self, name)
        return found

    def listed(self) -> dict[str, tuple[str, ...]]:
        """{field: the places in it} of all fields that hold places."""
        acting = {name: tuple(place for place, _ in self.acting(name)) for name in ACTING}
        return acting | {name: tuple(getattr(self, name)) for name in MOVING}

    def with_those_of(self, other: Ports) -> Ports:
        """These ports with the places and drives of ``other`` behind; the choice of inputs and rotation stay."""
        both = {name: (*getattr(self, name), *getattr(other, name)) for name in self.listed()}
        drives = tuple(dict.fromkeys((*self.drives, *other.drives)))  # a motion may be shared
        return Ports(self.inputs, **both, rotation=self.rotation, drives=drives)


def bare(place: str) -> str:
    """The name of ``place`` without the table before it."""
    return place.rpartition(".")[2]


def _chosen(inputs: Sequence[str] | str | None) -> tuple[str, ...] | None:
    """The names of the chosen inputs, None for all of them; raises MechanismError for another word."""
    if not isinstance(inputs, str):
        return None if inputs is None else tuple(map(str, inputs))
    if inputs not in (ALL, NONE):
        raise MechanismError(f"ports.inputs: expected an array of names, 'all' or 'none', got '{inputs}'")
    return None if inputs == ALL else ()


def _acting(given: Iterable[object] | Mapping[str, str], name: str) -> tuple[Acting, ...]:
    """Places with axes, which are those of the world unless ``given`` says otherwise."""
    pairs = given.items() if isinstance(given, Mapping) else given
    found = tuple(Acting(_name(x[0]), x[1]) if isinstance(x, tuple) else Acting(_name(x), WORLD) for x in pairs)
    for place, axes in found:
        if axes not in (WORLD, "frame"):
            raise MechanismError(f"ports.{name}.{place}: '{axes}' is unknown; give 'world' or 'frame'")
    return found


def _name(spot: object) -> str:
    return str(getattr(spot, "name", spot))
