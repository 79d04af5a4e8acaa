"""The mechanism as places and the links between them, evaluated on the graph at any state; nothing is drawn here.

Positions come from the description by the composition of frames that the equations use as well. The joints between
them are read from transformation equations, see ``arms``.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, compress
from typing import NamedTuple

import numpy as np
import sympy as sp

from lag2fmu.description.places import WORLD
from lag2fmu.dynamics.frames import Frames
from lag2fmu.dynamics.starts import start_values
from lag2fmu.dynamics.variables import declare, translator
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.batches import Floats, Values, drawn, evaluate
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.vectors import Vector
from lag2fmu.language.definitions import written_out
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.arms import ARM, SHIFT, ArmStep, steps

_SAMPLES = 5
MOST_PARTS = 40
"""The most bodies of an arm whose positions are read; more would take long, and their picture would be a tangle."""


class SkeletonLine(NamedTuple):
    """A straight line of ``part`` (a body, point, frame or constraint) between the spots ``ends``.

    An ``arm`` turns about its first end by ``angles``.
    """

    part: str
    ends: tuple[int, int]
    arm: bool
    angles: frozenset[sp.Expr] = frozenset()


@dataclass
class Skeleton:
    """Spots (positions in world axes) by number, and what lies between them.

    ``place``: {body or point: spot}; ``hinges``: {coordinate: the spot about which it turns something}; ``sliders``:
    {coordinate: the spot that it alone shifts}; ``floating``: {coordinates: the spot that they shift together};
    ``stretches``: {coordinate: the two spots whose distance it is}; ``axes``: {frame: numbers of its three vectors};
    ``origins``: {frame: spot}.
    """

    mechanism: Mechanism
    place: dict[str, int] = field(default_factory=dict)
    links: list[SkeletonLine] = field(default_factory=list)
    hinges: dict[str, int] = field(default_factory=dict)
    sliders: dict[str, int] = field(default_factory=dict)
    floating: dict[str, int] = field(default_factory=dict)
    stretches: dict[str, tuple[int, int]] = field(default_factory=dict)
    axes: dict[str, tuple[int, int, int]] = field(default_factory=dict)
    origins: dict[str, int] = field(default_factory=dict)
    _nodes: list[Vector] = field(default_factory=list)
    _numbered: dict[Vector, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Put everything on a graph of its own, so that drawing cannot change the generated equations."""
        m = self.mechanism
        self.graph = Graph()
        self.variables = declare(self.graph, m)
        self.put = translator(self.graph, m, self.variables)
        self._meaning = written_out({d.name: d.expression for d in m.definitions})
        self.order = {name: i for i, name in enumerate(("t", *m.driven))}
        self.order |= {c.name: len(self.order) + i for i, c in enumerate(m.coordinates)}
        self.frames = Frames(self.graph, m, self.put)
        self.reads = len(m.places) <= MOST_PARTS
        for frame in m.frames:
            self._add_frame(frame.name)
        for part in m.places:
            self._add_place(part.name)

    # ------------------------------------------------------------------------------------------------ putting together

    def spot(self, nodes: Sequence[Node]) -> int:
        """The number of the position or vector with the entries ``nodes`` (2,) or (3,); equal ones share a number."""
        padded = (*nodes, *(self.graph.zero,) * (3 - len(nodes)))
        number = self._numbered.setdefault(padded, len(self._nodes))
        if number == len(self._nodes):
            self._nodes.append(padded)
        return number

    def _add_frame(self, name: str) -> None:
        frame = self.frames.by_name[name]
        self.origins[name] = here = self.spot(self.frames.origin(name))
        self.axes[name] = tuple(self.spot(axis) for axis in self.frames.axes(name))  # type: ignore[assignment]
        if frame.parent == WORLD:
            self._read(f"frames.{name}", tuple(frame.origin))
        else:
            self.join(f"frames.{name}", self.origins.get(str(frame.parent)), here, arm=True)
        for _, angle in frame.rotations:
            self._hinge(angle, here)

    def _add_place(self, name: str) -> None:
        frame, position = self.mechanism.location(name)
        if frame == WORLD:
            self.place[name] = self._read(name, position)
        else:
            here = self.spot(self.frames.position(frame, self.put.vector(position)))
            self.place[name] = here
            self.join(name, self.origins[frame], here, arm=True)
        angle = getattr(self._part(name), "angle", None)
        if angle is not None:
            self._hinge(angle, self.place[name])

    def _hinge(self, angle: sp.Expr, spot: int) -> None:
        """Record that the coordinates in ``angle`` turn something about ``spot``; the first record counts."""
        for name in sorted(s.name for s in self.written(angle).free_symbols if s.name in self.order):
            self.hinges.setdefault(name, spot)

    def _part(self, name: str) -> object:
        return next(part for part in self.mechanism.places if part.name == name)

    def _read(self, part: str, position: tuple[sp.Expr, ...]) -> int:
        """Add the links of a position in the world; return its spot."""
        here = self.spot(self.put.vector(position))
        if not self.reads:
            return here
        found = steps(tuple(map(self.written, position)), self.order)
        carriers = self._carriers(here) if found and found[-1].kind == ARM and not self._rigid_step(found[-1]) else []
        if carriers:
            carrier = carriers[0]
            for spot in carriers:
                self.join(part, spot, here, arm=True)
            for name in found[-1].names:
                self.hinges.setdefault(name, carrier)
            for name in found[-1].lengths:
                self.stretches.setdefault(name, (carrier, here))
            return here
        for step in found:
            here = self._add_step(part, step)
        return here

    def _rigid_step(self, step: ArmStep) -> bool:
        return self._apart(*(self.spot(self.put.vector(x)) for x in (step.start, step.end)))

    def _carriers(self, here: int) -> list[int]:
        """The moving places that keep their distance from the spot ``here``, as a trolley from its load.

        Among places that also keep their distance from each other only the first: one rod to them is enough.
        """
        still = self.still() if self.place else set()
        found: list[int] = []
        for i in dict.fromkeys(self.place.values()):
            carries = i != here and i not in still and self._apart(i, here)
            if carries and not any(self._apart(i, other) for other in found):
                found.append(i)
        return found

    def _apart(self, one: int, other: int) -> bool:
        """Whether two spots keep their distance whatever the coordinates are, while motions are held."""
        g = self.graph
        vector = [g.subtract(y, x) for x, y in zip(self._nodes[one], self._nodes[other], strict=True)]
        slopes, length = self.slopes([g.dot(vector, vector)]), evaluate(g, [g.dot(vector, vector)], self.samples)
        return bool(np.abs(slopes).max() <= 1e-9 * max(float(np.abs(length).max()), 1e-300))

    def _add_step(self, part: str, step: ArmStep) -> int:
        start, end = (self.spot(self.put.vector(x)) for x in (step.start, step.end))
        if step.kind == ARM:
            for name in step.names:
                self.hinges.setdefault(name, start)
            for name in step.lengths:
                self.stretches.setdefault(name, (start, end))
                self.sliders.pop(name, None)
            self.join(part, start, end, arm=True, angles=step.angles)
        elif step.kind == SHIFT:
            shifting = ", ".join(name for name in step.names if name != "t")
            (self.sliders if len(step.names) == 1 else self.floating).setdefault(shifting, end)
        return end

    def join(
        self,
        part: str,
        start: int | None,
        end: int,
        *,
        arm: bool,
        angles: frozenset[sp.Expr] = frozenset(),
    ) -> None:
        """Add a link of ``part`` between two spots, unless there is one."""
        if start is not None and start != end and not any(link.ends == (start, end) for link in self.links):
            self.links.append(SkeletonLine(part, (start, end), arm, angles))

    # ------------------------------------------------------------------------------------------------ in numbers

    def start(self) -> dict[str, float]:
        """The values of all variables at the start, in SI units."""
        return start_values(self.mechanism)

    @cached_property
    def samples(self) -> dict[str, Floats | float]:
        """{variable: SI values} at the start and near it, where positions are finite and constraints need not hold."""
        generator = random.Random(5)
        values: dict[str, Floats | float] = dict(self.start())
        moving = {c.name: c.nominal for c in self.mechanism.coordinates}
        moving |= dict.fromkeys(self.mechanism.driven, 1.0) | {"t": 1.0}
        for name, size in moving.items():
            values[name] = values[name] + size * np.append(0.0, drawn(generator, 0.7, _SAMPLES))
        known = np.asarray(np.isfinite(self.positions(values)).all(axis=(0, 1)))
        known[0] = True
        return {name: x if np.ndim(x) == 0 else np.asarray(x)[known] for name, x in values.items()}

    def positions(self, values: Values) -> Floats:
        """All spots and vectors at ``values``, (spots, 3, *batch), in m."""
        flat = evaluate(self.graph, [x for nodes in self._nodes for x in nodes], values)
        return flat.reshape(len(self._nodes), 3, *flat.shape[1:])

    def number(self, expression: object, values: Values) -> float:
        """The value of an expression in SI units."""
        return float(evaluate(self.graph, [self.put(sp.sympify(expression))], values)[0])

    @cached_property
    def masses(self) -> dict[str, float]:
        """{body: kg}, at the start."""
        nodes = [self.put(sp.sympify(body.mass)) for body in self.mechanism.placed_bodies]
        found = evaluate(self.graph, nodes, self.start())
        return {body.name: float(mass) for body, mass in zip(self.mechanism.placed_bodies, found, strict=True)}

    def vector(self, expressions: Sequence[sp.Expr], values: Values) -> Floats:
        """The values of (k,) expressions."""
        return evaluate(self.graph, self.put.vector(tuple(expressions)), values)

    def slopes(self, nodes: Sequence[Node], by_velocity: bool = False) -> Floats:
        """The derivatives (k, n, samples) of ``nodes`` (k,) by the coordinates, or velocities, at the samples.

        They are nan where a node has no value.
        """
        v, g = self.variables, self.graph
        variables = v.qd if by_velocity else v.q
        rows = [forward(g, nodes, {x: g.one}) for x in variables]
        flat = evaluate(g, [x for row in rows for x in row], self.samples)
        return np.swapaxes(flat.reshape(len(variables), len(nodes), -1), 0, 1)

    @cached_property
    def spot_slopes(self) -> Floats:
        """The derivatives of all spots by the coordinates at the samples, (spots, 3, n, samples)."""
        flat = self.slopes([x for nodes in self._nodes for x in nodes])
        return flat.reshape(len(self._nodes), 3, *flat.shape[1:])

    def rails(self) -> dict[int, Floats]:
        """{spot: direction (3,)} of the places and sliders that can only move along a line."""
        spots = sorted({*self.place.values(), *self.sliders.values()}) if self.reads else []
        found = {i: _line(self.spot_slopes[i]) for i in spots}
        return {i: along for i, along in found.items() if along is not None}

    def still(self) -> set[int]:
        """The spots that do not move, whatever the coordinates and motions are."""
        moved = self.positions(self.samples)
        return {i for i, place in enumerate(moved) if float(np.ptp(place, axis=1).max()) == 0.0}

    def nodes(self, spot: int) -> Vector:
        """The nodes (3,) of a spot."""
        return self._nodes[spot]

    @cached_property
    def rigid(self) -> frozenset[SkeletonLine]:
        """The links whose ends keep their distance whatever the coordinates are."""
        ends = ((self._nodes[i] for i in link.ends) for link in self.links)
        kept = self.keep_length([[*map(self.graph.subtract, b, a)] for a, b in ends])
        return frozenset(compress(self.links, kept))

    def keep_length(self, vectors: Sequence[Sequence[Node]]) -> list[bool]:
        """Whether each of ``vectors``, which have as many nodes each, has one length at all samples."""
        found = np.array_split(evaluate(self.graph, list(chain(*vectors)), self.samples), max(1, len(vectors)))
        lengths = [np.linalg.norm(x, axis=0) for x in found[: len(vectors)]]
        return [bool(np.ptp(x) <= 1e-9 * max(float(np.abs(x).max()), 1e-300)) for x in lengths]

    def written(self, expression: object) -> sp.Expr:
        """``expression`` with definitions written out."""
        return sp.sympify(expression).xreplace(self._meaning)

    def moves(self, expression: sp.Expr) -> bool:
        """Whether a coordinate, a motion or time stands in ``expression``."""
        return any(s.name in self.order for s in expression.free_symbols)


def _line(slopes: Floats) -> Floats | None:
    """The one direction (3,) of a spot's ``slopes`` (3, n, samples); None if it rests or moves in several."""
    if not np.isfinite(slopes).all() or np.ptp(slopes, axis=2).max() > 1e-9 * np.abs(slopes).max():
        return None
    left, singular, _ = np.linalg.svd(slopes[:, :, 0], full_matrices=False)
    if not singular[0] > 0 or (len(singular) > 1 and singular[1] > 1e-9 * singular[0]):
        return None
    along = left[:, 0]
    return np.asarray(along * np.sign(along[np.argmax(np.abs(along))]), dtype=np.float64)
