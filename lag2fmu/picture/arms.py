"""The links that carry a place, read from its position: a sum of arms, one at the end of the other.

A transformation equation as textbooks write it, r = (x + l sin(a), -l cos(a)), is a constant, plus a shift along
coordinates, plus arms that turn by their angles. Each partial sum, from the origin outwards, is a joint. The expression
alone is interpreted, for pictures only: no equation depends on it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import sympy as sp

Vector = tuple[sp.Expr, ...]

CONSTANT, SHIFT, ARM = "constant", "shift", "arm"


class ArmStep(NamedTuple):
    """A part of a position, from ``start`` to ``end``, both (2,) or (3,) in m.

    - ``kind``: CONSTANT, SHIFT (free of angles) or ARM.
    - ``names``: the coordinates and motions that move it, in order.
    - ``angles``: the arguments of an arm's sines and cosines.
    - ``lengths``: the other names in an arm.
    """

    kind: str
    start: Vector
    end: Vector
    names: tuple[str, ...]
    angles: frozenset[sp.Expr] = frozenset()
    lengths: tuple[str, ...] = ()


def steps(position: Vector, order: Mapping[str, int]) -> tuple[ArmStep, ...]:
    """The parts of ``position`` from the origin outwards; ``order`` ranks what moves: coordinates, motions, time."""
    groups: dict[frozenset[sp.Expr], list[list[sp.Expr]]] = {}
    still, shift = [[sp.S.Zero] for _ in position], [[sp.S.Zero] for _ in position]
    for axis, entry in enumerate(position):
        for term in _terms(entry):
            angles = _angles(term, order)
            if angles:
                _joined(groups, angles, len(position))[axis].append(term)
            else:
                (shift if _moving(term, order) else still)[axis].append(term)
    return tuple(_chained(still, shift, groups, order))


def _chained(
    still: Sequence[Sequence[sp.Expr]],
    shift: Sequence[Sequence[sp.Expr]],
    groups: Mapping[frozenset[sp.Expr], Sequence[Sequence[sp.Expr]]],
    order: Mapping[str, int],
) -> Iterator[ArmStep]:
    place: Vector = (sp.S.Zero,) * len(still)
    ranked = sorted(groups.items(), key=lambda item: _rank(item[0], order))
    parts = [(CONSTANT, frozenset(), still), (SHIFT, frozenset(), shift), *((ARM, a, terms) for a, terms in ranked)]
    for kind, angles, terms in parts:
        vector = [sp.Add(*entry) for entry in terms]
        if not any(vector):
            continue
        end = tuple(a + b for a, b in zip(place, vector, strict=True))
        every, turning = _ranked(vector, order), _ranked(angles, order)
        names = turning if kind == ARM else every
        lengths = tuple(name for name in every if kind == ARM and name not in turning)
        yield ArmStep(kind, place, end, names, angles, lengths)
        place = end


def _ranked(expressions: Iterable[sp.Expr], order: Mapping[str, int]) -> tuple[str, ...]:
    """The names that move in ``expressions``, by their rank."""
    return tuple(sorted({name for x in expressions for name in _moving(x, order)}, key=order.__getitem__))


def _terms(entry: sp.Expr) -> tuple[sp.Expr, ...]:
    """The terms of a sum, products of sums multiplied out."""
    return tuple(sp.Add.make_args(sp.expand_mul(sp.sympify(entry))))


def _moving(expression: sp.Expr, order: Mapping[str, int]) -> set[str]:
    return {s.name for s in expression.free_symbols if s.name in order}


def _angles(term: sp.Expr, order: Mapping[str, int]) -> frozenset[sp.Expr]:
    """The moving arguments of the functions in ``term``, without the constants in them.

    Arguments of opposite sign count as the same, because sin(-x) is written -sin(x).
    """
    moving = (f.args[0] for f in term.atoms(sp.Function) if _moving(f.args[0], order))
    turns = (sp.Add(*(x for x in sp.Add.make_args(sp.expand_mul(a)) if _moving(x, order))) for a in moving)
    return frozenset(-x if x.could_extract_minus_sign() else x for x in turns)


def _joined(
    groups: dict[frozenset[sp.Expr], list[list[sp.Expr]]], angles: frozenset[sp.Expr], size: int
) -> list[list[sp.Expr]]:
    """The entries of the arm that turns by ``angles``; arms that share an angle with it are joined to it."""
    whole, entries = angles, [[sp.S.Zero] for _ in range(size)]
    for key in [key for key in groups if key & angles]:
        whole |= key
        entries = [[*mine, *theirs] for mine, theirs in zip(entries, groups.pop(key), strict=True)]
    groups[whole] = entries
    return entries


def _rank(angles: frozenset[sp.Expr], order: Mapping[str, int]) -> tuple[int, int, str]:
    """The key by which arms are sorted: by the newest coordinate in their ``angles``, then by how many there are."""
    names = {name for angle in angles for name in _moving(angle, order)}
    return max(order[name] for name in names), len(names), str(sorted(map(str, angles)))
