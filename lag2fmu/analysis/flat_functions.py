"""Equations in which functions that can be flat, such as narrow pulses, may have any value.

A force that is a narrow pulse is 0 at random states, and yet it changes momenta. So such functions are replaced by
variables with any value. A conserved quantity remains conserved, because the function then stands in its rate with both
signs.
"""

from __future__ import annotations

from dataclasses import replace

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.graph import Node
from lag2fmu.graph.operations import OPERATIONS

_FLAT = ("exp", "tanh", "heaviside", "sign", "choice", "lookup", "lookup_2")
_PARTLY = ("min", "max")
"""Flat on one side. In constraints they stay, which the velocities of states would not meet with other values."""


def freed_of_flat_functions(
    equations: EquationsOfMotion, gradients: list[list[Node]]
) -> tuple[EquationsOfMotion, list[list[Node]], list[str]]:
    """The equations and ``gradients`` with variables in place of functions that can be flat, and the variables' names.

    The new nodes are added to the graph of ``equations``, which is a copy (``apart``).
    """
    g, c = equations.graph, equations.constraints
    rows = [*equations.mass_matrix, *c.jacobian, equations.forcing, c.accelerations, *gradients]
    nodes = [node for row in rows for node in row]
    flat = _flat(equations, nodes)
    names_of = [f"any value {k}" for k in range(len(flat))]
    found = iter(g.substitute(nodes, dict(zip(flat, map(g.symbol, names_of), strict=True))))
    mass_matrix, jacobian, (forcing, gamma) = (
        [tuple(next(found) for _ in row) for row in part]
        for part in (equations.mass_matrix, c.jacobian, (equations.forcing, c.accelerations))
    )
    freed = replace(
        equations,
        mass_matrix=tuple(mass_matrix),
        forcing=forcing,
        constraints=replace(c, jacobian=tuple(jacobian), accelerations=gamma),
    )
    return freed, [[next(found) for _ in row] for row in gradients], names_of


def _flat(equations: EquationsOfMotion, nodes: list[Node]) -> list[Node]:
    """The functions in ``nodes`` that can be flat."""
    g, c = equations.graph, equations.constraints
    bound = set(g.cone(node for row in (*c.jacobian, c.accelerations) for node in row))
    named = ((node, OPERATIONS[g.code[node]].name) for node in g.cone(nodes))
    return [node for node, name in named if name in _FLAT or (name in _PARTLY and node not in bound)]
