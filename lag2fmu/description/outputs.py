"""Outputs of a mechanism, as expressions or as quantities of frames and points, and the default run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from lag2fmu.description.keys import BORNE, OWN, doc_key, key, unit_key
from lag2fmu.description.places import AXES, Body, End, Expression, Frame, axes_key, normalise
from lag2fmu.language.units import DIMENSIONLESS, METRE, NEWTON, RADIAN, SECOND, TORQUE, Unit

_MATRIX = tuple(f"{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3))

QUANTITIES: dict[str, tuple[str, tuple[str, ...], Unit]] = {
    "position": ("point", AXES, METRE),
    "velocity": ("point", AXES, METRE / SECOND),
    "acceleration": ("point", AXES, METRE / SECOND / SECOND),
    "angular_velocity": ("frame", AXES, RADIAN / SECOND),
    "angular_acceleration": ("frame", AXES, RADIAN / SECOND / SECOND),
    "angles": ("frame", AXES, RADIAN),
    "quaternion": ("frame", ("0", "1", "2", "3"), DIMENSIONLESS),
    "rotation": ("frame", _MATRIX, DIMENSIONLESS),
    **{f"{axis}_axis": ("frame", AXES, DIMENSIONLESS) for axis in AXES},
    "origin_velocity": ("frame", AXES, METRE / SECOND),
    "specific_force": ("frame", AXES, METRE / SECOND / SECOND),
    "mass_centre": ("bodies", AXES, METRE),
    "mass_centre_velocity": ("bodies", AXES, METRE / SECOND),
    "angular_momentum": ("bodies", AXES, TORQUE * SECOND),
    "holding_force": ("bodies", AXES, NEWTON),
    "holding_torque": ("bodies", AXES, TORQUE),
}
"""{quantity of an output: (the key it belongs to, suffixes of its entries, unit)}."""

HOLDING = ("holding_force", "holding_torque")
"""The quantities of bodies that also have a frame."""

ALONG_AXES = ("angular_velocity", "angular_acceleration", "origin_velocity", "specific_force", *HOLDING)
"""The quantities that have ``axes``, of the world or of a frame."""

ACCELERATIONS = ("acceleration", "angular_acceleration", "specific_force", *HOLDING)
"""The quantities that depend on accelerations."""

TURNING = {
    "angle": RADIAN,
    "angular_velocity": RADIAN / SECOND,
    "angular_acceleration": RADIAN / SECOND / SECOND,
}
"""{quantity of a planar body, or of a point with an angle: unit}; it has one entry, NAME."""


@dataclass(frozen=True)
class Output:
    """A further output of the FMU, by ``expression`` or as a ``quantity`` of a part.

    A ``point`` (or body, which stands for its mass centre) has, in world axes, ``position`` (m), ``velocity`` (m/s) and
    ``acceleration`` (m/s2): NAME_x, NAME_y, and NAME_z in space. A planar one with an angle also has ``angle`` (rad),
    ``angular_velocity`` (rad/s) and ``angular_acceleration`` (rad/s2): NAME alone. A ``frame`` with the rotation matrix
    R (r_world = R r) has, relative to the world:

    - ``angular_velocity`` (rad/s) and ``angular_acceleration`` (rad/s2): NAME_x, NAME_y, NAME_z in the ``axes`` of the
      "world" or of the "frame".
    - ``origin_velocity`` (m/s) and ``specific_force`` (m/s2) of its origin, likewise. The latter is the acceleration
      less that of gravity, which an accelerometer measures: at rest it is g upwards.
    - ``rotation``: NAME_11, NAME_12, ... NAME_33, R (3, 3) row by row; ``x_axis``, ``y_axis``, ``z_axis``: its columns.
    - ``quaternion``: NAME_0 ... NAME_3, the product of those of the rotations, hence smooth; e and -e are the same R.
    - ``angles`` (rad): NAME_x, NAME_y, NAME_z with R = Rx Ry Rz (Cardan), singular at NAME_y = +-pi/2.

    Some ``bodies`` together have, in world axes, ``mass_centre`` (m), its velocity ``mass_centre_velocity`` (m/s) and
    their ``angular_momentum`` (N.m.s) about it, which in the plane is NAME_z alone. With a ``frame`` they also have
    ``holding_force`` (N) and ``holding_torque`` (N.m) about its origin, in the ``axes`` of the world or of the frame:
    the sum of what all others exert on the bodies, but for gravity. A sensor in a wrist tells them of the hand.

    ``unit`` is that of the entries and need not be given with a quantity. ``dimension`` is the number of entries of
    positions; the Mechanism sets it. Source: J. Wittenburg, Dynamics of Multibody Systems, 2nd edition, chapters 2, 3.
    """

    name: str
    expression: Expression | None = key(
        "expression",
        "In t, coordinates, velocities, accelerations, inputs, parameters, forces of contacts and constraints.",
        default=None,
        names=BORNE | {"acceleration"},
        unit=OWN,
    )
    unit: Unit | str | None = unit_key(order=1)
    doc: str = doc_key(order=1)
    frame: str | Frame | None = key("part", "The frame whose quantity it is.", default=None)
    point: End | None = key("part", "The point or body whose quantity it is.", default=None)
    bodies: Sequence[str | Body] | None = key("names", "The bodies whose sum it is, see quantity.", default=None)
    quantity: str | None = key(
        (*QUANTITIES, "angle"),
        "Of a point: position, velocity, acceleration, of its angle angle and its derivatives. Of bodies: mass_centre, "
        "its velocity, angular_momentum, what holds them. Others are of a frame.",
        default=None,
    )
    axes: str = axes_key()
    dimension: int = field(default=3, compare=False)

    def __post_init__(self) -> None:
        normalise(self, f"outputs.{self.name}")
        if self.unit is None:
            object.__setattr__(self, "unit", self.own_unit)

    @property
    def own_unit(self) -> Unit | None:
        """The unit of its quantity, None without one."""
        known = TURNING | {name: unit for name, (_, _, unit) in QUANTITIES.items()}
        return known.get(str(self.quantity))

    @property
    def turning(self) -> bool:
        """Whether it is the angle of a planar body or point, or a derivative of this angle."""
        return self.point is not None and self.quantity in TURNING

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the entries as the FMU shows them, just the name for an expression."""
        if self.quantity not in QUANTITIES or self.turning:
            return (self.name,)
        key, suffixes, _ = QUANTITIES[self.quantity]
        if key != "frame":
            flat = "z" if self.quantity == "angular_momentum" else suffixes[:2]
            suffixes = tuple(flat) if self.dimension == 2 else suffixes
        return tuple(f"{self.name}_{x}" for x in suffixes)


@dataclass(frozen=True)
class Experiment:
    """The default run: stop time and communication step in s, relative tolerance."""

    stop_time: float = key("number", "In s.", default=10.0, unit=SECOND)
    step: float = key("number", "Communication step in s.", default=0.01, unit=SECOND)
    tolerance: float = key("number", "Relative tolerance of the solver.", default=1e-6)
