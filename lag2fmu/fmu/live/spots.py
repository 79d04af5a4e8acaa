"""The places and directions of a picture's parts as a function in C of the state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from lag2fmu.dynamics.functions import Array, Program, filling
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.operations import SYMBOL
from lag2fmu.picture.skeleton import Skeleton

FUNCTION = "picture_spots"
_DOC = "The spots of the picture, and the residuals of holonomic constraints."


class Spots:
    """Collects the places and directions that a page asks for, (3,) each, on the graph of a skeleton."""

    def __init__(self, skeleton: Skeleton) -> None:
        """Start without spots."""
        self.skeleton = skeleton
        self.numbers: list[int] = []
        v = skeleton.variables
        self._known = {v.t, *v.states, *v.signals, *v.parameters}

    def __call__(self, spot: int) -> int:
        """The page's number of the skeleton's ``spot``."""
        if spot not in self.numbers:
            self.numbers.append(spot)
        return self.numbers.index(spot)

    def vector(self, nodes: Iterable[Node]) -> int:
        """The number of the place or direction whose entries are up to three ``nodes``."""
        return self(self.skeleton.spot(tuple(nodes)))

    def calculable(self, nodes: Sequence[Node]) -> bool:
        """Whether ``nodes`` follow from the time, states, inputs and parameters alone."""
        g = self.skeleton.graph
        return all(node in self._known for node in g.cone(nodes) if g.code[node] == SYMBOL)

    def program(self, lowered: Program | None) -> Program:
        """The function that computes the spots, followed by the residuals of the holonomic constraints.

        It has the arguments of the functions of ``lowered``, the program of the same mechanism.
        """
        s, v = self.skeleton, self.skeleton.variables
        modes = 0 if lowered is None else lowered.masks + lowered.switches
        switches = tuple(s.graph.symbol(f"mode {k}") for k in range(modes))
        state = (Array("t", (v.t,), True), Array("x", v.states), Array("u", v.signals))
        places = [x for spot in self.numbers for x in s.nodes(spot)]
        arguments = (*state, Array("p", (*switches, *v.parameters)))
        function = filling(FUNCTION, _DOC, arguments, spots=[*places, *self.residuals()])
        return Program(s.graph, (function.check(s.graph),), "", 0, (), (), ())

    def residuals(self) -> list[Node]:
        """The residuals of the holonomic constraints that always hold."""
        s = self.skeleton
        written = [c for c in s.mechanism.constraints if c.kind == "holonomic"]
        nodes = [s.put(c.expression) for c in written]
        return [node for node in nodes if self.calculable([node])]


def no_spots() -> Program:
    """The function without results, for a mechanism that has nothing to draw."""
    graph = Graph()
    arguments = (Array("t", (graph.symbol("t"),), True), *(Array(name, ()) for name in "xup"))
    return Program(graph, (filling(FUNCTION, _DOC, arguments, spots=[]),), "", 0, (), (), ())
