"""A mechanism in pieces: the frames of a tree that is cut, and what belongs to each piece.

A piece that is cut off moves freely: its frame gets three coordinates and a quaternion. What works across a cut goes
with the joint if it is a spring or a damper of the joint's coordinate; anything else is an error that names it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.description import Description, label_of, table_keys
from lag2fmu.description.keys import keys_in
from lag2fmu.description.parts import Damper, Energy, Spring
from lag2fmu.description.places import AXES, WORLD, Frame, expressions_of
from lag2fmu.description.ports import Ports
from lag2fmu.description.symbols import Coordinate
from lag2fmu.errors import MechanismError
from lag2fmu.language.units import DIMENSIONLESS, METRE
from lag2fmu.language.vocabulary import symbol, value_of
from lag2fmu.mechanism.cuts import Cut, cut_at
from lag2fmu.mechanism.geometry import values_of
from lag2fmu.mechanism.record import Mechanism

_WHERE_USED = ("parameters", "inputs", "tables", "definitions", "points")
"""The tables of entries that may stand in several pieces, as far as they belong to none of them."""


@dataclass(frozen=True)
class Link:
    """The joint of a ``cut`` between the pieces ``inner`` and ``outer``, with the numbers of its own force in SI."""

    cut: Cut
    inner: str
    outer: str
    damping: float
    stiffness: float
    rest: float


@dataclass(frozen=True)
class Pieces:
    """{piece: its description}, the joints between them, and the names of outputs that belong to no single piece."""

    descriptions: Mapping[str, Description]
    links: tuple[Link, ...]
    left_out: tuple[str, ...]


def opened(m: Mechanism) -> Description:
    """``m`` without parts, joints on a parent and ports: they are written out, as frames, coordinates and loads.

    Raises MechanismError for filtered motions.
    """
    if m.filtered:
        raise MechanismError(f"the motion '{m.filtered[0]}' is filtered; a mechanism with filters is not cut")
    brought = {place for place, origin in m.origins.items() if origin.startswith(("joints.", "contacts.", "frames."))}
    tables = {name: getattr(m, name) for name in table_keys() if name not in ("parts", "ports", "joints")}
    for name in ("constraints", "outputs", "dampers", "definitions"):
        tables[name] = tuple(x for x in tables[name] if f"{name}.{label_of(x)}" not in brought)
    joints = tuple(joint for joint in m.joints if joint.between is not None)
    tables["constraints"] += m.latches
    return replace(m.description, parts=(), joints=joints, ports=Ports(), **tables)


def cuts_of(d: Description, at: Iterable[str]) -> tuple[Cut, ...]:
    """The cuts of ``d``, as ``opened`` gives it, at the frames or coordinates ``at``. Raises MechanismError."""
    found = tuple(cut_at(d, name, values_of(d)) for name in at)
    frames = [cut.frame for cut in found]
    twice = next((frame for i, frame in enumerate(frames) if frame in frames[:i]), None)
    if twice is not None:
        raise MechanismError(f"--at {twice}: is given twice; leave one out")
    return found


def with_pins(d: Description, cuts: Sequence[Cut]) -> Description:
    """``d`` with outputs PIN_position_x, ... of pose and velocity of all pieces that are cut off."""
    pins = tuple(Frame(_measured(cut), cut.frame) for cut in cuts)
    spots = [pin.name for pin in pins]
    return replace(d, frames=(*d.frames, *pins), ports=Ports(poses=spots, velocities=spots))


def _measured(cut: Cut) -> str:
    return f"{cut.frame}_cut"


def in_pieces(d: Description, cuts: Sequence[Cut], start: Mapping[str, float]) -> Pieces:
    """The pieces of ``d`` between ``cuts``; ``start``: the values of its coordinates and of the outputs of the pins.

    Raises MechanismError for what works across a cut and is no spring or damper of the joint's coordinate.
    """
    return _Splitter(d, cuts, start).pieces()


class _Splitter:
    """Who owns what: ``owners`` {name: pieces}; the coordinates of joints are owned by their cuts."""

    def __init__(self, d: Description, cuts: Sequence[Cut], start: Mapping[str, float]) -> None:
        self.d, self.cuts, self.start = d, {cut.frame: cut for cut in cuts}, start
        self.values, self.base = values_of(d), d.name
        if self.base in self.cuts:
            raise MechanismError(f"--at {self.base}: the mechanism has this name too; rename one of them")
        parents = {frame.name: str(frame.parent) for frame in d.frames}
        self.piece = {frame: self._piece(frame, parents) for frame in parents}
        self.owners: dict[str, set[str]] = {frame: {piece} for frame, piece in self.piece.items()}
        self.joints = {q: frame for frame, cut in self.cuts.items() for q in cut.coordinates}
        self._own_coordinates()
        for table in ("bodies", "points", "definitions", "states"):
            for record in getattr(d, table):
                self.owners[record.name] = self.owners.get(record.name, set()) | self.of(record)

    def _piece(self, frame: str, parents: Mapping[str, str]) -> str:
        """The piece of a ``frame``: the next one on the way to the world that is cut off, else the base."""
        while frame != WORLD and frame not in self.cuts:
            frame = parents[frame]
        return self.base if frame == WORLD else frame

    def _own_coordinates(self) -> None:
        """A coordinate belongs to the pieces whose frames it moves, and to the base if it moves none."""
        for q in self.d.coordinates:
            moved = {self.piece[f.name] for f in self.d.frames if f.name not in self.cuts and q.name in _names(f)}
            if len(moved) > 1 or (moved and q.name in self.joints):
                where = " and ".join(sorted(moved | {self.joints.get(q.name, "")} - {""}))
                raise MechanismError(f"the coordinate '{q.name}' moves several pieces, {where}; cut elsewhere")
            owner = {f"joint {self.joints[q.name]}"} if q.name in self.joints else moved or {self.base}
            for name in (names.velocity, names.acceleration, names.generalized_force, str):
                self.owners[name(q.name)] = owner

    def of(self, record: Any) -> set[str]:
        """The pieces to which a ``record`` belongs, by all that it refers to."""
        return {piece for name in _names(record) for piece in self.owners.get(name, ())}

    def pieces(self) -> Pieces:
        """Everything where it belongs."""
        tables: dict[str, dict[str, list[Any]]] = {piece: {} for piece in (self.base, *self.cuts)}
        own: dict[str, list[Spring | Damper]] = {frame: [] for frame in self.cuts}
        left_out: list[str] = []
        shared = ("parameters", "inputs", "tables")
        for table in (name for name, key in table_keys().items() if key.many and name not in shared):
            for record in getattr(self.d, table):
                owners = self.of(record) or {self.base}
                (owner,) = owners if len(owners) == 1 else (None,)
                if table == "frames":
                    owner = self.piece[record.name]
                if table == "coordinates" and record.name in self.joints:
                    continue
                if owner in tables:
                    tables[owner].setdefault(table, []).append(record)
                elif owner is not None and isinstance(record, Spring | Damper):
                    own[owner.removeprefix("joint ")].append(record)
                elif table == "outputs":
                    left_out.append(record.name)
                elif table != "definitions":
                    self._refuse(table, record, owners)
        links = tuple(self._link(cut, own[frame]) for frame, cut in self.cuts.items())
        found = {piece: self._description(piece, tables[piece]) for piece in tables}
        return Pieces(found, links, tuple(left_out))

    def _refuse(self, table: str, record: Any, owners: Iterable[str]) -> None:
        sides = " and ".join(f"'{x}'" for x in sorted(owners))
        raise MechanismError(
            f"{table}.{label_of(record)}: works across a cut, on {sides}; only springs and dampers of a joint's own "
            "coordinate go with the joint"
        )

    def _link(self, cut: Cut, own: Iterable[Spring | Damper]) -> Link:
        """The joint of ``cut``, with its ``own`` springs and dampers: all of them linear in its coordinate."""
        q, damping, stiffness, push = symbol(cut.coordinates[0]) if cut.coordinates else sp.S.Zero, 0.0, 0.0, 0.0
        rate = symbol(names.velocity(str(q)))
        for record in own:
            of, by = (record.elongation, q) if isinstance(record, Spring) else (record.rate, rate)
            constant = sp.sympify(record.stiffness if isinstance(record, Spring) else record.damping or sp.nan)
            slope = sp.nan if of is None else sp.sympify(of).diff(by)
            if (
                sp.nan in (slope, constant)
                or not {s.name for s in (slope * constant).free_symbols} <= self.values.keys()
            ):
                self._refuse("springs" if isinstance(record, Spring) else "dampers", record, {cut.frame})
            ratio, size = value_of(slope, self.values) / cut.scale, value_of(constant, self.values)
            if isinstance(record, Spring):
                stiffness += size * ratio**2
                push += size * ratio * value_of(sp.sympify(of).xreplace({q: sp.S.Zero}), self.values)
            else:
                damping += size * ratio**2
        rest = -push / stiffness if stiffness else 0.0
        return Link(cut, self.piece_below(cut), cut.frame, damping, stiffness, rest)

    def piece_below(self, cut: Cut) -> str:
        """The piece on which the piece of ``cut`` stands."""
        return self.piece.get(str(cut.seat.parent), self.base)

    # ------------------------------------------------------------------------------------------ one description

    def _description(self, piece: str, tables: Mapping[str, list[Any]]) -> Description:
        cut, seats = self.cuts.get(piece), [c.seat for c in self.cuts.values() if self.piece_below(c) == piece]
        frames = [self._freed(f) if f.name == piece else f for f in tables.get("frames", ())]
        spots = [seat.name for seat in seats] + ([cut.pin.name] if cut else [])
        coordinates = [self._started(q) for q in tables.get("coordinates", ())]
        own: dict[str, Any] = {name: tuple(tables.get(name, ())) for name, key in table_keys().items() if key.many}
        name, title = f"{self.base}_{piece if cut else 'base'}", f"{self.d.title}: {piece}"
        found = replace(self.d, **own | {"name": name, "title": title, "energy": self._energy(piece)})
        found = replace(
            found,
            coordinates=(*([*self._free(cut)] if cut else ()), *coordinates),
            frames=(*frames, *seats, *([cut.pin] if cut else ())),
            ports=Ports(forces=spots, torques=spots, poses=spots, velocities=spots),
        )
        return self._with_used(found)

    def _started(self, q: Coordinate) -> Coordinate:
        """``q`` with the start that the whole has."""
        of = self.start[q.name], self.start[names.velocity(q.name)]
        return replace(q, start=of[0], velocity=of[1], given=True, velocity_given=True)

    def _freed(self, frame: Frame) -> Frame:
        """A ``frame`` that was cut off: three coordinates and a quaternion place it in the world."""
        place = [symbol(f"{frame.name}_{x}") for x in AXES]
        return Frame(frame.name, WORLD, place, quaternion=[symbol(f"{frame.name}_e{i}") for i in range(4)])

    def _free(self, cut: Cut) -> Iterator[Coordinate]:
        """The coordinates of the frame of ``cut``; e' = (0, omega) e/2 with omega in the world's axes."""
        at = _measured(cut)

        def of(quantity: str, ends: Iterable[object]) -> list[float]:
            return [self.start[f"{at}_{quantity}_{end}"] for end in ends]

        for x, place, speed in zip(AXES, of("position", AXES), of("velocity", AXES), strict=True):
            yield Coordinate(f"{cut.frame}_{x}", METRE, place, speed, doc=f"place of {cut.frame}, {x}")
        e, w = of("quaternion", range(4)), of("angular_velocity", AXES)
        (a, b, c, d), (x_, y_, z_) = e, w
        rates = (
            -(b * x_ + c * y_ + d * z_),
            a * x_ + y_ * d - z_ * c,
            a * y_ + z_ * b - x_ * d,
            a * z_ + x_ * c - y_ * b,
        )
        for i, rate in enumerate(rates):
            name, doc = f"{cut.frame}_e{i}", f"quaternion of {cut.frame}"
            yield Coordinate(name, DIMENSIONLESS, e[i], rate / 2, doc=doc, given=True, velocity_given=True)

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
        shared = {x.name: (table, x) for table in _WHERE_USED for x in getattr(self.d, table)}
        used: dict[str, tuple[str, Any]] = {}
        kept = {x.name for table in ("points", "definitions") for x in getattr(d, table)}
        waiting = [name for table, key in table_keys().items() if getattr(d, table) is not None
                   for x in (getattr(d, table) if key.many else [getattr(d, table)]) for name in _names(x)]  # fmt: skip
        while waiting:
            name = waiting.pop()
            if name in shared and name not in used and name not in kept:
                used[name] = shared[name]
                waiting += _names(shared[name][1])
        own: dict[str, Any] = {
            table: (*getattr(d, table), *(x for x in getattr(self.d, table) if used.get(x.name) == (table, x)))
            for table in _WHERE_USED
        }
        return replace(d, **own)


def _names(record: Any) -> set[str]:
    """The names to which ``record`` refers, of symbols and of parts."""
    found = {s.name for _, x, _ in expressions_of(record, "") for s in x.free_symbols}
    for key in keys_in(record):
        value = getattr(record, key.field)
        if key.kind == "part" and value is not None:
            found.add(str(value))
        elif key.kind == "names" and value is not None:
            found |= set(map(str, value))
    coordinate = getattr(record, "coordinate", None)
    return found | ({str(coordinate)} if coordinate is not None else set())
