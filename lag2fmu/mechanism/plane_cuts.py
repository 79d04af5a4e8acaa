"""Where a mechanism of the plane can be cut: at a coordinate by which bodies turn about a hinge, or are shifted.

The hinge is found from the bodies' positions r(q), which turn about it: it is half way between r at q and r half a turn
further on, and does not depend on q. What is shifted alike by q, on a line or about a hinge, does not turn: it is cut
at one of its places, which a slot or a rod holds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.places import AXES, Body, Frame, Place, Point
from lag2fmu.description.symbols import Coordinate
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.language.units import METRE, RADIAN
from lag2fmu.language.vocabulary import symbol, value_of
from lag2fmu.mechanism.cut import Cut, Part
from lag2fmu.mechanism.geometry import values_of

_Vector = tuple[sp.Expr, ...]


@dataclass(frozen=True)
class PlaneCut(Cut):
    """A cut in the plane. The free place of the piece was at ``carried_at``.

    If the piece turns, that is its hinge, and what carries it is turned by ``turned``. ``shown`` is the joint's
    coordinate by the free coordinates of the piece, None if these do not tell it.
    """

    carried_at: _Vector
    turned: sp.Expr | None
    shown: sp.Expr | None

    @property
    def stands(self) -> Mapping[sp.Symbol, sp.Expr]:
        """The joint's coordinate, its rate and its acceleration."""
        if self.shown is None:
            return {}
        free = [symbol(f"{self.root}_free_{name}") for name in ("x", "y", "angle")]
        slopes = {s: self.shown.diff(s) for s in free}
        rates = (
            sum(c * symbol(name(s.name)) for s, c in slopes.items()) for name in (names.velocity, names.acceleration)
        )
        (q,) = self.coordinates
        symbols = (symbol(name(q)) for name in (str, names.velocity, names.acceleration))
        return dict(zip(symbols, (self.shown, *rates), strict=True))

    @property
    def gaps(self) -> Sequence[sp.Expr]:
        """The way from where the piece is carried to where it is."""
        return [x - r for x, r in zip(_free_place(self.root), self.carried_at, strict=True)]

    @property
    def probe(self) -> Point:
        """The hinge, turning with the piece; or the place by which the piece is shifted."""
        if self.turned is None:
            return Point(self.measured, self.carried_at)
        return Point(self.measured, self.carried_at, angle=self.turned + self.scale * symbol(self.coordinates[0]))

    def freed(self, part: Part) -> Part:
        """A body or point, whose hinge has two coordinates, and which turns by a third."""
        if isinstance(part, Frame) or part.position is None:
            return part
        q, turn = symbol(self.coordinates[0]), {}
        if self.turned is not None:
            turn = {q: (symbol(f"{self.root}_free_angle") - self.turned) / self.scale}
        position = tuple(
            sp.expand(sp.sympify(r) + x).xreplace(turn) for r, x in zip(part.position, self.gaps, strict=True)
        )
        own = None if part.angle is None else sp.sympify(part.angle).xreplace(turn)
        freed: Any = part
        return cast("Part", replace(freed, position=position, angle=own))

    def free_coordinates(self, start: Mapping[str, float]) -> Iterator[Coordinate]:
        """Place and angle of the piece."""
        for x, axis in zip(_free_place(self.root), AXES, strict=False):
            place, speed = (start[f"{self.measured}_{quantity}_{axis}"] for quantity in ("position", "velocity"))
            yield Coordinate(x.name, METRE, place, speed, doc=f"place of {self.root}, {axis}")
        if self.turned is not None:
            turned, rate = start[f"{self.measured}_angle"], start[f"{self.measured}_angular_velocity"]
            yield Coordinate(f"{self.root}_free_angle", RADIAN, turned, rate, doc=f"angle of {self.root}")


def plane_cut_at(d: Description, name: str) -> Cut:
    """The cut at the coordinate ``name`` of ``d``, whose positions have no definitions in them.

    Raises MechanismError if there is no such coordinate, or if what it moves neither turns about a hinge, nor is
    shifted as a whole.
    """
    coordinates = {q.name: symbol(q.name) for q in d.coordinates}
    if name not in coordinates:
        raise MechanismError(f"--at {name}: there is no coordinate '{name}'; {suggestion(name, coordinates)}")
    if d.dimension == 2:
        mover = _Mover(d, coordinates[name])
        for cut in (*map(mover.hinged, mover.parts), mover.shifted()):
            if cut is not None:
                return cut
    raise MechanismError(
        f"--at {name}: no rigid body turns about a hinge by this coordinate, and nothing is shifted by it on a line or "
        "a circle; put bodies on frames, or cut elsewhere"
    )


class _Mover:
    """What the coordinate ``q`` moves: ``parts``, those that depend on the fewest coordinates first."""

    def __init__(self, d: Description, q: sp.Symbol) -> None:
        self.q, self.moving = q, {symbol(x.name) for x in d.coordinates}
        self.values = values_of(d)
        self.constants = {symbol(x.name) for x in d.parameters}
        carried = [part for part in d.places if q in _symbols(part)]
        self.carried = frozenset(part.name for part in carried)
        bodies = [part for part in carried if isinstance(part, Body) and part.position is not None]
        self.parts = sorted(bodies, key=lambda part: len(_symbols(part) & self.moving))
        self.places = [part for part in carried if part.position is not None]

    def hinged(self, body: Body) -> PlaneCut | None:
        """The cut at the hinge about which ``body`` turns; None if it does not turn, or about no fixed place."""
        angle = sp.sympify(body.angle or 0)
        slope = angle.diff(self.q)
        turned = sp.expand(angle - slope * self.q)
        if not slope.is_number or slope == 0 or self.q in turned.free_symbols:
            return None
        hinge = self._centre(body, slope)
        if hinge is None:
            return None
        scale = float(slope)
        shown = (symbol(f"{body.name}_free_angle") - turned) / scale
        fixed = turned.free_symbols <= self.constants
        return self._cut("revolute", (0.0, 0.0, 1.0), body, hinge, hinge, turned, shown if fixed else None, scale)

    def shifted(self) -> PlaneCut | None:
        """The cut at the first one of the parts; None if they are not shifted alike on a line or a circle."""
        if not self.parts or not all(self._alike(part, self.parts[0]) for part in self.places):
            return None
        return self._sliding(self.parts[0]) or self._circling(self.parts[0])

    def _sliding(self, body: Body) -> PlaneCut | None:
        """The cut at ``body``, which slides on a line that does not turn; None if it does not."""
        place = _position(body)
        along = [sp.simplify(r.diff(self.q)) for r in place]
        if _free(along) <= self.constants:
            seat = tuple(r.xreplace({self.q: sp.S.Zero}) for r in place)
            way = [x - r for x, r in zip(_free_place(body.name), seat, strict=True)]
            shown = sum(v * x for v, x in zip(along, way, strict=True)) / sum(v**2 for v in along)
            fixed = _free(seat) <= self.constants
            axis = [value_of(x, self.values) for x in along]
            return self._cut("slot", (axis[0], axis[1], 0.0), body, seat, place, None, shown if fixed else None)
        return None

    def _circling(self, body: Body) -> PlaneCut | None:
        """The cut at ``body``, which keeps its distance from a hinge; None if it does not."""
        place, hinge = _position(body), self._centre(body, sp.S.One)
        if hinge is None:
            return None
        square = sp.simplify(sum((r - h) ** 2 for r, h in zip(place, hinge, strict=True)))
        return self._cut("rod", (0.0, 0.0, 1.0), body, hinge, place) if square.free_symbols <= self.constants else None

    def _alike(self, part: Place, other: Place) -> bool:
        """Whether both are shifted alike, and ``part`` does not turn."""
        turns = self.q in sp.sympify(part.angle or 0).free_symbols
        pairs = zip(_position(part), _position(other), strict=True)
        return not turns and not any(sp.simplify((r - s).diff(self.q)) for r, s in pairs)

    def _centre(self, body: Body, slope: sp.Expr) -> _Vector | None:
        """Half way between the place of ``body`` and that of half a turn further on; None if it moves by q."""
        half = {self.q: self.q + sp.pi / slope}
        found = tuple(sp.expand((r + r.xreplace(half)) / 2) for r in _position(body))
        return None if any(self.q in x.free_symbols for x in found) else found

    def _cut(
        self,
        kind: str,
        axis: tuple[float, float, float],
        body: Body,
        at: _Vector,
        carried_at: _Vector,
        turned: sp.Expr | None = None,
        shown: sp.Expr | None = None,
        scale: float = 1.0,
    ) -> PlaneCut:
        """The cut whose seat is ``at`` a place of what carries ``body``."""
        free = sp.S.Zero if turned is None else symbol(f"{body.name}_free_angle")
        seat = Point(f"{body.name}_seat", at, angle=sp.S.Zero if turned is None else turned)
        pin = Point(f"{body.name}_pin", _free_place(body.name), angle=free)
        return PlaneCut(
            body.name, kind, axis, (self.q.name,), scale, seat, pin, self.carried, carried_at, turned, shown
        )  # fmt: skip


def _free_place(root: str) -> tuple[sp.Symbol, sp.Symbol]:
    """The coordinates of the place of a piece."""
    x, y = (symbol(f"{root}_free_{axis}") for axis in "xy")
    return x, y


def _position(place: Place) -> _Vector:
    return tuple(sp.sympify(r) for r in place.position or ())


def _symbols(place: Place) -> set[sp.Symbol]:
    return _free((*_position(place), sp.sympify(place.angle or 0)))


def _free(expressions: Iterable[sp.Expr]) -> set[sp.Symbol]:
    return {s for x in expressions for s in x.free_symbols}
