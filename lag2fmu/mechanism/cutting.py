"""A mechanism in pieces: which entries belong to each piece of one that is cut.

A piece that is cut off moves freely, by coordinates of its cut. Springs and dampers of a joint's coordinate go with it.
A constraint that is a sum over two pieces becomes a slot; whatever else works across a cut is an error that names it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NoReturn

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description, label_of, table_keys
from lag2fmu.description.keys import keys_in
from lag2fmu.description.parts import Constraint, Damper, Energy, Spring
from lag2fmu.description.places import Point, expressions_of
from lag2fmu.description.ports import Ports
from lag2fmu.description.symbols import Coordinate
from lag2fmu.errors import MechanismError
from lag2fmu.language.vocabulary import symbol, value_of
from lag2fmu.mechanism.across import as_slot, by_pieces, closed_by, without_multipliers
from lag2fmu.mechanism.cut import Axis, Cut
from lag2fmu.mechanism.geometry import values_of
from lag2fmu.mechanism.opening import with_places

_JOINT = "joint "
"""Before the root of a cut: the owner of what belongs to its joint."""
_PART = "part "
"""Before the name of a frame, body or point: a coordinate may have the same one."""
_WHERE_USED = ("parameters", "inputs", "tables", "definitions", "points")
"""The tables of entries that may stand in several pieces, as far as they belong to none of them."""


@dataclass(frozen=True)
class CutJoint:
    """A joint of this ``kind`` between the places ``ends`` {piece: place}, the first one with the ``axis``.

    ``damping``, ``stiffness`` and ``rest`` are the numbers of its own force, in SI units.
    """

    kind: str
    axis: Axis
    ends: Mapping[str, str]
    damping: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0


@dataclass(frozen=True)
class CutMechanism:
    """{piece: its description}, the joints between them, and the names of outputs that belong to no single piece."""

    descriptions: Mapping[str, Description]
    joints: tuple[CutJoint, ...]
    left_out: tuple[str, ...]


def in_pieces(d: Description, cuts: Sequence[Cut], start: Mapping[str, float]) -> CutMechanism:
    """The pieces of ``d`` between ``cuts``; ``start``: the values of its coordinates and of the outputs of the probes.

    Raises MechanismError for what works across a cut and is no spring or damper of the joint's coordinate.
    """
    return _Splitter(d, cuts, start).pieces()


class _Splitter:
    """Who owns what: ``owners`` {name: pieces}; the coordinates of joints are owned by their cuts."""

    def __init__(self, d: Description, cuts: Sequence[Cut], start: Mapping[str, float]) -> None:
        self.d, self.cuts, self.start = by_pieces(d, cuts), {cut.root: cut for cut in cuts}, start
        self.spots: dict[str, list[Point]] = {}
        self.values, self.base = values_of(d), d.name
        if self.base in self.cuts:
            raise MechanismError(f"--at {self.base}: the mechanism has this name too; rename one of them")
        self.parts = d.frames or d.places
        self.piece = {part.name: self._piece({part.name}) for part in self.parts}
        self.owners: dict[str, set[str]] = {_PART + part: {piece} for part, piece in self.piece.items()}
        self.joints = {q: root for root, cut in self.cuts.items() for q in cut.coordinates}
        self._own_coordinates()
        for table, kind in (("bodies", _PART), ("points", _PART), ("definitions", ""), ("states", "")):
            for record in getattr(d, table):
                if record not in self.parts:
                    name = kind + record.name
                    self.owners[name] = self.owners.get(name, set()) | self.of(record)

    def _piece(self, parts: Collection[str]) -> str:
        """The piece of the ``parts``: the smallest one that is cut off with one of them, else the base."""
        holding = [cut for cut in self.cuts.values() if cut.carried & {*parts}]
        return min(holding, key=lambda cut: len(cut.carried)).root if holding else self.base

    def _freed(self, part: Any) -> Any:
        """A frame, body or point as it is in its piece."""
        cut = self.cuts.get(self.piece[part.name]) if part in self.parts else None
        return part if cut is None else cut.freed(part)

    def _own_coordinates(self) -> None:
        """A coordinate belongs to the piece whose parts it moves, and to the base if it moves none."""
        movers = [(self.piece[part.name], _names(self._freed(part))) for part in self.parts]
        for q in self.d.coordinates:
            moved = {piece for piece, used in movers if q.name in used}
            if len(moved) > 1 or (moved and q.name in self.joints):
                where = " and ".join(sorted(moved | {self.joints.get(q.name, "")} - {""}))
                raise MechanismError(f"the coordinate '{q.name}' moves several pieces, {where}; cut elsewhere")
            owner = {_JOINT + self.joints[q.name]} if q.name in self.joints else moved or {self.base}
            self._give(q.name, owner)
        for cut in self.cuts.values():
            for q in cut.free_coordinates(self.start):
                self._give(q.name, {cut.root})

    def _give(self, q: str, owner: set[str]) -> None:
        for name in (names.velocity, names.acceleration, names.generalized_force, str):
            self.owners[name(q)] = owner

    def of(self, record: Any) -> set[str]:
        """The pieces to which a ``record`` belongs, by all that it refers to."""
        return {piece for name in _names(record) for piece in self.owners.get(name, ())}

    def pieces(self) -> CutMechanism:
        """Everything where it belongs. Raises MechanismError for what works across a cut."""
        tables: dict[str, dict[str, list[Any]]] = {piece: {} for piece in (self.base, *self.cuts)}
        own: dict[str, list[Spring | Damper]] = {frame: [] for frame in self.cuts}
        left_out, slots = list[str](), list[CutJoint]()
        for table, whole in self._split():
            record = self._closed(whole)
            owner = self._owner(table, record)
            if owner in tables:
                tables[owner].setdefault(table, []).append(record)
            elif slot := self._slot(record):
                slots.append(slot)
            elif isinstance(record, Spring | Damper) and owner:
                own[owner.removeprefix(_JOINT)].append(record)
            else:
                left_out += self._left(table, record)
        left_out += without_multipliers(tables.values())
        joints = tuple(self._joint(cut, own[frame]) for frame, cut in self.cuts.items())
        return CutMechanism({x: self._description(x, tables[x]) for x in tables}, (*joints, *slots), tuple(left_out))

    def _pieces_of(self, expression: sp.Expr) -> set[str]:
        return {piece for s in expression.free_symbols for piece in self.owners.get(s.name, ())}

    def _closed(self, record: Any) -> Any:
        """``record``; a constraint may belong to fewer pieces if the joints' gaps are added."""
        return closed_by(record, self.cuts.values(), self._pieces_of) if isinstance(record, Constraint) else record

    def _slot(self, record: Any) -> CutJoint | None:
        """The slot that a constraint between two pieces becomes; None if it is none."""
        places = as_slot(record, self._pieces_of) if isinstance(record, Constraint) else None
        for piece, point in (places or {}).items():
            self.spots.setdefault(piece, []).append(point)
        ends = {piece: point.name for piece, point in (places or {}).items()}
        return CutJoint("slot", (0.0, 1.0, 0.0), ends) if ends else None

    def _split(self) -> Iterator[tuple[str, Any]]:
        """(table, entry) of all entries that belong to pieces; coordinates of joints are gone."""
        for table, key in table_keys().items():
            if key.many and table not in ("parameters", "inputs", "tables"):
                for record in getattr(self.d, table):
                    if table != "coordinates" or record.name not in self.joints:
                        yield table, record

    def _owner(self, table: str, record: Any) -> str:
        """The one piece or joint to which an entry belongs; "" if there are several."""
        if record in self.parts:
            return self.piece[record.name]
        owners = self.owners[record.name] if table == "coordinates" else self.of(record) or {self.base}
        return next(iter(owners)) if len(owners) == 1 else ""

    def _left(self, table: str, record: Any) -> list[str]:
        """The names of outputs among an entry of several pieces; raises MechanismError for what has to be in one."""
        if table not in ("outputs", "definitions"):
            self._refuse(table, record)
        return [record.name] if table == "outputs" else []

    def _refuse(self, table: str, record: Any) -> NoReturn:
        sides = " and ".join(f"'{x}'" for x in sorted(self.of(record)))
        raise MechanismError(
            f"{table}.{label_of(record)}: works across a cut, on {sides}; only springs and dampers of a joint's own "
            "coordinate go with the joint"
        )

    def _joint(self, cut: Cut, own: Iterable[Spring | Damper]) -> CutJoint:
        """The joint of ``cut``, with its ``own`` springs and dampers."""
        damping = stiffness = push = 0.0
        for record in own:
            if isinstance(record, Spring):
                ratio, size, at_zero = self._linear(cut, "springs", record, record.elongation, record.stiffness)
                stiffness += size * ratio**2
                push += size * ratio * at_zero
            else:
                ratio, size, _ = self._linear(cut, "dampers", record, record.rate, record.damping)
                damping += size * ratio**2
        rest = -push / stiffness if stiffness else 0.0
        ends = {self._below(cut): cut.seat.name, cut.root: cut.pin.name}
        return CutJoint(cut.kind, cut.axis, ends, damping, stiffness, rest)

    def _linear(self, cut: Cut, table: str, record: Any, of: Any, constant: Any) -> tuple[float, float, float]:
        """Of a spring or damper: d(``of``)/d(the joint's angle or way), its ``constant``, and ``of`` at 0.

        Raises MechanismError unless ``of`` is linear in the joint's one coordinate, or in its rate.
        """
        if of is None or constant is None or len(cut.coordinates) != 1:
            self._refuse(table, record)
        (q,) = cut.coordinates
        by = symbol(q if table == "springs" else names.velocity(q))
        slope, size = sp.sympify(of).diff(by), sp.sympify(constant)
        if not {s.name for s in slope.free_symbols | size.free_symbols} <= self.values.keys() - {"t"}:
            self._refuse(table, record)
        at_zero = value_of(sp.sympify(of).xreplace({by: sp.S.Zero}), self.values)
        return value_of(slope, self.values) / cut.scale, value_of(size, self.values), at_zero

    def _below(self, cut: Cut) -> str:
        """The piece on which the piece of ``cut`` stands."""
        used = _names(cut.seat)
        parents = {name.removeprefix(_PART) for name in used if name.startswith(_PART)}
        return self._piece(parents | {self.joints[name] for name in used & self.joints.keys()})

    def _description(self, piece: str, tables: Mapping[str, list[Any]]) -> Description:
        cut, seats = self.cuts.get(piece), [c.seat for c in self.cuts.values() if self._below(c) == piece]
        places = [*(cut.freed(seat) if cut else seat for seat in seats), *([cut.pin] if cut else ())]
        places += self.spots.get(piece, [])
        spots = [place.name for place in places]
        coordinates = [self._started(q) for q in tables.get("coordinates", ())]
        own: dict[str, Any] = {
            name: tuple(map(self._freed, tables.get(name, ()))) for name, key in table_keys().items() if key.many
        }
        own["strict_units"] = False  # the whole has passed that check; places of loops are in any unit
        name, title = f"{self.base}_{piece if cut else 'base'}", f"{self.d.title}: {piece}"
        found = replace(self.d, **own | {"name": name, "title": title, "energy": self._energy(piece)})
        found = replace(
            found,
            coordinates=(*(cut.free_coordinates(self.start) if cut else ()), *coordinates),
            ports=Ports(forces=spots, torques=spots, poses=spots, velocities=spots),
        )
        return self._with_used(with_places(found, places))

    def _started(self, q: Coordinate) -> Coordinate:
        """``q`` with the start that the whole has."""
        of = self.start[q.name], self.start[names.velocity(q.name)]
        return replace(q, start=of[0], velocity=of[1], given=True, velocity_given=True)

    def _energy(self, piece: str) -> Energy:
        """The terms of the energies that belong to the ``piece``."""
        found: dict[str, sp.Expr] = {}
        for name in ("kinetic", "potential", "dissipation", "lagrangian"):
            whole = getattr(self.d.energy, name)
            for term in () if whole is None else sp.Add.make_args(sp.sympify(whole)):
                owners = {x for s in term.free_symbols for x in self.owners.get(s.name, ())} or {self.base}
                if len(owners) > 1 or not owners <= {self.base, *self.cuts}:
                    raise MechanismError(f"energy.{name}: the term {term} belongs to several pieces; cut elsewhere")
                if owners == {piece}:
                    found[name] = found.get(name, sp.S.Zero) + term
        return Energy(**found)

    def _with_used(self, d: Description) -> Description:
        """``d`` with those entries of the whole that it uses and that belong to no single piece."""
        kinds = {table: _PART if table == "points" else "" for table in _WHERE_USED}
        shared = {kinds[table] + x.name: x for table in _WHERE_USED for x in getattr(self.d, table)}
        own = {kinds[table] + x.name for table in ("points", "definitions") for x in getattr(d, table)}
        used = _reached([name for record in _records(d) for name in _names(record)], shared, own)
        tables: dict[str, Any] = {
            table: (*getattr(d, table), *(x for x in getattr(self.d, table) if kind + x.name in used))
            for table, kind in kinds.items()
        }
        return replace(d, **tables)


def _reached(waiting: list[str], shared: Mapping[str, Any], own: Collection[str]) -> set[str]:
    """The names of ``shared`` entries to which the names ``waiting`` lead, but those in ``own``."""
    used: set[str] = set()
    while waiting:
        name = waiting.pop()
        if name in shared and name not in own and name not in used:
            used.add(name)
            waiting += _names(shared[name])
    return used


def _records(d: Description) -> Iterator[Any]:
    """All entries of all tables."""
    for table, key in table_keys().items():
        content = getattr(d, table)
        if content is not None:
            yield from content if key.many else (content,)


def _names(record: Any) -> set[str]:
    """The names to which ``record`` refers: of symbols, and of parts with _PART before them."""
    found = {s.name for _, x, _ in expressions_of(record, "") for s in x.free_symbols}
    kind = "" if getattr(record, "kind", None) == "gear" else _PART  # a gear is between coordinates
    for key in keys_in(record):
        value = getattr(record, key.field)
        if key.kind == "part" and value is not None:
            found.add(_PART + str(value))
        elif key.kind == "names" and value is not None:
            found |= {kind + str(name) for name in value}
    coordinate = getattr(record, "coordinate", None)
    return found | ({str(coordinate)} if coordinate is not None else set())
