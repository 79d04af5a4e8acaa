"""Margins that other kinks hold at 0, as max(0, r - x) is away from a wall: a switch does not tell their sign.

Which of these kinks hold is a matter of their switches. So whether a margin is held does not change between events, and
is no comparison with 0, which a solver step that ends at the event would meet by rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lag2fmu.graph.derivatives import kink_margin
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import OPERATIONS, SYMBOL

_FIRST = {"divide", "negate", "passed", "sqrt", "abs", "sign", "power", "power_or_zero", "sin", "tan", "asin", "atan"}
_FIRST |= {"sinh", "tanh"}
"""The operations that are 0 where their first operand is."""
_MOST = 500
"""The most nodes that are looked at in one margin. One with more, as a sum of ten kinks, is not told to be held."""


Switches = Callable[[Node], "Node | None"]
"""A function that gives the switch of a margin, None if it has none."""


def beside_zero(g: Graph, switch_of: Switches, margin: Node, formula: Node, at_zero: Node) -> Node:
    """``formula`` of a kink, or ``at_zero`` as long as other kinks hold its ``margin`` at 0.

    The other kinks are formulas with switches in ``margin`` already, but for those that stay kinks below roots.
    """
    return g.choose(_Held(g, switch_of).where(margin), at_zero, formula)


@dataclass
class _Held:
    """Looks for the switches with which a margin of the graph is 0, whatever the motion."""

    g: Graph
    switch_of: Switches
    looked: int = 0

    def where(self, node: Node) -> Node:
        """A node that is 1 where the switches hold ``node`` at 0, and 0 elsewhere."""
        g = self.g
        name, operands = OPERATIONS[g.code[node]].name, g.operands[node]
        self.looked += 1
        if self.looked > _MOST:
            return g.zero
        if g.is_constant(node):
            return g.one if g.value(node) == 0 else g.zero
        parts = self._branches(node) if name != "multiply" else None
        if parts is not None:
            return g.choose(parts[0], self.where(parts[1]), self.where(parts[2]))
        if name == "multiply":
            return g.choose(self.where(operands[0]), g.one, self.where(operands[1]))
        if name in ("add", "subtract"):
            return self._sum(name, *operands)
        return self.where(operands[0]) if name in _FIRST else g.zero

    def _sum(self, name: str, a: Node, b: Node) -> Node:
        """Where a + b or a - b is 0: both are, or, in the branches of a kink, they cancel."""
        g, join = self.g, self.g.add if name == "add" else self.g.subtract
        for place, node in enumerate((a, b)):
            parts = self._branches(node)
            if parts is not None:
                switch, *branches = parts
                sums = [join(branch, b) if place == 0 else join(a, branch) for branch in branches]
                return g.choose(switch, *map(self.where, sums))
        return g.choose(self.where(a), self.where(b), g.zero)

    def _branches(self, node: Node) -> tuple[Node, Node, Node] | None:
        """(switch, what ``node`` is where this is +1, what it is where this is -1); None if it has no such parts."""
        g = self.g
        name, operands = OPERATIONS[g.code[node]].name, g.operands[node]
        if name == "choice":
            return operands[0], operands[1], operands[2]
        if name in ("min", "max", "abs"):
            return self._kept(name, kink_margin(g, node), operands)
        for switch, other in (operands, operands[::-1]) if name == "multiply" else ():
            if g.code[switch] == SYMBOL and str(g.leaf[switch]).startswith("switch "):
                return switch, other, g.negate(other)
        return None

    def _kept(self, name: str, margin: Node | None, operands: tuple[Node, ...]) -> tuple[Node, Node, Node] | None:
        """The parts of a kink ``name`` that has a switch of its ``margin``, but is no formula with it."""
        switch = None if margin is None else self.switch_of(margin)
        if switch is None:
            return None
        if name == "abs":
            return switch, operands[0], self.g.negate(operands[0])
        a, b = operands if name == "max" else operands[::-1]
        return switch, a, b
