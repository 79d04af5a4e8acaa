"""The rows of all constraints for time stepping: the entries of their Jacobian that are not 0, and which rows meet.

A row meets another if a multiplier of the one changes the acceleration along the other. This is so if they share a
block: coordinates that the mass matrix, a linear damper or a permanent constraint ties. Rows of one colour share no
block, so that one solution of M a = b serves all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate

from lag2fmu.dynamics.blocks import united
from lag2fmu.dynamics.elimination import mass_matrix
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.modes import ModeNumbers
from lag2fmu.dynamics.parts import Entries
from lag2fmu.dynamics.row_tables import ImplicitDampers, SparseRows
from lag2fmu.graph.graph import Node


def sparse_rows(
    equations: EquationsOfMotion, modes: ModeNumbers, places: Sequence[int], dampers: ImplicitDampers
) -> SparseRows:
    """The rows of ``equations``, among whose constraints ``modes.with_rows`` has put those that switch at ``places``.

    Source: T. F. Coleman, J. J. More, Estimation of sparse Jacobian matrices and graph coloring problems, SIAM J.
    Numer. Anal. 20 (1983), for the colours.
    """
    g, rows, permanent = equations.graph, equations.rows, equations.permanent
    order = [*range(len(permanent)), *(len(permanent) + row for row in _by_contact(rows.slips, len(rows)))]
    among = [k for k in range(len(equations.constraints)) if k not in places]
    jacobian = [*permanent.jacobian, *rows.jacobian]
    velocities = [*permanent.velocities, *rows.velocities]
    positions = _positions(equations, modes)
    blocks = _blocks(equations, dampers.entries)
    touched = [{blocks[i] for i, node in enumerate(jacobian[k]) if node != g.zero} for k in order]
    rubbing = (*rows.friction, *rows.static_friction, *rows.sliding, *rows.holding)
    return SparseRows(
        places=tuple([*among, *places][k] for k in order),
        positions={new: positions[k] for new, k in enumerate(order) if k in positions},
        velocities=tuple(velocities[k] for k in order),
        entries=tuple(
            (new, i, node) for new, k in enumerate(order) for i, node in enumerate(jacobian[k]) if node != g.zero
        ),
        contacts=tuple(accumulate((1 + count for count in rows.slips), initial=len(permanent))),
        blocks=blocks,
        touched=tuple(tuple(sorted(blocks)) for blocks in touched),
        colours=_colours(touched),
        dampers=dampers,
        velocity_forces=not {*g.cone(dampers.rest)}.isdisjoint(equations.variables.qd),
        velocity_friction=not {*g.cone(rubbing)}.isdisjoint(equations.variables.qd),
    )


def _positions(equations: EquationsOfMotion, modes: ModeNumbers) -> dict[int, Node]:
    """{row: its deviation from the position that it keeps}, of rows that keep positions; permanent ones stand first."""
    g, rows, permanent = equations.graph, equations.rows, equations.permanent
    offsets = [*(g.zero,) * len(rows.slips), *modes.offsets]
    held = [g.subtract(x, offset) for x, offset in zip(rows.positions, offsets, strict=True)]
    row_of_position = [*range(len(rows.slips)), *rows.latches][: len(held)]
    found = dict(enumerate(permanent.positions))
    return found | {len(permanent) + row: node for row, node in zip(row_of_position, held, strict=True)}


def _by_contact(slips: Sequence[int], count: int) -> list[int]:
    """The ``count`` rows of ``rows.Rows`` with the slips of each contact behind its gap."""
    order, first = [], len(slips)
    for contact, number in enumerate(slips):
        order += [contact, *range(first, first + number)]
        first += number
    return [*order, *range(first, count)]


def _blocks(equations: EquationsOfMotion, entries: Entries) -> tuple[int, ...]:
    """The number of the block of each coordinate, (n,); blocks are numbered in the order of their first coordinates."""
    g, qd = equations.graph, equations.variables.qd
    tied = [*mass_matrix(g, entries, qd), *equations.permanent.jacobian]
    own = range(len(equations.mass_matrix))
    groups = united([[i] for i in own] + [[i for i in own if row[i] != g.zero] for row in tied])
    number = {i: k for k, group in enumerate(sorted(groups, key=lambda group: min(group, default=-1))) for i in group}
    return tuple(number[i] for i in own)


def _colours(touched: Sequence[set[int]]) -> tuple[tuple[int, ...], ...]:
    """The rows of each colour: a row takes the first colour in which no row shares a block with it."""
    colours: list[tuple[list[int], set[int]]] = []
    for row, blocks in enumerate(touched):
        for members, taken in colours:
            if not taken & blocks:
                members.append(row)
                taken.update(blocks)
                break
        else:
            colours.append(([row], set(blocks)))
    return tuple(tuple(members) for members, _ in colours)
