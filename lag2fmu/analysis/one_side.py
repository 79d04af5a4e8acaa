"""Equations on one side of the kinks that their constraints have.

A constraint such as z = max(x, 0)**2 may be flat at all states near the start, and its other side out of their reach.
There is no need to go there: what max(x, 0) is on either side, x or 0, can stand in its place everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.derivatives import kink_margin
from lag2fmu.graph.fingerprint import PRIME
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import OPERATIONS


def on_each_side(
    equations: EquationsOfMotion, further: Sequence[Node]
) -> Iterator[tuple[EquationsOfMotion, list[Node]]]:
    """The ``equations`` and the ``further`` nodes (k,) as they are, and on either side of the constraints' kinks.

    The two sides are left out where constraints have no kinks that the motion may pass. New nodes are added to the
    graph of ``equations``, which is a copy (``apart``).
    """
    yield equations, list(further)
    g, c = equations.graph, equations.constraints
    margins = _margins(equations)
    if not margins:
        return
    parts = (*equations.mass_matrix, equations.forcing, *c.jacobian, c.positions, c.velocities, c.accelerations)
    nodes = [node for part in (*parts, tuple(further)) for node in part]
    for positive in (True, False):
        found = iter(_replaced(g, nodes, margins, positive))
        rows = [tuple(next(found) for _ in part) for part in parts]
        n = len(equations.mass_matrix)
        *jacobian, positions, velocities, accelerations = rows[n + 1 :]
        bound = replace(
            c, jacobian=tuple(jacobian), positions=positions, velocities=velocities, accelerations=accelerations
        )
        yield replace(equations, mass_matrix=tuple(rows[:n]), forcing=rows[n], constraints=bound), list(found)


def _margins(equations: EquationsOfMotion) -> set[int]:
    """The keys of the margins of the constraints' kinks that contain coordinates, velocities or the time."""
    g, c, v = equations.graph, equations.constraints, equations.variables
    moving = {v.t, *v.states}
    margins = [kink_margin(g, node) for node in g.cone((*c.positions, *c.velocities))]
    return {_key(g, margin)[0] for margin in margins if margin is not None and moving & {*g.cone([margin])}}


def _key(g: Graph, margin: Node) -> tuple[int, bool]:
    """A key that margins of equal and of opposite value share, and which of the two opposites ``margin`` is."""
    mark = g.marks[margin]
    return min(mark, -mark % PRIME), mark > -mark % PRIME


def _replaced(g: Graph, nodes: Sequence[Node], margins: set[int], positive: bool) -> list[Node]:
    """The ``nodes`` (k,) with what their kinks are where the ``margins``, given by their keys, are ``positive``."""
    new: dict[Node, Node] = {}
    for node in g.cone(nodes):
        operands, margin = [new[operand] for operand in g.operands[node]], kink_margin(g, node)
        key, opposite = (0, False) if margin is None else _key(g, margin)
        if margin is None or key not in margins:
            new[node] = g.rebuild(node, operands)
        else:
            new[node] = _formula(g, OPERATIONS[g.code[node]].name, operands, positive != opposite)
    return [new[node] for node in nodes]


def _formula(g: Graph, name: str, operands: Sequence[Node], positive: bool) -> Node:
    """What the kink ``name`` of ``operands`` is where its margin is ``positive``, or where it is negative."""
    if name in ("sign", "abs"):
        value = g.one if name == "sign" else operands[0]
        return value if positive else g.negate(value)
    if name == "heaviside":
        return g.one if positive else g.zero
    if name == "choice":
        return operands[1] if positive else operands[2]
    return operands[0] if positive == (name == "max") else operands[1]
