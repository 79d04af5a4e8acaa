"""What works across a cut, written otherwise: by the coordinates of the pieces, and as a slot between two of them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import product
from typing import Any

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description, table_keys
from lag2fmu.description.keys import keys_in
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Constraint, Force
from lag2fmu.description.places import Point
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.cut import Cut
from lag2fmu.mechanism.renaming import mapped

Owners = Callable[[sp.Expr], Collection[str]]
"""A function that gives the pieces to which an expression belongs."""
_KEPT = ("coordinates", "bodies", "points", "frames")
"""The tables that a cut changes by itself."""


def by_pieces(d: Description, cuts: Iterable[Cut]) -> Description:
    """``d`` with the coordinates of joints written by those of the pieces, where a cut can; they are outputs then."""
    found = d
    for cut in cuts:
        if cut.stands:
            found = _by_piece(found, cut)
    return found


def _by_piece(d: Description, cut: Cut) -> Description:
    stands, (q,) = cut.stands, cut.coordinates
    shown = next(iter(stands.values()))
    tables: dict[str, Any] = {}
    for name, key in table_keys().items():
        content = getattr(d, name)
        if name not in _KEPT and content is not None:
            tables[name] = tuple(_changed(x, stands) for x in content) if key.many else _changed(content, stands)
    free = sorted({s.name for s in shown.free_symbols} - _declared(d))
    forces = (force for record in tables["forces"] for force in _shared(record, q, shown, free))
    unit = next(x.unit for x in d.coordinates if x.name == q)
    own = () if any(x.name == q for x in d.outputs) else (Output(q, shown, unit, f"coordinate {q}"),)
    return replace(d, **tables | {"forces": tuple(forces), "outputs": (*tables["outputs"], *own)})


def _declared(d: Description) -> set[str]:
    """The names of the whole's own coordinates, parameters and inputs."""
    return {x.name for x in d.parameters} | {x.name for x in d.coordinates} | {x.name for x in d.inputs}


def _changed(record: Any, stands: Mapping[sp.Symbol, sp.Expr]) -> Any:
    """``record`` with other expressions for the symbols in ``stands``."""
    values = {key.field: getattr(record, key.field) for key in keys_in(record)}
    changed = {name: mapped(value, lambda x: x.xreplace(stands)) for name, value in values.items()}
    different = {name: value for name, value in changed.items() if value != values[name]}
    return replace(record, **different) if different else record


def _shared(force: Force, q: str, shown: sp.Expr, free: Iterable[str]) -> Iterator[Force]:
    """A ``force`` Q on ``q`` as forces Q dq/dx on the ``free`` coordinates x of the piece, by which q is ``shown``."""
    if force.coordinate != q:
        yield force
        return
    for name in free:
        slope = shown.diff(symbol(name))
        if slope != 0:
            yield Force(name, force.expression * slope)


def closed_by(constraint: Constraint, cuts: Iterable[Cut], owners: Owners) -> Constraint:
    """``constraint`` plus such multiples of the ``gaps`` of ``cuts`` that it belongs to the fewest pieces.

    It holds for the same motions, since the gaps are 0.
    """
    expression = sp.expand(sp.sympify(constraint.expression))
    for cut in sorted(cuts, key=lambda cut: len(cut.carried)):
        if cut.gaps and len(owners(expression)) > 1:
            tried = [
                sp.expand(expression + sum(a * gap for a, gap in zip(factors, cut.gaps, strict=True)))
                for factors in product((0, 1, -1), repeat=len(cut.gaps))
            ]
            expression = min(tried, key=lambda x: len(owners(x)))
    return constraint if expression == constraint.expression else replace(constraint, expression=expression)


def as_slot(constraint: Constraint, owners: Owners) -> dict[str, Point] | None:
    """{piece: place} of two places that a slot along y holds at one x where the ``constraint`` is met.

    None if it is not the sum of two terms that each belong to one piece.
    """
    if not constraint.holonomic or constraint.while_ is not None:
        return None
    sides: dict[str, sp.Expr] = {}
    for term in sp.Add.make_args(sp.expand(sp.sympify(constraint.expression))):
        of = [*owners(term)] or [next(iter(sides), "")]
        if len(of) > 1:
            return None
        sides[of[0]] = sides.get(of[0], sp.S.Zero) + term
    still = sides.pop("", sp.S.Zero)
    if len(sides) != 2:
        return None
    (one, first), (other, second) = sides.items()
    name, zero = f"{constraint.name}_end", sp.S.Zero
    return {
        one: Point(name, (first + still, zero), angle=zero),
        other: Point(name, (-second, zero), angle=zero),
    }


def without_multipliers(pieces: Iterable[Mapping[str, list[Any]]]) -> list[str]:
    """Take out of the tables of all ``pieces`` the outputs of multipliers that went with a joint; their names."""
    found, bare = list[str](), names.multiplier("")
    for tables in pieces:
        known, outputs = {names.multiplier(c.name) for c in tables.get("constraints", ())}, tables.get("outputs", [])
        gone = [x for x in outputs if any(s.startswith(bare) and s not in known for s in _symbols(x))]
        outputs[:] = [x for x in outputs if x not in gone]
        found += [x.name for x in gone]
    return found


def _symbols(output: Output) -> set[str]:
    return set() if output.expression is None else {s.name for s in sp.sympify(output.expression).free_symbols}
