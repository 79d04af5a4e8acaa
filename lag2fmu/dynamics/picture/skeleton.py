"""The mechanism as places and what joins them, evaluated on the graph at any state: pure geometry, nothing drawn.

Positions come from the record by the same composition of frames that the equations are made of; joints between them
from reading transformation equations, see ``arms``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from lag2fmu.dynamics.analysis.evaluation import Floats, Values, evaluate
from lag2fmu.dynamics.autodiff import forward
from lag2fmu.dynamics.frames import Frames
from lag2fmu.dynamics.graph import Graph
from lag2fmu.dynamics.picture.arms import ARM, SHIFT, Step, steps
from lag2fmu.dynamics.samples import start_values
from lag2fmu.dynamics.variables import declare, translator
from lag2fmu.dynamics.vectors import Vector
from lag2fmu.mechanism import Constraint, Mechanism
from lag2fmu.mechanism.expressions import symbol
from lag2fmu.mechanism.parts import WORLD

_SAMPLES = 5
MOST_PARTS = 60
"""Beyond this many bodies a position is not read for arms, which takes time and would be drawn as a tangle."""


@dataclass(frozen=True)
class Link:
    """A straight part of ``part`` (a body, point, frame or constraint) between the spots ``ends``.

    ``arm``: whether it turns about its first end by angles; ``newest``: the coordinate that it brings.
    """

    part: str
    ends: tuple[int, int]
    arm: bool
    newest: str | None = None
    angles: frozenset[sp.Expr] = frozenset()


@dataclass
class Skeleton:
    """Spots (positions in world axes) by number, and what lies between them.

    ``place``: {body or point: spot}; ``links``; ``hinges``: {coordinate: spot} about which it turns something;
    ``sliders``: {coordinate: spot} of what it shifts by itself; ``floating``: {coordinates: spot} likewise of several;
    ``axes``: {frame: numbers of three vectors}; ``origins``:
    {frame: spot}.
    """

    mechanism: Mechanism
    place: dict[str, int] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    hinges: dict[str, int] = field(default_factory=dict)
    sliders: dict[str, int] = field(default_factory=dict)
    floating: dict[str, int] = field(default_factory=dict)
    axes: dict[str, tuple[int, int, int]] = field(default_factory=dict)
    origins: dict[str, int] = field(default_factory=dict)
    _nodes: list[Vector] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Put everything on a graph of its own, so that drawing cannot change what is emitted."""
        m = self.mechanism
        self.graph = Graph()
        self.variables = declare(self.graph, m)
        self.put = translator(self.graph, m, self.variables)
        self._meaning = _written_out(m)
        self.order = {name: i for i, name in enumerate(("t", *(u.name for u in m.motions)))}
        self.order |= {c.name: len(self.order) + i for i, c in enumerate(m.coordinates)}
        self.frames = Frames(self.graph, m, self.put)
        self.reads = len(m.places) <= MOST_PARTS
        for frame in m.frames:
            self._add_frame(frame.name)
        for part in m.places:
            self._add_place(part.name)
        self._add_loops()

    # ------------------------------------------------------------------------------------------------ putting together

    def spot(self, nodes: Sequence[int]) -> int:
        """The number of the position or vector with the (2,) or (3,) ``nodes``; equal ones have one number."""
        padded = (*nodes, *(self.graph.zero,) * (3 - len(nodes)))
        if padded not in self._nodes:
            self._nodes.append(padded)
        return self._nodes.index(padded)

    def _add_frame(self, name: str) -> None:
        frame = self.frames.by_name[name]
        self.origins[name] = here = self.spot(self.frames.origin(name))
        self.axes[name] = tuple(self.spot(axis) for axis in self.frames.axes(name))  # type: ignore[assignment]
        if frame.parent == WORLD:
            self._read(f"frames.{name}", tuple(frame.origin))
        else:
            self._join(f"frames.{name}", self.origins.get(str(frame.parent)), here, arm=True)
        for _, angle in frame.rotations:
            for symbol in sorted(angle.free_symbols, key=str):
                if symbol.name in self.order:
                    self.hinges.setdefault(symbol.name, here)

    def _add_place(self, name: str) -> None:
        frame, position = self.mechanism.location(name)
        if frame == WORLD:
            self.place[name] = self._read(name, position)
        else:
            here = self.spot(self.frames.position(frame, self.put.vector(position)))
            self.place[name] = here
            self._join(name, self.origins[frame], here, arm=True)
        angle = getattr(self._part(name), "angle", None)
        if angle is not None:
            for symbol in sorted(angle.free_symbols, key=str):
                if symbol.name in self.order:
                    self.hinges.setdefault(symbol.name, self.place[name])

    def _part(self, name: str) -> object:
        return next(part for part in self.mechanism.places if part.name == name)

    def _read(self, part: str, position: tuple[sp.Expr, ...]) -> int:
        """Add the links of a position in the world; return its spot."""
        here = self.spot(self.put.vector(position))
        if not self.reads:
            return here
        for step in steps(self._written(position), self.order):
            here = self._add_step(part, step)
        return here

    def _add_step(self, part: str, step: Step) -> int:
        start, end = (self.spot(self.put.vector(x)) for x in (step.start, step.end))
        if step.kind == ARM:
            if step.newest is not None:
                self.hinges.setdefault(step.newest, start)
            self._join(part, start, end, arm=True, newest=step.newest, angles=step.angles)
        elif step.kind == SHIFT:
            (self.sliders if len(step.names) == 1 else self.floating).setdefault(", ".join(step.names), end)
        return end

    def _join(
        self,
        part: str,
        start: int | None,
        end: int,
        *,
        arm: bool,
        newest: str | None = None,
        angles: frozenset[sp.Expr] = frozenset(),
    ) -> None:
        if start is not None and start != end and not any(link.ends == (start, end) for link in self.links):
            self.links.append(Link(part, (start, end), arm, newest, angles))

    def _written(self, position: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
        return tuple(map(self.written, position))

    def _add_loops(self) -> None:
        """The links that holonomic constraints name in pairs: a polygon of arms that closes."""
        if not self.reads:
            return
        written = [c for c in self.mechanism.constraints if c.kind == "holonomic"]
        size = self.mechanism.dimension if self.mechanism.places else 2
        for first in range(0, len(written) - 1, 2):
            if size == 2:
                self._add_loop(written[first : first + 2])

    def _add_loop(self, pair: Sequence[Constraint]) -> None:
        """Every arm of the loop from where the body's arm with the same angles begins."""
        turning = [s for s in steps(self._written([c.expression for c in pair]), self.order) if s.kind == ARM]
        vectors = [self.put.vector(_minus(step)) for step in turning]
        if len(turning) < 2 or not all(map(self._rigid, vectors)):
            return
        values, bodies = self.start(), list(self.links)
        tips = []
        for step, vector in zip(turning, vectors, strict=True):
            for link in [x for x in bodies if x.angles == step.angles][:1]:
                start = self._nodes[link.ends[0]][:2]
                ways = ([self.graph.add(*x) for x in zip(start, vector, strict=True)],
                        [self.graph.subtract(*x) for x in zip(start, vector, strict=True)])
                tips.append((link, step, ways))
        numbers = [[self._numbers(way, values) for way in ways] for _, _, ways in tips]
        ends = [self._numbers(self._nodes[i][:2], values) for link in bodies for i in link.ends]
        for k, (link, step, ways) in enumerate(tips):
            others = [*ends, *(x for j, pair in enumerate(numbers) if j != k for x in pair)]
            near = [min(float(np.linalg.norm(x - y)) for y in others) for x in numbers[k]]
            here, tip = self._nodes[link.ends[0]], self._nodes[link.ends[1]]
            along = self._numbers(tip[:2], values) - self._numbers(here[:2], values)
            reach = numbers[k][0] - self._numbers(here[:2], values)
            turn = float(along[0] * reach[1] - along[1] * reach[0])
            parallel = abs(turn) <= 1e-9 * float(np.linalg.norm(along) * np.linalg.norm(reach))
            forward_way = float(along @ reach) > 0 if parallel else near[0] <= near[1]
            end = self.spot(ways[0 if forward_way else 1])
            self._join(f"constraints.{pair[0].name}", link.ends[0], end, arm=True, newest=step.newest, angles=step.angles)

    # ------------------------------------------------------------------------------------------------ in numbers

    def start(self) -> dict[str, float]:
        """The values of all variables at the start."""
        return start_values(self.mechanism)

    def samples(self) -> dict[str, Floats | float]:
        """Values at states all around the start, constraints not heeded."""
        generator = np.random.default_rng(5)
        values: dict[str, Floats | float] = dict(self.start())
        for c in self.mechanism.coordinates:
            values[c.name] = c.start + c.nominal * generator.uniform(-0.7, 0.7, _SAMPLES)
        values["t"] = generator.uniform(0.0, 2.0, _SAMPLES)
        for u in self.mechanism.motions:
            values[u.name] = u.start + generator.uniform(-0.7, 0.7, _SAMPLES)
        return values

    def positions(self, values: Values) -> Floats:
        """All spots and vectors at ``values``, (spots, 3, *batch)."""
        flat = evaluate(self.graph, [x for nodes in self._nodes for x in nodes], values)
        return flat.reshape(len(self._nodes), 3, *flat.shape[1:])

    def number(self, expression: object, values: Values | None = None) -> float:
        """The value of an expression at the start."""
        return float(self._numbers([self.put(sp.sympify(expression))], values or self.start())[0])

    def vector(self, expressions: Sequence[sp.Expr], values: Values) -> Floats:
        """The values of (k,) expressions."""
        return self._numbers(self.put.vector(tuple(expressions)), values)

    def slopes(self, nodes: Sequence[int], by_velocity: bool = False) -> Floats:
        """The derivatives of ``nodes`` (k,) by the coordinates (or velocities) at the samples, (k, n, samples)."""
        v, g = self.variables, self.graph
        variables = v.qd if by_velocity else v.q
        rows = [forward(g, nodes, {x: g.one}) for x in variables]
        flat = evaluate(g, [x for row in rows for x in row], self.samples())
        return np.swapaxes(flat.reshape(len(variables), len(nodes), -1), 0, 1)

    def nodes(self, spot: int) -> Vector:
        """The three nodes of a spot."""
        return self._nodes[spot]

    def rigid(self, link: Link) -> bool:
        """Whether the ends keep their distance whatever the coordinates are."""
        a, b = (self._nodes[i] for i in link.ends)
        return self._rigid([self.graph.subtract(y, x) for x, y in zip(a, b, strict=True)])

    def _rigid(self, vector: Sequence[int]) -> bool:
        found = evaluate(self.graph, vector, self.samples())
        length = np.linalg.norm(found, axis=0)
        return bool(np.ptp(length) <= 1e-9 * max(float(np.abs(length).max()), 1e-300))

    def _numbers(self, nodes: Sequence[int], values: Values) -> Floats:
        return evaluate(self.graph, list(nodes), values)

    def written(self, expression: object) -> sp.Expr:
        """``expression`` with definitions written out."""
        return sp.sympify(expression).xreplace(self._meaning)

    def moves(self, expression: sp.Expr) -> bool:
        """Whether a coordinate, a motion or time stands in ``expression``."""
        return any(s.name in self.order for s in expression.free_symbols)


def _minus(step: Step) -> tuple[sp.Expr, ...]:
    return tuple(b - a for a, b in zip(step.start, step.end, strict=True))


def _written_out(mechanism: Mechanism) -> dict[sp.Symbol, sp.Expr]:
    """{definition: its expression without definitions}."""
    named = {symbol(d.name): d.expression for d in mechanism.definitions}
    for _ in named:
        named = {key: value.xreplace(named) for key, value in named.items()}
    return named
