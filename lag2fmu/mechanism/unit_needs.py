"""Which quantities without a unit have a dimension? What an expression says of them is one linear equation each.

The exponents of every unknown unit are unknowns. An expected dimension, the terms of a sum and the argument of a
function each demand that two dimensions are equal; elimination tells the unknown ones that this determines. Source: A.
Kennedy, Dimension types, ESOP 1994 (units are inferred by solving linear equations for their exponents).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.events import State
from lag2fmu.description.symbols import Coordinate, Input, Parameter
from lag2fmu.language.dimensions import ONE, Dimension, describe, dimension
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.units import SECOND
from lag2fmu.language.vocabulary import Choice, Smooth, TableCall

Exponents = dict[str, Fraction]
"""{base unit, or name whose unit is unknown: exponent}; base units have the names 'unit 0', 'unit 1' ..."""

Part = Parameter | Input | Coordinate | State
_TABLES = {Parameter: "parameters", Input: "inputs", Coordinate: "coordinates", State: "states"}
_TORQUES = {dimension(parse_unit(text).exponents): text for text in ("N.m", "N.m.s")}
_OF_FORCES = ("forces.", "loads.", "frictions.", "springs.", "dampers.")
"""Places where what has the dimension of an energy is a torque."""
_SAME = (sp.Min, sp.Max, sp.Abs, Smooth)
_EQUAL = (sp.Add, *_SAME, sp.atan2)


Expected = tuple[str, sp.Expr, Dimension | None]
"""(place, expression, the dimension that it should have, None where any will do)."""


def needed_units(
    m: Description,
    known: Mapping[str, Dimension | None],
    tables: Mapping[str, tuple[Dimension | None, ...]],
    expected: Sequence[Expected],
) -> Iterator[str]:
    """One sentence for each parameter, input, coordinate, state or table without units whose use has a dimension.

    ``known``: {name: its dimension, None if it is unknown}; ``tables``: of the arguments and the value of each table.
    Of parameters whose product alone has a dimension the last one needs a unit, as long as the others have none.
    """
    for part, needed in determined_dimensions(m, known, tables, expected, [p.name for p in m.parameters]):
        if needed == ONE:
            continue
        place = next((where for where, expression, _ in expected if _uses(m, expression, part.name)), "its use")
        unit = described_in(place, needed)
        value = part.value if isinstance(part, Parameter) else None
        it, remedy = ("it", "") if value is None else (f"{value:g}", f", or the unit that {value:g} is in")
        yield (
            f"{_TABLES[type(part)]}.{part.name}: {it} has no unit, and {place} needs one with the dimension of {unit}; "
            f'give unit = "{unit}"{remedy}'
        )
    yield from _bare_tables(m, _equations(m, known, tables, expected), expected)


def _bare_tables(m: Description, equations: _Equations, expected: Sequence[Expected]) -> Iterator[str]:
    """One sentence for each table without units of which a column has a dimension by its use."""
    for table in (table for table in m.tables if not table.units):
        places = [where for where, expression, _ in expected if _calls(m, expression, table.name)]
        keys = [*(_argument(table.name, i) for i in range(table.arity)), _value(table.name)]
        needed = [equations.solved(key) or ONE for key in keys]
        if places and any(d != ONE for d in needed):
            units = ", ".join(f'"{described_in(places[0], d)}"' for d in needed)
            yield (
                f"tables.{table.name}: its columns have no units, and {places[0]} needs some with the dimensions of "
                f"{units}; give units = [{units}], or the units that its numbers are in"
            )


def determined_dimensions(
    m: Description,
    known: Mapping[str, Dimension | None],
    tables: Mapping[str, tuple[Dimension | None, ...]],
    expected: Sequence[Expected],
    plain: Iterable[str] = (),
) -> Iterator[tuple[Part, Dimension]]:
    """(part, its dimension) of the parts without a unit whose use determines one; the arguments as ``needed_units``.

    Of the names in ``plain`` those that are still open are numbers without a dimension, one after the other.
    """
    parts: tuple[Part, ...] = (*m.parameters, *m.inputs, *m.coordinates, *m.states)
    bare = [part for part in parts if part.unit is None]
    if not bare:
        return
    equations = _equations(m, known, tables, expected)
    for name in plain:
        if equations.solved(name) is None:
            equations.demand({name: Fraction(1)}, {})
    for part in bare:
        needed = equations.solved(part.name)
        if needed is not None:
            yield part, needed


def _equations(
    m: Description,
    known: Mapping[str, Dimension | None],
    tables: Mapping[str, tuple[Dimension | None, ...]],
    expected: Sequence[Expected],
) -> _Equations:
    """What the expressions ``expected`` demand; the arguments as ``needed_units``."""
    equations = _Equations(m, known, tables)
    for _, expression, wanted in expected:
        found = equations.of(expression)
        if wanted is not None and not expression.is_number:
            equations.demand(found, _exponents(wanted))
    return equations


def described_in(where: str, d: Dimension) -> str:
    """The dimension ``d`` as the name of a unit at the place ``where``: a torque has N.m, an energy J."""
    return _TORQUES.get(d, describe(d)) if where.startswith(_OF_FORCES) else describe(d)


def _uses(m: Description, expression: sp.Expr, name: str) -> bool:
    """Whether ``expression`` contains ``name``, directly or by definitions."""
    return any(name in free_names([part]) for part in _with_definitions(m, expression))


def _calls(m: Description, expression: sp.Expr, table: str) -> bool:
    """Whether ``expression`` calls ``table``, directly or by definitions."""
    calls = (call for part in _with_definitions(m, expression) for call in part.atoms(TableCall))
    return any(call.table == table for call in calls)


def _with_definitions(m: Description, expression: sp.Expr) -> Iterator[sp.Expr]:
    """``expression``, and the definitions that it needs."""
    meanings = {d.name: d.expression for d in m.definitions}
    left = [expression]
    while left:
        part = left.pop()
        yield part
        left += [meanings.pop(other) for other in free_names([part]) & meanings.keys()]


def _argument(table: str, index: int) -> str:
    """What stands for the unit of an argument of a table without units."""
    return f"{table}({index})"


def _value(table: str) -> str:
    """What stands for the unit of the value of a table without units."""
    return f"{table}()"


def _exponents(d: Dimension) -> Exponents:
    return {f"unit {i}": e for i, e in enumerate(d) if e}


def _sum(a: Exponents, b: Exponents, times: Fraction) -> Exponents:
    """a + times * b, without zeros."""
    found = {key: a.get(key, Fraction(0)) + times * b.get(key, Fraction(0)) for key in {**a, **b}}
    return {key: e for key, e in found.items() if e}


class _Equations:
    """The equations that expressions demand. ``rows`` {name: what stands for its unit}, eliminated as they come."""

    def __init__(
        self,
        m: Description,
        known: Mapping[str, Dimension | None],
        tables: Mapping[str, tuple[Dimension | None, ...]],
    ) -> None:
        self.known, self.tables = known, tables
        self.meanings = {d.name: d.expression for d in m.definitions}
        moving = [*(q.name for q in m.coordinates), *(u.name for u in m.inputs)]
        self.rates = {names.velocity(name): (name, 1) for name in moving}
        self.rates |= {names.acceleration(name): (name, 2) for name in moving}
        self.rows: dict[str, Exponents] = {}
        self.memory: dict[sp.Expr, Exponents] = {}
        for p in m.parameters:
            if p.expression is not None:
                self.demand(self.of(sp.Symbol(p.name, real=True)), self.of(p.expression))

    def solved(self, name: str) -> Dimension | None:
        """The dimension of ``name``, None if it is not determined."""
        found = self._reduced({name: Fraction(1)})
        if any(not key.startswith("unit ") for key in found):
            return None
        return tuple(found.get(f"unit {i}", Fraction(0)) for i in range(len(ONE)))

    def demand(self, a: Exponents, b: Exponents) -> None:
        """Note that two dimensions are equal. What contradicts the equations before it is a mismatch of its own."""
        rest = self._reduced(_sum(a, b, Fraction(-1)))
        name = next((key for key in sorted(rest) if not key.startswith("unit ")), None)
        if name is None:
            return
        factor = rest.pop(name)
        meaning = {key: -e / factor for key, e in rest.items()}
        self.rows = {key: _replaced(row, name, meaning) for key, row in self.rows.items()}
        self.rows[name] = meaning

    def _reduced(self, e: Exponents) -> Exponents:
        for name in [key for key in e if key in self.rows]:
            e = _replaced(e, name, self.rows[name])
        return e

    def of(self, expression: sp.Expr) -> Exponents:
        """The dimension of ``expression``, whose own demands are noted."""
        if expression not in self.memory:
            self.memory[expression] = self._of(expression)
        return self.memory[expression]

    def _of(self, e: sp.Expr) -> Exponents:
        if e.is_Symbol:
            return self._of_name(e.name)
        if e.is_number:
            return {}
        if e.is_Mul:
            total: Exponents = {}
            for a in e.args:
                total = _sum(total, self.of(a), Fraction(1))
            return total
        if e.is_Pow:
            return self._of_power(e)
        if isinstance(e, TableCall):
            return self._of_table(e)
        if isinstance(e, (*_EQUAL, Choice)):
            self.of(e.args[0])
            terms = self._alike(e.args[1:] if isinstance(e, Choice) else e.args)
            return {} if isinstance(e, sp.atan2) else terms
        argument = self.of(e.args[0])
        if not isinstance(e, (sp.sign, sp.Heaviside)):
            self.demand(argument, {})
        return {}

    def _of_name(self, name: str) -> Exponents:
        known = self.known.get(name)
        if name in self.meanings:
            return self.of(self.meanings[name])
        if known is not None:
            return _exponents(known)
        of, times = self.rates.get(name, (name, 0))
        return _sum({of: Fraction(1)}, _exponents(dimension(SECOND.exponents)), Fraction(-times))

    def _of_power(self, e: sp.Expr) -> Exponents:
        base = self.of(e.base)
        if e.exp.is_Rational:
            return _sum({}, base, Fraction(int(e.exp.p), int(e.exp.q)))
        self.demand(self.of(e.exp), {})
        self.demand(base, {})
        return {}

    def _of_table(self, e: TableCall) -> Exponents:
        *of_arguments, of_value = self.tables.get(e.table, (None,) * (len(e.args) + 1))
        for i, (argument, wanted) in enumerate(zip(e.args, of_arguments, strict=False)):
            found = self.of(argument)
            if not argument.is_number:
                self.demand(found, {_argument(e.table, i): Fraction(1)} if wanted is None else _exponents(wanted))
        return {_value(e.table): Fraction(1)} if of_value is None else _exponents(of_value)

    def _alike(self, terms: Iterable[sp.Expr]) -> Exponents:
        """The dimension that all ``terms`` have; the number 0 fits every one."""
        found = [self.of(a) for a in terms if not a.is_zero]
        for other in found[1:]:
            self.demand(found[0], other)
        return found[0] if found else {}


def _replaced(e: Exponents, name: str, meaning: Exponents) -> Exponents:
    """``e`` with the ``meaning`` of ``name`` in its place."""
    if name not in e:
        return e
    return _sum({key: x for key, x in e.items() if key != name}, meaning, e[name])
