"""The record ``Mechanism``: a description with everything that follows from it, which ``completion`` finds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field, fields
from inspect import Signature, signature
from typing import TYPE_CHECKING, Any, ClassVar, cast

from lag2fmu.description.description import Description
from lag2fmu.description.names import velocity
from lag2fmu.description.parts import Constraint, Energy, in_order_of_kinds
from lag2fmu.description.subsystems import Part
from lag2fmu.description.symbols import Coordinate
from lag2fmu.language.identifiers import suggestion
from lag2fmu.lazy import looked_up
from lag2fmu.mechanism.completed import Unilateral
from lag2fmu.mechanism.completion import completed
from lag2fmu.mechanism.norms import norm_constraints

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from lag2fmu.mechanism.keywords import Keywords

_TABLES = tuple(item.name for item in fields(Description) if item.name != "name")


@dataclass(frozen=True, init=False, eq=False)
class Mechanism(Description):
    """A mechanism as analytical mechanics describes it; complete and checked when built.

    It is built in Python from symbols that ``coordinate``, ``parameter`` and ``signal`` declare, or read from text by
    ``lag2fmu.load``. There are n coordinates and m constraints, the holonomic ones first. Expressions are in SI units.

    - ``description``: what was written. The tables of the mechanism have the same names. They also hold what follows:
      the entries of ``parts``, of which none are left; frames, coordinates and constraints of joints; norms of
      quaternions; inputs of loads; equilibria of coordinates without mass; starts that meet the constraints.
    - ``origins``: the place of each such entry, and that of what brings it: {'constraints.hinge_x': 'joints.hinge'}.
    - ``warnings``: what is odd but allowed, such as mismatching dimensions, or inertia tensors that no body has.
    - ``unilaterals``: the ideal contacts, then the stops, in normal form.
    - ``latches``: the constraints that hold only while an expression is positive; they are not among the m.
    - ``fixed_parameters``: the names of the parameters in holonomic constraints and gaps, which cannot change in a run.
    - ``hidden_inputs``: the inputs that the ports leave out of the FMU; they keep their start values.

    Two mechanisms are equal if their descriptions are, whatever has been derived since. Raises MechanismError, or
    UnitError for dimensions with ``strict_units``. Source of the procedure: Hand, Finch, Analytical Mechanics, section
    1.9.
    """

    __signature__: ClassVar[Signature] = signature(Description)  # help() shows it as the arguments

    description: Description = field(init=False, repr=False)
    origins: Mapping[str, str] = field(init=False, repr=False)
    warnings: tuple[str, ...] = field(init=False, repr=False)
    unilaterals: tuple[Unilateral, ...] = field(init=False, repr=False)
    latches: tuple[Constraint, ...] = field(init=False, repr=False)
    fixed_parameters: frozenset[str] = field(init=False, repr=False)
    hidden_inputs: frozenset[str] = field(init=False, repr=False)

    def __init__(self, name: str, **tables: Unpack[Keywords]) -> None:
        """The mechanism ``name``, an identifier, of these tables; each may be left out.

        - ``title``, ``source``, ``not_taken``, ``author``, ``version``, ``copyright``, ``license``: texts.
        - ``parameters``, ``coordinates``, ``inputs``: symbols, or the records that they declare.
        - ``states``, ``tables``, ``definitions``: further states of first order, measured data, named expressions.
        - ``energy``: kinetic, potential and dissipated energy, or the Lagrangian; ``gravity``: in m/s2.
        - ``frames``, ``bodies``, ``points``: places, and what has mass; ``visuals``: what is seen of them.
        - ``springs``, ``dampers``, ``loads``, ``forces`` (of each coordinate): what acts.
        - ``joints``, ``constraints``: what holds always, or while a condition holds.
        - ``contacts``, ``stops``, ``frictions``: what holds at times; ``impacts``: "sequential" or "simultaneous".
        - ``outputs``, ``ports``, ``experiment``: what the FMU gives and takes, and what a default run looks like.
        - ``parts``: mechanisms that this one is made of.
        - ``strict_units``: units that are missing or do not match are an error.

        Raises MechanismError (UnitError for dimensions when ``strict_units``), naming part and remedy; TypeError for
        another keyword.
        """
        unknown = next((table for table in tables if table not in _TABLES), None)
        if unknown is not None:
            of_energy = unknown in {item.name for item in fields(Energy)}
            remedy = f"give energy=Energy({unknown}=...)" if of_energy else suggestion(unknown, _TABLES)
            raise TypeError(f"Mechanism: there is no table '{unknown}'; {remedy}")
        written = Description(name, **cast("dict[str, Any]", tables))  # which makes records and tuples of them
        known = completed(written)._asdict()
        vars(self).update(vars(known.pop("expanded")) | known, description=written)

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
    def held(self) -> bool:
        """Whether laws of contacts, dry friction or constraints hold it, beside norms of quaternions."""
        return self.hybrid or not norm_constraints(self).issuperset(c.name for c in self.constraints)

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


def complete(description: Description) -> Mechanism:
    """The mechanism that follows from ``description``; raises MechanismError as ``Mechanism`` does."""
    return Mechanism(**{item.name: getattr(description, item.name) for item in fields(Description)})
