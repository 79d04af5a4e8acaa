"""The norm of a quaternion whose entries are coordinates: a constraint that is added, unless the user wrote it."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Mapping

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.parts import Constraint
from lag2fmu.language.definitions import written_out
from lag2fmu.language.parts_of import free_names
from lag2fmu.language.vocabulary import value_of
from lag2fmu.mechanism.order import in_order

_TRIALS, _ROUNDING = 5, 1e-9
"""Random places at which an expression is looked at, and the size up to which it is 0 there."""


def missing_norms(m: Description) -> Iterator[tuple[str, Constraint]]:
    """(frame, constraint) of each quaternion of ``m`` whose norm has to be kept.

    The constraint is e0^2 + e1^2 + e2^2 + e3^2 - 1 = 0, called FRAME_norm. It is not needed if the norm is 1 for all q,
    as for [cos(q/2), sin(q/2), 0, 0], nor if constraints of the user keep it. Both are decided by values at random
    points.
    """
    for frame, norm, present in _norms(m):
        if not present:
            yield frame, Constraint(f"{frame}_norm", norm)


def norm_constraints(m: Description) -> frozenset[str]:
    """The names of the constraints that keep the norm of a quaternion; their multipliers have no physical meaning."""
    return frozenset(name for _, _, present in _norms(m) for name in present)


def _norms(m: Description) -> Iterator[tuple[str, sp.Expr, list[str]]]:
    """(frame, norm^2 - 1, constraints that keep it zero) of every quaternion whose norm is not 1 for all q."""
    turned = {frame.name: frame.quaternion for frame in m.frames if frame.quaternion is not None}
    if not turned:
        return
    coordinates = {q.name for q in m.coordinates}
    written = written_out({d.name: d.expression for d in in_order(m.definitions, "definitions")})
    for name, quaternion in turned.items():
        entries = [sp.sympify(entry).xreplace(written) for entry in quaternion]
        norm = sp.Add(*(entry**2 for entry in entries)) - 1
        if free_names(entries) & coordinates and not vanishes(norm):
            yield name, norm, _keepers(m, norm, written, coordinates)


def _keepers(m: Description, norm: sp.Expr, written: Mapping[sp.Symbol, sp.Expr], coordinates: set[str]) -> list[str]:
    """The holonomic constraints that keep ``norm`` zero; ``written`` are the definitions, written out."""
    others = {c.name: sp.sympify(c.expression).xreplace(written) for c in m.holonomic if not c.massless}
    return [name for name, other in others.items() if _says(other, norm, coordinates)]


def _points(names: set[str]) -> Iterator[dict[str, float]]:
    generator = random.Random(4)
    for _ in range(_TRIALS):
        yield {name: generator.uniform(0.2, 1.0) for name in sorted(names)}


def vanishes(expression: sp.Expr) -> bool:
    """Whether the expression is zero for all values of its symbols; decided by values at random points."""
    try:
        return all(abs(value_of(expression, point)) < _ROUNDING for point in _points(free_names([expression])))
    except (ValueError, ArithmeticError):  # the expression has no value at some point
        return False


def _says(other: sp.Expr, norm: sp.Expr, coordinates: set[str]) -> bool:
    """Whether ``other`` keeps the same norm: it has only the coordinates of ``norm``, and vanishes where norm does."""
    names = free_names([norm])
    if not free_names([other]) & coordinates <= names or not free_names([other]) & names:
        return False
    for point in _points(names | free_names([other])):
        scale = math.sqrt(value_of(norm, point) + 1)
        unit = {name: value / scale if name in names else value for name, value in point.items()}
        if abs(value_of(norm, unit)) > _ROUNDING or abs(value_of(other, unit)) > _ROUNDING:
            return False
    return True
