"""The record ``Mechanism``: what the textbook procedure asks for, with everything that follows from what is written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field, fields
from inspect import Signature, signature
from typing import Any, ClassVar

from lag2fmu.description.names import suggestion, velocity
from lag2fmu.description.parts import Constraint, in_order_of_kinds
from lag2fmu.description.record import Description
from lag2fmu.description.subsystems import Part
from lag2fmu.description.symbols import Coordinate
from lag2fmu.lazy import looked_up
from lag2fmu.mechanism.completion import completed
from lag2fmu.mechanism.name_check import check_names
from lag2fmu.mechanism.ports import input_names
from lag2fmu.mechanism.scope import Scope, fixed_parameters
from lag2fmu.mechanism.unilaterals import Unilateral

_TABLES = tuple(item.name for item in fields(Description) if item.name != "name")


@dataclass(frozen=True, init=False, eq=False)
class Mechanism(Description):
    """A mechanism as analytical mechanics describes it; complete and checked when built.

    Built in Python from symbols that ``coordinate``, ``parameter`` and ``signal`` declare, or read from text by
    ``lag2fmu.load``. Its tables are those of the ``description`` that was written, and hold what follows from it too:
    what ``parts`` bring, of which none are left; frames, coordinates and constraints of joints, norms of quaternions,
    inputs of loads, equilibria of coordinates without mass, starts that meet the constraints. ``origins`` names for
    each such thing what brings it, both by their places: {'constraints.hinge_x': 'joints.hinge'}. There are n
    coordinates and m constraints, the holonomic ones first; expressions compute in SI units. ``warnings`` lists what is
    odd but allowed: mismatching dimensions, inertia tensors that no body has. ``unilaterals`` are the ideal contacts,
    then the stops, in normal form; ``latches`` are the constraints that hold only while an expression is positive,
    which are not among the m. Two mechanisms are equal if the same is written, whatever has been derived since.
    Source of the procedure: Hand, Finch, Analytical Mechanics, section 1.9.
    """

    __signature__: ClassVar[Signature] = signature(Description)  # what help() shows as the arguments

    description: Description = field(init=False, repr=False)
    origins: Mapping[str, str] = field(init=False, repr=False)
    scope: Scope = field(init=False, repr=False)
    warnings: tuple[str, ...] = field(init=False, repr=False)
    unilaterals: tuple[Unilateral, ...] = field(init=False, repr=False)
    latches: tuple[Constraint, ...] = field(init=False, repr=False)

    def __repr__(self) -> str:
        """One line: name, title, how many of what; the text format says everything."""
        kinds = ["coordinates", "parameters", "inputs", "states", "bodies", "constraints"]
        kinds += ["contacts", "stops", "frictions"]
        counted = ", ".join(f"{len(getattr(self, kind))} {kind}" for kind in kinds if getattr(self, kind))
        return f"<Mechanism {self.name}: {self.title}; {counted}>"

    def _repr_html_(self) -> str:
        """The sketch, and a table of coordinates, parameters and inputs, for a notebook."""
        from html import escape

        picture = looked_up("lag2fmu.fmu.sketch", "picture_of")(self)
        rows = "".join(
            f"<tr><td>{item.name}</td><td>{kind}</td><td>{item.unit.si_name if item.unit else ''}</td>"
            f"<td>{escape(item.doc)}</td></tr>"
            for kind in ("coordinate", "parameter", "input")
            for item in getattr(self, f"{kind}s")
        )
        sketch = f'<div style="background: white; display: inline-block">{picture}</div>' if picture else ""
        return f"<p>{escape(repr(self)[1:-1])}</p>{sketch}<table>{rows}</table>"

    def __init__(self, name: str, **tables: Any) -> None:
        """The keywords are the tables of ``Description``.

        Raises MechanismError (UnitError for dimensions when ``strict_units``), naming part and remedy.
        """
        unknown = next((table for table in tables if table not in _TABLES), None)
        if unknown is not None:
            raise TypeError(f"Mechanism: there is no table '{unknown}'; {suggestion(unknown, _TABLES)}")
        written = Description(name, **tables)
        found = completed(written)
        vars(self).update(
            vars(found.expanded),
            description=written,
            origins=found.origins,
            scope=found.scope,
            warnings=found.warnings,
            unilaterals=found.unilaterals,
            latches=found.latches,
        )

    def __eq__(self, other: object) -> bool:
        return self.description == other.description if isinstance(other, Mechanism) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.description)

    @property
    def hybrid(self) -> bool:
        """Whether it has contacts, stops, dry friction or latches."""
        return bool(self.unilaterals or self.frictions or self.latches)

    @property
    def fixed_parameters(self) -> frozenset[str]:
        """The names of the parameters in holonomic constraints and gaps, see ``scope``: they cannot change in a run."""
        return fixed_parameters(self, self.scope, (unilateral.gap for unilateral in self.unilaterals))

    @property
    def hidden_inputs(self) -> frozenset[str]:
        """The inputs that the ports leave out of the FMU: they keep their start values."""
        chosen = self.ports.inputs
        return frozenset() if chosen is None else frozenset(input_names(self)) - frozenset(chosen)

    def part_of(self, place: str) -> str | None:
        """The name of the part that brings what stands at ``place`` ('coordinates.leg_knee'), None if none does."""
        while (origin := self.origins.get(place)) is not None:
            if origin.startswith("parts."):
                return origin.removeprefix("parts.")
            place = origin
        return None

    def parts_with(self, values: Mapping[str, float]) -> tuple[Part, ...]:
        """The parts that are written, with those of the ``values`` {name: SI value} that are of what they bring."""
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

        Raises MechanismError for a name that clashes with those of the equilibria.
        """
        found = tuple(equilibria)
        origins = {f"constraints.{c.name}": f"coordinates.{c.coordinate}" for c in found}
        new = self._extended(
            coordinates=tuple(coordinates),
            constraints=in_order_of_kinds((*self.constraints, *found)),
            origins={**self.origins, **origins},
            scope=self.scope.with_constraints(found),
        )
        check_names(new)
        return new

    def _extended(self, **changes: object) -> Mechanism:
        new = copy(self)
        vars(new).update(changes)
        return new


def complete(description: Description) -> Mechanism:
    """The mechanism that follows from ``description``; raises MechanismError as ``Mechanism`` does."""
    return Mechanism(**{item.name: getattr(description, item.name) for item in fields(Description)})
