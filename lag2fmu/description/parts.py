"""The parts of a mechanism that are no variables, places or outputs: energies, springs, dampers, loads, constraints.

All are frozen; their expressions are in the normal form of ``expressions`` and compute in SI units. Parts refer to each
other by name; Python may give the part itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.keys import ANY, CONFIGURATION, GIVEN, OWN, OWN_RATE, STATE, key, unit_key
from lag2fmu.description.places import End, Expression, Vector, axes_key, normalise
from lag2fmu.errors import MechanismError
from lag2fmu.language.units import DIMENSIONLESS, JOULE, METRE, NEWTON, SECOND, TORQUE, WATT, Unit
from lag2fmu.language.vocabulary import symbol


@dataclass(frozen=True)
class Definition:
    """A name for an expression, in SI units, that other expressions use.

    Raises MechanismError for a value that is no expression.
    """

    name: str
    expression: sp.Expr = key("expression", "", names=ANY)

    def __post_init__(self) -> None:
        normalise(self, "definition")


@dataclass(frozen=True)
class Energy:
    """Energies (J) beside those of bodies and springs, or the whole Lagrangian T - V (J).

    ``dissipation`` is Rayleigh's function R (W), whose forces are -dR/dqd. Raises MechanismError for a value that is no
    expression. Source: Goldstein, Classical Mechanics, section 1.5.
    """

    kinetic: Expression | None = key("expression", "Kinetic energy T in J.", default=None, names=STATE, unit=JOULE)
    potential: Expression | None = key("expression", "Potential energy V in J.", default=None, names=STATE, unit=JOULE)
    dissipation: Expression | None = key(
        "expression", "Rayleigh's function R in W: the force is -dR/dqd.", default=None, names=STATE, unit=WATT
    )
    lagrangian: Expression | None = key(
        "expression", "The whole Lagrangian L in J, instead of T and V.", default=None, names=STATE, unit=JOULE
    )

    def __post_init__(self) -> None:
        normalise(self, "energy")


@dataclass(frozen=True)
class Gravity:
    """Uniform gravity: ``acceleration`` (m/s2) along ``direction`` (2 or 3 entries; by default -y or -z)."""

    acceleration: Expression = key("expression", "In m/s2.", names=CONFIGURATION, unit=METRE / SECOND / SECOND)
    direction: Vector | None = key(
        "vector",
        "2 entries, 3 in space; by default along -y, in space along -z.",
        default=None,
        names=GIVEN,
        unit=DIMENSIONLESS,
    )

    def __post_init__(self) -> None:
        if isinstance(self.acceleration, (tuple, list)):
            raise MechanismError(
                f"gravity.acceleration: expected the size alone, got {self.acceleration!r}; where gravity acts is its "
                "'direction', as in Gravity(9.81, (0, -1))"
            )
        normalise(self, "gravity")


# ----------------------------------------------------------------------------------------------------------- forces


def between_key() -> Any:
    """The field of the two ends of a spring or damper."""
    return key("names", "The two ends: names of points or bodies.", default=None)


@dataclass(frozen=True)
class Spring:
    """A linear spring: ``elongation`` as an expression, or ``between`` two points or bodies with natural ``length``.

    ``stiffness`` k is in N/m, elongation and length are in m; for a torsion spring in N.m/rad and rad.
    V = 1/2 k elongation^2. Source: Hand, Finch, Analytical Mechanics, chapter 1.
    """

    name: str
    stiffness: Expression = key("expression", "In N/m, of an angle in N.m/rad.", names=CONFIGURATION)
    elongation: Expression | None = key(
        "expression", "By how much it is longer than at rest; or give 'between'.", default=None, names=CONFIGURATION
    )
    between: Sequence[End] | None = between_key()
    length: Expression | None = key(
        "expression", "The length at rest in m, with 'between'.", default=None, names=CONFIGURATION, unit=METRE
    )

    def __post_init__(self) -> None:
        normalise(self, f"springs.{self.name}")


@dataclass(frozen=True)
class Damper:
    """A damper: ``rate`` of elongation as an expression, or ``between`` two points or bodies.

    A linear damper has the ``damping`` c in N.s/m and a ``rate`` in m/s; if it turns, N.m.s/rad and rad/s. Then
    R = 1/2 c rate^2. Any other damper has a ``force`` in N (N.m), in which the name "rate" stands for its own rate. A
    positive force opposes a positive rate: Q = -force d(rate)/dqd. Source: Goldstein, Classical Mechanics, section 1.5.
    """

    name: str
    damping: Expression | None = key(
        "expression", "In N.s/m, of an angle in N.m.s/rad.", default=None, names=CONFIGURATION
    )
    force: Expression | None = key(
        "expression",
        "In N, of an angle in N.m, instead of damping: what opposes the rate, which is called rate in it.",
        default=None,
        names=ANY | {OWN_RATE},
    )
    rate: Expression | None = key(
        "expression", "The velocity it opposes; or give 'between'.", default=None, names=STATE
    )
    between: Sequence[End] | None = between_key()

    def __post_init__(self) -> None:
        normalise(self, f"dampers.{self.name}")

    def force_at(self, rate: sp.Expr) -> sp.Expr:
        """The force, of a damper that has one, as an expression of ``rate``."""
        return sp.sympify(self.force).xreplace({symbol(names.DAMPER_RATE): rate})


@dataclass(frozen=True)
class Force:
    """A generalized non-potential force Q on one coordinate: in N, or N.m for an angle; Q qd is its power, in W.

    On a prescribed motion it is a load that the drive of the motion has to overcome; nothing else feels it.
    """

    coordinate: str
    expression: Expression = key("expression", "", names=ANY)

    def __post_init__(self) -> None:
        object.__setattr__(self, "coordinate", str(self.coordinate))
        normalise(self, f"forces.{self.coordinate}")


@dataclass(frozen=True)
class Load:
    """A force (N) at a ``point`` (or at a body's mass centre), or a ``torque`` (N.m) on a ``body``.

    The torque on a planar body is one expression, on a spatial one (of a frame) 3. The entries are along the ``axes``
    of the "world" or of the "frame" of point or body. With ``input=True`` and no value the load itself becomes FMU
    inputs: NAME_x, NAME_y (NAME_z) for a force, NAME for a planar torque, NAME_x, NAME_y, NAME_z for a spatial one.
    """

    name: str
    point: End | None = key("part", "The point or body the force acts at.", default=None)
    body: End | None = key("part", "The body the force or the torque acts on.", default=None)
    force: Sequence[Expression] | None = key("vector", "Entries in N.", default=None, names=ANY, unit=NEWTON)
    torque: Expression | Sequence[Expression] | None = key(
        "expression or vector", "In N.m; 3 entries in space.", default=None, names=ANY, unit=TORQUE
    )
    input: bool = key("flag", "true: the load is an input of the FMU and has no value here.", default=False)
    axes: str = axes_key()

    def __post_init__(self) -> None:
        normalise(self, f"loads.{self.name}")


# ------------------------------------------------------------------------------------------------------ constraints


KINDS = ("holonomic", "equilibrium", "nonholonomic", "damped_equilibrium")


@dataclass(frozen=True)
class Constraint:
    """``expression`` = 0: holonomic in t, q and motions, or nonholonomic and affine in the velocities.

    The derivation adds two further kinds. An ``equilibrium`` of the forces on a coordinate without mass may contain all
    inputs, and ties the coordinates without a force of its own. A ``damped_equilibrium`` ties velocities.

    ``unit`` is that of the expression; None if it follows from the units of the names in it. With ``while_`` the
    constraint holds only while that expression is above 0: latches, grippers, release. Raises MechanismError for an
    unknown kind. Source: Goldstein, Classical Mechanics, section 2.4.
    """

    name: str
    expression: Expression = key("expression", "What is zero.", names=CONFIGURATION, unit=OWN)
    kind: str = "holonomic"
    unit: Unit | str | None = unit_key()
    while_: Expression | None = key(
        "expression", "It holds while this is above 0; by default always.", default=None, name="while", names=ANY
    )

    def __post_init__(self) -> None:
        normalise(self, f"constraints.{self.name}")
        if not isinstance(self.kind, str) or self.kind not in KINDS:
            raise MechanismError(f"constraints.{self.name}: '{self.kind}' is no kind; give one of {', '.join(KINDS)}")

    @property
    def holonomic(self) -> bool:
        """Whether it restricts the coordinates themselves, not only the velocities."""
        return self.kind in KINDS[:2]

    @property
    def massless(self) -> bool:
        """Whether it is the equilibrium of the forces on a coordinate without mass."""
        return self.kind.endswith("equilibrium")

    @property
    def coordinate(self) -> str | None:
        """The coordinate without mass that it is solved for, with friction its velocity; None for other kinds."""
        return names.coordinate_of_massless(self.name) if self.massless else None


def in_order_of_kinds(constraints: Iterable[Constraint]) -> tuple[Constraint, ...]:
    """``constraints``, the holonomic ones first; those of one kind stay in their order."""
    return tuple(sorted(constraints, key=lambda item: KINDS.index(item.kind)))
