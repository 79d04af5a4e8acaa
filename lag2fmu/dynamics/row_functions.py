"""The functions of arrays, and the event functions, of the rows that modes switch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Array, EventFunction, Function, filling
from lag2fmu.dynamics.kinks import nominal_size
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.operations import CONSTANT, SYMBOL

if TYPE_CHECKING:
    from lag2fmu.dynamics.row_tables import ImplicitDampers, SparseRows


def rows_in_all_modes(
    equations: EquationsOfMotion, sliding: tuple[Node, ...], state: tuple[Array, ...], qdd: Array
) -> Iterator[Function]:
    """Functions that give gaps, slips, conditions and coefficients of the rows that modes switch, and sliding forces.

    ``state`` are the arrays t, x, u, p that the functions take, ``qdd`` is that of the n accelerations.
    """
    rows = equations.rows
    if not len(rows):
        return
    jacobian = [entry for row in rows.jacobian for entry in row]
    doc = "Of all rows in any mode: positions phi, velocities v, their Jacobian G (row-major), gamma of G qdd + gamma."
    of_rows = {"phi": rows.positions, "v": rows.velocities, "G": jacobian, "gamma": rows.accelerations}
    yield filling("mechanism_rows", doc, state, **of_rows)
    doc = "What event functions take of the rows: gaps phi, slip velocities v of the rows that may slide."
    slips = [rows.velocities[row] for row in rows.frictional]
    yield filling("mechanism_slips", doc, state, phi=rows.gaps, v=slips)
    doc = "Coefficients of contacts: sliding friction mu, static friction mu_s."
    yield filling("mechanism_contacts", doc, state, mu=rows.friction, mu_s=rows.static_friction)
    doc = "Coefficients of restitution e of contacts, which only impacts ask for."
    yield filling("mechanism_restitution", doc, state, e=rows.restitution)
    doc = "Forces S of the rows that slide, and of dry frictions the forces F that slide and the largest H that hold."
    yield filling("mechanism_friction", doc, (*state, qdd), S=sliding, F=rows.sliding, H=rows.holding)


def time_stepping_rows(
    equations: EquationsOfMotion, sparse: SparseRows | None, state: tuple[Array, ...], qdd: Array, factor: Function
) -> Iterator[Function]:
    """What a time step needs: forces, and the rows with those entries of their Jacobian that are not 0.

    Positions are wanted alone, too, and forces and rates of further states once more with other velocities: each costs
    a fraction of the whole. What does not depend on velocities is handed on, and so is what linear dampers pull at
    the beginning of the step, see ``implicit_dampers``. ``factor`` is ``mechanism_factor`` of M with them.
    """
    if sparse is None:
        return
    half = Array("half", (sparse.dampers.half,), scalar=True)
    permanent = sparse.contacts[0]
    forcing = tuple(("f", i, node) for i, node in enumerate(equations.forcing))
    rates = tuple(("dz", i, node) for i, node in enumerate(equations.variables.further_rates))
    entries = tuple(("G", i, node) for i, (*_, node) in enumerate(sparse.entries))
    held = sum(row < permanent for row, *_ in sparse.entries)
    positions = tuple(("phi", row, node) for row, node in sparse.positions.items())
    velocities = tuple(("v", row, node) for row, node in enumerate(sparse.velocities))
    kept, handed, late = _handed_on(equations, sparse.dampers)
    doc = (
        "Of M + half D, D that of linear dampers, what mechanism_factor gives of M; forcing f; of the rows in "
        "row_tables.h entries G, positions phi, velocities v; k, which the next functions take."
    )
    arrays, results = (*factor.arrays, "f", "G", "phi", "v", "k"), (*factor.results, *forcing, *entries)
    yield Function("mechanism_stepping", doc, (*state, half), arrays, (*results, *positions, *velocities, *handed))
    doc = "Of the rows in row_tables.h positions phi, of permanent constraints entries G and velocities v, too."
    results = (*entries[:held], *positions, *velocities[:permanent])
    yield Function("mechanism_placing", doc, state, ("G", "phi", "v"), results)
    doc = "Of the permanent constraints, the first rows in row_tables.h, positions phi, entries G and velocities v."
    results = tuple(result for result in results if result[0] != "phi" or result[1] < permanent)
    yield Function("mechanism_holding", doc, state, ("G", "phi", "v"), results)
    doc = (
        "Forcing f, with k of mechanism_stepping at the same time, positions, inputs and parameters; linear dampers "
        "pull as they did there."
    )
    yield Function("mechanism_forcing", doc, (*state, kept), ("f",), late)
    doc = (
        "What mechanism_further gives, with k of mechanism_stepping at the same time, positions, inputs and parameters."
    )
    yield Function("mechanism_stepped_further", doc, (*state, qdd, kept), ("dz",), rates)


Results = tuple[tuple[str, int, Node], ...]
"""What a function fills: (array, index, node)."""


def _handed_on(equations: EquationsOfMotion, dampers: ImplicitDampers) -> tuple[Array, Results, Results]:
    """The array k as later functions take it, what fills it, and the forcing by what it keeps."""
    g = equations.graph
    still = _still(equations, [*dampers.rest, *equations.variables.further_rates])
    pulls = {i: g.symbol(f"drag {i}") for i in dampers.drag}
    handed = tuple(("k", i, node) for i, node in enumerate((*still, *dampers.drag.values())))
    late = tuple(("f", i, g.subtract(node, pulls.get(i, g.zero))) for i, node in enumerate(dampers.rest))
    return Array("k", (*still, *pulls.values())), handed, late


def _still(equations: EquationsOfMotion, results: Sequence[Node]) -> tuple[Node, ...]:
    """What the ``results`` are made of that does not move with velocities, further states, accelerations and loads."""
    g, v = equations.graph, equations.variables
    fixed = {v.t, *v.q, *v.signals, *v.parameters}
    still, found = dict[Node, bool](), dict[Node, None]()
    for node in g.cone(results):
        operands = g.operands[node]
        leaf = g.code[node] in (CONSTANT, SYMBOL)
        still[node] = node in fixed or g.code[node] == CONSTANT if leaf else all(still[x] for x in operands)
        if not still[node]:
            found |= dict.fromkeys(x for x in operands if still[x])
    found |= dict.fromkeys(x for x in results if still[x])
    return tuple(node for node in found if g.code[node] not in (CONSTANT, SYMBOL))


def contact_events(equations: EquationsOfMotion) -> Iterator[EventFunction]:
    """The event functions of contacts and dry frictions.

    A contact has two: one of its gap (m) or force (N), and one of its slip (m/s). A dry friction has one. Nominal sizes
    are those of gaps and slips.
    """
    g, v, mechanism, rows = equations.graph, equations.variables, equations.mechanism, equations.rows
    for contact, gap in zip(mechanism.unilaterals, rows.gaps, strict=True):
        size = nominal_size(g, v, mechanism, gap)
        yield EventFunction(f"{contact.name}: gap or force", size)
        yield EventFunction(f"{contact.name}: slip or friction", size)
    first = len(rows.slips) + sum(rows.slips)
    for friction, slip in zip(mechanism.frictions, rows.velocities[first:], strict=False):
        yield EventFunction(f"{friction.name}: slip or friction", nominal_size(g, v, mechanism, slip))
