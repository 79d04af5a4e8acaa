"""Where a mechanism of the plane can be cut: at the coordinate by which bodies turn about a hinge.

The hinge is found from the bodies' positions r(q), which turn about it: it is half way between r at q and r half a turn
further on, and does not depend on q.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.places import Body, Frame, Place, Point
from lag2fmu.description.symbols import Coordinate
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import METRE, RADIAN
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.cut import Cut, Part


@dataclass(frozen=True)
class PlaneCut(Cut):
    """A cut at a hinge in the plane: its place is ``hinge``, and what carries it is turned by ``turned``."""

    hinge: tuple[sp.Expr, sp.Expr]
    turned: sp.Expr

    @property
    def _free(self) -> tuple[sp.Symbol, sp.Symbol, sp.Symbol]:
        x, y, angle = (symbol(f"{self.root}_free_{name}") for name in ("x", "y", "angle"))
        return x, y, angle

    @property
    def probe(self) -> Point:
        """The hinge, turning with the piece."""
        return Point(self.measured, self.hinge, angle=self.turned + self.scale * symbol(self.coordinates[0]))

    def freed(self, part: Part) -> Part:
        """A body or point, whose hinge has two coordinates, and which turns by a third."""
        if isinstance(part, Frame) or part.position is None:
            return part
        *place, angle = self._free
        turn = {symbol(self.coordinates[0]): (angle - self.turned) / self.scale}
        position = tuple(
            (sp.sympify(r) - p).xreplace(turn) + x for r, p, x in zip(part.position, self.hinge, place, strict=True)
        )
        own = None if part.angle is None else sp.sympify(part.angle).xreplace(turn)
        freed: Any = part
        return cast("Part", replace(freed, position=position, angle=own))

    def free_coordinates(self, start: Mapping[str, float]) -> Iterator[Coordinate]:
        """Place and angle of the piece."""
        x, y, angle = self._free
        for name, axis in ((x, "x"), (y, "y")):
            place, speed = (start[f"{self.measured}_{quantity}_{axis}"] for quantity in ("position", "velocity"))
            yield Coordinate(name.name, METRE, place, speed, doc=f"place of {self.root}, {axis}")
        turned, rate = start[f"{self.measured}_angle"], start[f"{self.measured}_angular_velocity"]
        yield Coordinate(angle.name, RADIAN, turned, rate, doc=f"angle of {self.root}")


def plane_cut_at(d: Description, name: str) -> Cut:
    """The cut at the coordinate ``name`` of ``d``, whose positions have no definitions in them.

    Raises MechanismError if there is no such coordinate, or if what it moves turns about no hinge on the mechanism.
    """
    coordinates = {q.name: symbol(q.name) for q in d.coordinates}
    if name not in coordinates:
        raise MechanismError(f"--at {name}: there is no coordinate '{name}'; {suggestion(name, coordinates)}")
    q = coordinates[name]
    carried = frozenset(part.name for part in d.places if q in _symbols(part))
    for body in (body for body in d.bodies if body.name in carried and body.angle is not None):
        cut = _hinged(body, q, carried)
        if cut is not None:
            moving = {*coordinates.values()}
            if not {s for x in (*cut.hinge, cut.turned) for s in x.free_symbols} & moving:
                raise MechanismError(f"--at {name}: '{body.name}' hangs on the world; nothing is on the other side")
            return cut
    raise MechanismError(
        f"--at {name}: no rigid body turns about a hinge by this coordinate; put bodies on frames, or cut elsewhere"
    )


def _hinged(body: Body, q: sp.Symbol, carried: frozenset[str]) -> PlaneCut | None:
    """The cut at the hinge about which ``body`` turns by ``q``; None if it does not turn, or about no fixed place."""
    angle = sp.sympify(body.angle)
    slope = angle.diff(q)
    turned = sp.expand(angle - slope * q)
    if not slope.is_number or slope == 0 or q in turned.free_symbols:
        return None
    half = {q: q + sp.pi / slope}
    hinge = tuple(sp.expand((sp.sympify(r) + sp.sympify(r).xreplace(half)) / 2) for r in body.position or ())
    if len(hinge) != 2 or any(q in x.free_symbols for x in hinge):
        return None
    x, y, free = (symbol(f"{body.name}_free_{name}") for name in ("x", "y", "angle"))
    seat, pin = Point(f"{body.name}_seat", hinge, angle=turned), Point(f"{body.name}_pin", (x, y), angle=free)
    axis = (0.0, 0.0, 1.0)
    return PlaneCut(body.name, "revolute", axis, (q.name,), float(slope), seat, pin, carried, hinge, turned)


def _symbols(place: Place) -> set[sp.Symbol]:
    expressions = (*(place.position or ()), *(() if place.angle is None else (place.angle,)))
    return {s for x in expressions for s in sp.sympify(x).free_symbols}
