"""The record ``Mechanism``: a description with everything that follows from it; and the records in it.

Nothing is computed here. ``completion`` finds what follows, and has the constructor that users meet.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field
from typing import NamedTuple

import sympy as sp

from lag2fmu.description.names import velocity
from lag2fmu.description.parts import Constraint, in_order_of_kinds
from lag2fmu.description.record import Description
from lag2fmu.description.subsystems import Part
from lag2fmu.description.symbols import Coordinate
from lag2fmu.language.units import Unit
from lag2fmu.lazy import looked_up


class Unilateral(NamedTuple):
    """A gap >= 0 with its laws of impact and friction; all are expressions in SI, which may contain definitions.

    ``gap`` depends on t, q, motions and parameters, and has the ``unit`` (None: unknown). ``slips`` are affine in the
    velocities, in the gap's unit per s; there is none without friction, one in the plane, two in space.
    ``restitution`` is Newton's coefficient, ``friction`` and ``static_friction`` are Coulomb's. ``where`` is the place
    of the contact or stop in the mechanism.
    """

    name: str
    gap: sp.Expr
    slips: tuple[sp.Expr, ...]
    restitution: sp.Expr
    friction: sp.Expr
    static_friction: sp.Expr
    unit: Unit | None
    where: str


class Completed(NamedTuple):
    """What follows from a description: the description with everything written out, ``expanded``, and further results.

    ``latches`` are the constraints that hold only while an expression is positive; all others are in ``expanded``. The
    other fields are explained in ``completion.Mechanism``.
    """

    expanded: Description
    origins: Mapping[str, str]
    warnings: tuple[str, ...]
    unilaterals: tuple[Unilateral, ...]
    latches: tuple[Constraint, ...]
    fixed_parameters: frozenset[str]
    hidden_inputs: frozenset[str]


@dataclass(frozen=True, init=False, eq=False)
class Mechanism(Description):
    """A mechanism that is complete and checked: its tables, and what else follows from what was written.

    Derivation and reference read this record. ``completion.Mechanism`` is the same with a constructor for users; it
    explains each field.
    """

    description: Description = field(init=False, repr=False)
    origins: Mapping[str, str] = field(init=False, repr=False)
    warnings: tuple[str, ...] = field(init=False, repr=False)
    unilaterals: tuple[Unilateral, ...] = field(init=False, repr=False)
    latches: tuple[Constraint, ...] = field(init=False, repr=False)
    fixed_parameters: frozenset[str] = field(init=False, repr=False)
    hidden_inputs: frozenset[str] = field(init=False, repr=False)

    def __init__(self, description: Description, found: Completed) -> None:
        """Take the ``description`` as it was written, and what was ``found`` to follow from it."""
        known = found._asdict()
        vars(self).update(vars(known.pop("expanded")) | known, description=description)

    def __repr__(self) -> str:
        """One line: name, title, and the numbers of coordinates and other entries."""
        kinds = ["coordinates", "parameters", "inputs", "states", "bodies", "constraints"]
        kinds += ["contacts", "stops", "frictions"]
        counted = ", ".join(f"{len(getattr(self, kind))} {kind}" for kind in kinds if getattr(self, kind))
        return f"<Mechanism {self.name}: {self.title}; {counted}>"

    def _repr_html_(self) -> str:
        """The sketch, and a table of coordinates, parameters and inputs, for a notebook."""
        from html import escape

        picture = looked_up("lag2fmu.fmu.picture", "picture_of")(self)
        rows = "".join(
            f"<tr><td>{item.name}</td><td>{kind}</td><td>{item.unit.si_name if item.unit else ''}</td>"
            f"<td>{escape(item.doc)}</td></tr>"
            for kind in ("coordinate", "parameter", "input")
            for item in getattr(self, f"{kind}s")
        )
        sketch = f'<div style="background: white; display: inline-block">{picture}</div>' if picture else ""
        return f"<p>{escape(repr(self)[1:-1])}</p>{sketch}<table>{rows}</table>"

    def __eq__(self, other: object) -> bool:
        return self.description == other.description if isinstance(other, Mechanism) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.description)

    @property
    def hybrid(self) -> bool:
        """Whether it has contacts, stops, dry friction or latches."""
        return bool(self.unilaterals or self.frictions or self.latches)

    @property
    def has_input_rates(self) -> bool:
        """Whether the equations contain the time derivatives of inputs.

        There are two cases. Forces move the equilibrium of a coordinate without mass; if this is a constraint, its
        derivatives contain the rates of the forces. And filters of motions use the derivatives of their targets.
        """
        return bool(self.filtered) or any(c.massless for c in self.constraints)

    def part_of(self, place: str) -> str | None:
        """The name of the part that brings the entry at ``place`` ('coordinates.leg_knee'), None if none does."""
        while (origin := self.origins.get(place)) is not None:
            if origin.startswith("parts."):
                return origin.removeprefix("parts.")
            place = origin
        return None

    def parts_with(self, values: Mapping[str, float]) -> tuple[Part, ...]:
        """The parts as written, but with the ``values`` {name: SI value} that belong to their entries."""
        tables = ("coordinates", "parameters", "inputs", "states")
        of: dict[str, dict[str, float]] = {part.name: {} for part in self.description.parts}
        for name, value in values.items():
            places = (f"{table}.{x}" for table in tables for x in (name, name.removesuffix(velocity(""))))
            for part in {self.part_of(place) for place in places} & of.keys():
                of[str(part)][name] = value
        return tuple(part.setting(of[part.name]) for part in self.description.parts)

    def starting_at(self, coordinates: Iterable[Coordinate]) -> Mechanism:
        """The same mechanism with these ``coordinates``, which have other starts only; nothing is checked again."""
        return self._extended(coordinates=tuple(coordinates))

    def with_equilibria(self, equilibria: Iterable[Constraint], coordinates: Iterable[Coordinate]) -> Mechanism:
        """The same mechanism with the ``equilibria`` of coordinates without mass, and ``coordinates`` that follow them.

        The caller has to check that names do not clash.
        """
        found = tuple(equilibria)
        origins = {f"constraints.{c.name}": f"coordinates.{c.coordinate}" for c in found}
        return self._extended(
            coordinates=tuple(coordinates),
            constraints=in_order_of_kinds((*self.constraints, *found)),
            origins={**self.origins, **origins},
        )

    def _extended(self, **changes: object) -> Mechanism:
        new = copy(self)
        vars(new).update(changes)
        return new
