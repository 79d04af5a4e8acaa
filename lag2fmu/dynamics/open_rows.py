"""Accelerations and multipliers as one formula in the mode in which all rows that modes switch are open.

Open contacts, stops and latches bear nothing, and dry friction exerts its sliding force. If this force depends on what
constraints bear, each of the two depends on the other. Then there is no formula, and the engine solves for both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.schur_complement import ConstrainedSolution, solve_constrained
from lag2fmu.graph.autodiff import reverse
from lag2fmu.graph.graph import Node


def solve_open(
    equations: EquationsOfMotion, places: Sequence[int], sliding: Sequence[Node], drift: Sequence[Node]
) -> ConstrainedSolution | None:
    """The solution of ``equations`` with all rows open, as ``schur_complement.solve_constrained`` finds it.

    ``places`` are those of the rows among the constraints. ``sliding`` are the forces (N,) of the frictional rows,
    ``drift`` (m,) is that of all constraints. The squares of the rows are 0, their margins 1. None where
    ``solve_constrained`` gives None, and where a force of dry friction depends on what constraints bear.
    """
    g, v, rows = equations.graph, equations.variables, equations.rows
    first = len(rows.frictional) - len(rows.sliding)
    rubbing = dict(zip(rows.frictional[first:], sliding[first:], strict=True))
    if not set(v.unknowns).isdisjoint(g.cone(rubbing.values())):
        return None
    permanent = [k for k in range(len(equations.constraints)) if k not in places]
    found = solve_constrained(
        replace(equations, constraints=equations.permanent, forcing=_with_friction(equations, rubbing)),
        [drift[k] for k in permanent],
    )
    if found is None:
        return None
    n = len(v.q)
    multipliers = dict(zip(permanent, found.unknowns[n:], strict=True))
    multipliers |= {places[row]: force for row, force in rubbing.items()}
    margins = dict(zip(permanent, found.margins, strict=True))
    squares = dict(zip(permanent, found.squares, strict=True))
    every = range(len(equations.constraints))
    return ConstrainedSolution(
        unknowns=(*found.unknowns[:n], *(multipliers.get(k, g.zero) for k in every)),
        pivots=found.pivots,
        margins=tuple(margins.get(k, g.one) for k in every),
        squares=tuple(squares.get(k, g.zero) for k in every),
    )


def _with_friction(equations: EquationsOfMotion, rubbing: Mapping[int, Node]) -> tuple[Node, ...]:
    """The forcing (n,) and the generalized forces of ``rubbing`` {row: force along it} together."""
    g, v, rows = equations.graph, equations.variables, equations.rows
    seeds: dict[Node, Node] = {}
    for row, force in rubbing.items():
        velocity = rows.velocities[row]
        seeds[velocity] = g.add(seeds.get(velocity, g.zero), force)
    pushes = reverse(g, seeds, v.qd)
    return tuple(g.add(force, push) for force, push in zip(equations.forcing, pushes, strict=True))
