"""The names that an expression of a mechanism may use, and the meaning of each of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from copy import copy
from typing import Any

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description, Entry
from lag2fmu.description.keys import CONFIGURATION, CONSTANT, OWN_RATE, STATE
from lag2fmu.description.parts import Constraint
from lag2fmu.description.tables import Table
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.remedies import of_symbol
from lag2fmu.language.vocabulary import TableCall
from lag2fmu.mechanism.order import in_order


class Scope:
    """The names that an expression may use, and the meaning of each of them."""

    def __init__(self, m: Description) -> None:
        self.meaning = _meanings(m)
        self.shown = _shown(m)
        self.uses: dict[str, set[str]] = {}
        """{definition: the names it uses, with further definitions written out}."""
        for d in in_order(m.definitions, "definitions"):
            self.uses[d.name] = self.names_in(f"definitions.{d.name}", d.expression)

    def with_constraints(self, constraints: Iterable[Constraint]) -> Scope:
        """The same scope, in which expressions may also use the multipliers of ``constraints``."""
        new = copy(self)
        new.meaning = self.meaning | {names.multiplier(c.name): "multiplier" for c in constraints}
        return new

    def names_in(self, where: str, expression: sp.Expr, allowed: Collection[str] | None = None) -> set[str]:
        """The names ``expression`` uses, definitions written out.

        Raises MechanismError for an unknown one; the remedy has names of the ``allowed`` meanings, by default of all.
        """
        found: set[str] = set()
        for name in sorted(free_names([expression])):
            if name not in self.meaning:
                fits = [x for x, what in self.meaning.items() if allowed is None or what in {*allowed, "definition"}]
                given = f"each FMU has it as a variable, and --output {name} makes it an output"
                remedy = given if name in self.shown else of_symbol(name, fits)
                raise MechanismError(f"{where}: undefined symbol '{name}'; {remedy}")
            found |= self.uses.get(name, {name})
        return found


def _meanings(m: Description) -> dict[str, str]:
    """{name: its meaning}; of two things with one name, which another check reports, it is that of the last one."""
    meaning = {"t": "time"}
    if any(damper.force is not None for damper in m.dampers):
        meaning[names.DAMPER_RATE] = OWN_RATE
    for q in m.coordinates:
        meaning |= {q.name: "coordinate", names.velocity(q.name): "velocity"}
        meaning |= {names.acceleration(q.name): "acceleration", names.generalized_force(q.name): "external force"}
    for u in m.plain_inputs:
        meaning[u.name] = "input"
    for u in m.motions:
        meaning |= {u.name: "motion", names.velocity(u.name): "motion velocity"}
        meaning[names.acceleration(u.name)] = "motion acceleration"
    meaning |= {names.multiplier(c.name): "multiplier" for c in m.constraints}
    meaning |= {names.force(name): "contact force" for name in m.unilateral_names}
    groups: tuple[tuple[str, tuple[Any, ...]], ...] = (
        ("parameter", m.parameters),
        ("further state", m.states),
        ("definition", m.definitions),
    )
    for what, parts in groups:
        meaning |= {part.name: what for part in parts}
    for name in m.filtered:
        meaning |= {name: "motion", names.velocity(name): "motion velocity"}
    return meaning


def _shown(m: Description) -> frozenset[str]:
    """The names of variables that an FMU shows, of which only some may stand in expressions."""
    parts = (
        *(names.of_coordinate(q.name) for q in m.coordinates),
        *(names.of_constraint(c.name) for c in m.constraints),
        *map(names.of_unilateral, m.unilateral_names),
        *(names.of_friction(friction.name) for friction in m.frictions),
    )
    return frozenset({*names.ENERGIES, *(name for part in parts for name in part)})


def check_symbols(m: Description, scope: Scope) -> None:
    """Raise MechanismError for the first expression that uses a name which cannot stand there."""
    in_order([p for p in m.parameters if p.expression is not None], "parameters")
    tables = {table.name: table for table in m.tables}
    for entry in m.entries():
        _check_calls(entry, tables)
        of_kind = isinstance(entry.part, Constraint) and entry.key.field == "expression"
        allowed = _kind_allows(entry.part) if of_kind else entry.key.names
        for name in sorted(scope.names_in(entry.where, entry.expression, allowed)):
            meaning = scope.meaning[name]
            if meaning not in allowed:
                remedy = _remedy(entry.table, entry.key.field, meaning)
                raise MechanismError(
                    f"{entry.where}: '{name}' is {_article(meaning)} {meaning} and cannot stand here{remedy}"
                )


def _check_calls(entry: Entry, tables: Mapping[str, Table]) -> None:
    """Raise MechanismError for a call of an unknown table, with a wrong number of arguments, or in a constant."""
    for call in sorted(entry.expression.atoms(TableCall), key=str):
        table = tables.get(call.table)
        if table is None:
            remedy = suggestion(call.table, tables)
            raise MechanismError(f"{entry.where}: there is no table '{call.table}'; {remedy}")
        if len(call.args) != table.arity:
            raise MechanismError(
                f"{entry.where}: '{call}' has {len(call.args)} argument(s), the table has {table.arity}; give as many"
            )
        if entry.key.names == CONSTANT:
            raise MechanismError(f"{entry.where}: '{call}': a table cannot stand in a constant; write its value")


_LOADS = ("multiplier", "contact force")
_REMEDIES: tuple[tuple[Collection[str], Collection[str], Collection[str], str], ...] = (
    (
        ("bodies",),
        ("mass", "inertia"),
        (),
        "a mass or an inertia may use t and parameters, energy.kinetic coordinates, too",
    ),
    ((), (), ("input",), "a signal that moves a support is declared with motion = true"),
    (
        ("forces", "dampers", "loads"),
        (),
        ("acceleration",),
        "what is in proportion to it is inertia, and belongs to a kinetic energy or a mass",
    ),
    (("constraints",), (), ("velocity",), "a constraint on velocities belongs to the nonholonomic ones"),
    (("contacts", "stops"), ("gap", "of"), ("velocity",), "a gap is between places, and its rate follows from them"),
    (("definitions",), (), _LOADS, "write it where a force, a friction or an output needs it"),
    ((), ("while_",), _LOADS, "a further state may, whose rate is 0 up to a load: max(abs(load) - limit, 0)"),
    (("constraints",), (), ("further state",), "a force may use it"),
    (
        ("energy",),
        (),
        ("further state",),
        "what has an energy is a coordinate, whose rate a nonholonomic constraint may give",
    ),
)
"""Tables, fields and meanings, each empty for all of them, and what helps where such a name cannot stand there."""


def _remedy(table: str, field: str, meaning: str) -> str:
    for tables, fields, meanings, remedy in _REMEDIES:
        pairs = (table, tables), (field, fields), (meaning, meanings)
        if all(not allowed or name in allowed for name, allowed in pairs):
            return f"; {remedy}"
    return ""


def _kind_allows(constraint: Constraint) -> frozenset[str]:
    """The meanings of names that a constraint of this kind may use."""
    state = CONFIGURATION if constraint.holonomic else STATE
    inputs = {"input", "external force", "motion velocity", "motion acceleration", "further state"}
    return state | inputs if constraint.massless else state


def _article(noun: str) -> str:
    return "an" if noun[0] in "aeiou" else "a"


def check_constraints(m: Description, scope: Scope) -> None:
    """Raise MechanismError unless a holonomic constraint contains a coordinate, a nonholonomic one a velocity."""
    for constraint in m.constraints:
        where = f"constraints.{constraint.kind}.{constraint.name}"
        meanings = {scope.meaning[name] for name in scope.names_in(where, constraint.expression)}
        wanted = "coordinate" if constraint.holonomic else "velocity"
        if wanted not in meanings:
            held = not constraint.holonomic and "coordinate" in meanings
            other = "; it belongs to the holonomic ones" if held else "; leave it out or correct it"
            raise MechanismError(
                f"{where}: '{constraint.expression}' contains no {wanted}, so it cannot restrict the motion{other}"
            )
        solved = {names.massless(q.name) for q in m.coordinates}
        if constraint.massless and constraint.name not in solved:
            raise MechanismError(
                f"{where}: an equilibrium has the name of the coordinate without mass that it determines; give it one "
                f"of the names {', '.join(sorted(solved))}"
            )


def constrained(m: Description, scope: Scope) -> tuple[frozenset[str], frozenset[str]]:
    """The coordinates that constraints restrict, and those whose velocities they restrict.

    An equilibrium restricts only the coordinate without mass, which follows the others. Constraints that hold at times
    only, which are latches, determine no start.
    """
    if not m.constraints:
        return frozenset(), frozenset()
    used = {
        c: {names.velocity(c.coordinate), *([c.coordinate] if c.holonomic else [])}
        if c.coordinate is not None
        else scope.names_in(f"constraints.{c.kind}.{c.name}", c.expression)
        for c in m.constraints
        if c.while_ is None
    }
    places = {name for c, found in used.items() if c.holonomic for name in found}
    rates = places | {q.name for q in m.coordinates for found in used.values() if names.velocity(q.name) in found}
    known = {q.name for q in m.coordinates}
    return frozenset(places & known), frozenset(rates & known)


def fixed_parameters(m: Description, scope: Scope, gaps: Iterable[sp.Expr] = ()) -> frozenset[str]:
    """The parameters in holonomic constraints and gaps; of a dependent one also the parameters it depends on.

    They cannot change in a run, because coordinates are continuous. The parameters of an equilibrium may change: the
    coordinate without mass follows at once.
    """
    dependent = {p.name: p.expression for p in m.parameters if p.expression is not None}
    found: set[str] = set()
    holonomic = [c for c in m.holonomic if not c.massless]
    left = [name for c in holonomic for name in scope.names_in(f"constraints.{c.kind}.{c.name}", c.expression)]
    left += [name for gap in gaps for name in scope.names_in("gap", gap)]
    while left:
        name = left.pop()
        if scope.meaning[name] == "parameter" and name not in found:
            found.add(name)
            left += [s.name for s in dependent[name].free_symbols] if name in dependent else []
    return frozenset(found)


def check_presence(m: Description, scope: Scope) -> None:
    """Raise MechanismError unless every coordinate appears in an energy, dissipation or position."""
    used: set[str] = set()
    acting = {force.coordinate: f"forces.{force.coordinate}" for force in m.forces}
    for entry in m.entries():
        found = scope.names_in(entry.where, entry.expression)
        if entry.table in ("energy", "frames", "bodies", "points", "springs", "dampers", "constraints"):
            used |= found
        elif entry.table in ("contacts", "stops", "frictions"):
            acting = dict.fromkeys(found, entry.where) | acting
    for q in m.coordinates:
        its = (q.name, names.velocity(q.name))
        if used.isdisjoint(its):
            where = next((acting[name] for name in its if name in acting), None)
            remedy = f"{where} acts on it: give what moves there a mass or inertia" if where else "leave it out"
            raise MechanismError(
                f"coordinates.{q.name}: appears in no energy, frame, body, spring, damper or constraint; {remedy}"
            )
