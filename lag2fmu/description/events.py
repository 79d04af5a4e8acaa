"""The records of contacts, stops, dry friction and further states.

All are frozen; their expressions are in the normal form of ``expressions`` and compute in SI units.
Sources: Ch. Glocker, Set-Valued Force Laws, Springer 2001; F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral
Contacts, Wiley 1996; compliant contacts: K. H. Hunt, F. R. E. Crossley, Coefficient of Restitution Interpreted as
Damping in Vibroimpact, J. Applied Mechanics 42 (1975) 440-445.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from lag2fmu.description.keys import ANY, BORNE, CONFIGURATION, CONSTANT, STATE, doc_key, key, unit_key
from lag2fmu.description.places import End, Expression, checked_axis, normalise
from lag2fmu.description.tables import Table
from lag2fmu.errors import MechanismError
from lag2fmu.language.units import DIMENSIONLESS, METRE, SECOND, Unit

__all__ = ["Contact", "Friction", "State", "Stop", "Table"]

IMPACTS = ("sequential", "simultaneous")
"""How several contacts share an impact: round after round, or in one problem over all that touch."""

LAWS = ("ideal", "compliant")
"""What a contact is: rigid, or a spring with a damper."""


class ContactKind(NamedTuple):
    """A kind of contact: the entries of its positions, the number of ``radii`` and ``lengths``, if it has a normal."""

    entries: int
    radii: int
    normal: bool
    lengths: int = 0


CONTACTS = {
    "point_line": ContactKind(2, 0, normal=True),
    "disc_line": ContactKind(2, 1, normal=True),
    "disc_disc": ContactKind(2, 2, normal=False),
    "point_disc": ContactKind(2, 1, normal=False),
    "point_plane": ContactKind(3, 0, normal=True),
    "sphere_plane": ContactKind(3, 1, normal=True),
    "sphere_sphere": ContactKind(3, 2, normal=False),
    "point_sphere": ContactKind(3, 1, normal=False),
    "ellipsoid_plane": ContactKind(3, 3, normal=True),
    "capsule_sphere": ContactKind(3, 2, normal=False, lengths=1),
    "capsule_capsule": ContactKind(3, 2, normal=False, lengths=2),
}
"""The contacts between two places by name."""


@dataclass(frozen=True)
class Contact:
    """A unilateral contact, 0 <= gap and 0 <= force, one of them 0, with friction by Coulomb and impacts by Newton.

    ``gap`` is in m or rad. ``slip`` is the relative tangential velocity (m/s, rad/s), affine in the velocities; in
    space there are two. Instead of both, one of the kinds ``CONTACTS`` may stand ``between`` two frames, points or
    bodies. The first of them is the point, disc or sphere that touches, the second one is touched. A ``normal`` ("x",
    "y", "z" or its entries) is fixed in the second end and goes through it, out of its line or plane. ``radius`` (m)
    is that of the disc or sphere; a pair of them has two; for a point against a disc or sphere it is that of the
    latter; an ellipsoid has three along the axes of its frame, one of them 0 for a flat disc. ``length`` (m) is the
    distance between the centres of a capsule's ends, along z of its frame about the place.

    ``restitution`` is Newton's coefficient, ``friction`` the coefficient of sliding friction, ``static_friction`` that
    of sticking, by default the same. They may change with the state, inputs and time: each round of impacts takes the
    restitution at the velocities before it, and all rounds take the friction before the first. With the ``law``
    "compliant" the force on a penetration d is stiffness d^1.5 (1 + damping d_dot), in N, and never pulls;
    ``stiffness`` is in N/m^1.5, ``damping`` in s/m. Friction is then regularised by ``slip_speed`` (m/s). Raises
    MechanismError for a value of another form. Source: Hunt, Crossley, J. Applied Mechanics 42 (1975) 440-445;
    Pfeiffer, Glocker, chapter 4.
    """

    name: str
    gap: Expression | None = key(
        "expression", "What is never negative, in m or rad.", default=None, names=CONFIGURATION
    )
    slip: Expression | Sequence[Expression] | None = key(
        "expression or vector",
        "The relative tangential velocity, affine in the velocities; two of them in space. Friction needs it.",
        default=None,
        names=STATE,
    )
    restitution: Expression = key(
        "expression",
        "Newton's coefficient, 0 to 1, which may change with place, speed and inputs; by default 0.",
        default=0,
        names=ANY,
        unit=DIMENSIONLESS,
    )
    friction: Expression = key(
        "expression",
        "The coefficient of sliding friction, which may change with place, speed and inputs; by default 0.",
        default=0,
        names=ANY,
        unit=DIMENSIONLESS,
    )
    static_friction: Expression | None = key(
        "expression",
        "The coefficient of sticking friction; by default that of sliding.",
        default=None,
        names=ANY,
        unit=DIMENSIONLESS,
    )
    kind: str | None = key(tuple(CONTACTS), "Instead of gap and slip: what touches what.", default=None)
    between: Sequence[End] | None = key(
        "names", "Two frames, points or bodies: what touches, then what it touches.", default=None
    )
    normal: str | Sequence[Expression] | None = key(
        "axis",
        "Of a line or plane: out of it, fixed in the second; x, y, z or its 2 or 3 entries.",
        default=None,
        names=CONSTANT,
    )
    radius: Expression | Sequence[Expression] | None = key(
        "expression or vector",
        "In m; two of a pair of discs, spheres or capsules, three of an ellipsoid.",
        default=None,
        names=CONSTANT,
        unit=METRE,
    )
    length: Expression | Sequence[Expression] | None = key(
        "expression or vector",
        "Of a capsule, between the centres of its ends, in m; two of a pair.",
        default=None,
        names=CONSTANT,
        unit=METRE,
    )
    law: str = key(LAWS, "ideal: rigid; compliant: a spring with a damper by Hunt and Crossley.", default="ideal")
    stiffness: Expression | None = key(
        "expression", "Of a compliant contact: k in k*d**1.5, in N/m^1.5.", default=None, names=CONSTANT
    )
    damping: Expression | None = key(
        "expression",
        "Of a compliant contact: c in 1 + c*d_dot, in s/m; by default 0.",
        default=None,
        names=CONSTANT,
    )
    slip_speed: Expression | None = key(
        "expression",
        "Of a compliant contact with friction: below it the friction fades, in m/s.",
        default=None,
        names=CONSTANT,
    )

    def __post_init__(self) -> None:
        where = f"contacts.{self.name}"
        normalise(self, where)
        if self.normal is not None:
            object.__setattr__(self, "normal", checked_axis(self._normal_in_space(), f"{where}.normal"))

    def _normal_in_space(self) -> object:
        """The normal with 3 entries; in the plane two may be written, and the third is 0."""
        planar = self.kind in CONTACTS and CONTACTS[self.kind].entries == 2
        if planar and isinstance(self.normal, (tuple, list)) and len(self.normal) == 2:
            return (*self.normal, 0)
        return self.normal

    @property
    def frictionless(self) -> bool:
        """Whether both coefficients of friction are the number 0."""
        return self.friction == 0 and self.static_friction in (None, 0)


@dataclass(frozen=True)
class Stop:
    """Hard limits of an expression, ``lower`` <= ``of`` <= ``upper``, in m or rad; one of the two may be absent.

    ``restitution`` is Newton's coefficient of an impact on either; it may change as that of a contact does.
    """

    name: str
    of: Expression = key("expression", "What is limited, in m or rad.", names=CONFIGURATION)
    lower: Expression | None = key("expression", "Its smallest value.", default=None, names=CONFIGURATION)
    upper: Expression | None = key("expression", "Its largest value.", default=None, names=CONFIGURATION)
    restitution: Expression = key(
        "expression",
        "Newton's coefficient, 0 to 1, which may change with place, speed and inputs; by default 0.",
        default=0,
        names=ANY,
        unit=DIMENSIONLESS,
    )

    def __post_init__(self) -> None:
        normalise(self, f"stops.{self.name}")


@dataclass(frozen=True)
class Friction:
    """Dry friction along one relative velocity ``on`` (m/s or rad/s), affine in the velocities.

    While it slides, ``force`` (N or N.m, >= 0) opposes it; while it sticks, it holds up to ``static``, by default the
    same. Both may use what constraints, joints and contacts bear: multiplier_NAME, NAME_force.
    """

    name: str
    on: Expression = key("expression", "The relative velocity, affine in the velocities.", names=STATE)
    force: Expression = key("expression", "The sliding force or torque, not negative.", names=BORNE)
    static: Expression | None = key(
        "expression",
        "The largest holding force; by default force.",
        default=None,
        names=BORNE,
    )

    def __post_init__(self) -> None:
        normalise(self, f"frictions.{self.name}")


@dataclass(frozen=True)
class State:
    """A further state of first order: ``start`` and ``nominal`` in SI units, ``derivative`` in its unit per s.

    ``moves`` names the filtered motion of which the state is position or velocity; the Mechanism sets it. Raises
    MechanismError without a derivative.
    """

    name: str
    unit: Unit | str | None = unit_key()
    start: float = key("number", "Its value at the start, in the unit.", default=0.0)
    derivative: Expression = key("expression", "Its time derivative.", default=None, names=BORNE)
    nominal: float = key(
        "difference", "Typical size, in the unit; the solvers' errors are measured by it.", default=1.0
    )
    doc: str = doc_key()
    moves: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if self.derivative is None:
            raise MechanismError(f"states.{self.name}: 'derivative' is missing; give the expression of its rate")
        normalise(self, f"states.{self.name}")

    @property
    def rate_unit(self) -> Unit | None:
        """The unit of the derivative, None if the state has none."""
        return self.unit / SECOND if isinstance(self.unit, Unit) else None
