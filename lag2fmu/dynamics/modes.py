"""The equations with rows that modes switch: contacts, stops, dry friction, latches.

A mode is a set of numbers that stand before the parameters: a mask (0 or 1) for each row, a direction for each row that
slides, an offset for each latch that holds positions, an outlook for each contact in space. The numbers are constant
within a mode, so that derivatives are exact there. With the multipliers of all rows

    M qdd = forcing + G^T multiplier,    mask (G qdd + gamma) = 0.

Rows enter the forces as they are, and the equations below times their masks. A row whose mask is 0 is redundant below,
and its multiplier is 0 or the sliding force.
Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996, chapter 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from lag2fmu.description import names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.parts import Constraints, RowNumbers
from lag2fmu.graph.autodiff import Forward, reverse
from lag2fmu.graph.graph import Graph, Node


class ModeNumbers(NamedTuple):
    """The numbers of the modes: ``masks`` (R,), ``directions`` of the frictional rows, ``offsets`` of latches.

    ``outlooks``: for each contact in space the time tau (s) by which its friction looks ahead, and kappa, a velocity by
    force; see ``sliding_forces``.
    """

    masks: tuple[Node, ...]
    directions: tuple[Node, ...]
    offsets: tuple[Node, ...]
    outlooks: tuple[Node, ...]

    @property
    def numbers(self) -> tuple[Node, ...]:
        """Masks, directions, offsets and outlooks in the order in which they stand in p."""
        return (*self.masks, *self.directions, *self.offsets, *self.outlooks)


def with_rows(equations: EquationsOfMotion) -> tuple[EquationsOfMotion, ModeNumbers, tuple[int, ...]]:
    """The equations with all rows among the constraints, times their masks; nodes are added to their graph.

    Constraints stand in the order: permanent holonomic, gaps, holonomic latches, permanent nonholonomic, slips, dry
    frictions, nonholonomic latches. Returns the equations, the numbers of the modes, and the place of each row among
    the constraints, (R,). Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996,
    chapter 5.
    """
    g, v, rows, c = equations.graph, equations.variables, equations.rows, equations.permanent
    modes = _modes(g, rows)
    n, held = len(v.q), len(c.positions)
    latches = list(rows.latches)[: len(rows.positions) - len(rows.slips)]
    order = [*range(len(rows.slips)), *latches]
    rest = [k for k in range(len(rows)) if k not in order]
    place = {row: held + i for i, row in enumerate(order)}
    place |= {row: len(c) + len(order) + i for i, row in enumerate(rest)}
    constraints = _masked(g, c, rows, modes, (order, rest))
    multipliers = [*v.multipliers, *(g.zero,) * len(rows)]
    multipliers[held:] = [
        *(rows.forces[row] for row in order),
        *v.multipliers[held:],
        *(rows.forces[row] for row in rest),
    ]
    variables = v._replace(multipliers=tuple(multipliers), parameters=(*modes.numbers, *v.parameters))
    forces = pushes(g, rows, v.qd)
    accelerating = Forward(g, v.direction(g, True))
    residual = (
        *(g.subtract(r, force) for r, force in zip(equations.residual[:n], forces, strict=True)),
        *accelerating(constraints.velocities),
    )
    taken = g.symbol(names.DISSIPATED_ENERGY, "state")
    variables = variables._replace(
        further=(*variables.further, taken),
        further_rates=(*variables.further_rates, _dissipated_power(equations)),
    )
    found = replace(equations, constraints=constraints, variables=variables, residual=residual, solution=None)
    return found, modes, tuple(place[row] for row in range(len(rows)))


def _masked(
    g: Graph, permanent: Constraints, rows: RowNumbers, modes: ModeNumbers, orders: tuple[Sequence[int], Sequence[int]]
) -> Constraints:
    """The ``permanent`` constraints with all rows times their masks.

    ``orders`` has two lists of rows: the rows of the first stand behind the holonomic constraints, those of the second
    behind all constraints.
    """
    held = len(permanent.positions)
    order, rest = orders

    def gathered(of_constraints: Sequence[Node], of_rows: Sequence[Node]) -> tuple[Node, ...]:
        masked = [g.multiply(mask, node) for mask, node in zip(modes.masks, of_rows, strict=True)]
        return (
            *of_constraints[:held],
            *(masked[row] for row in order),
            *of_constraints[held:],
            *(masked[row] for row in rest),
        )

    offsets = [*(g.zero,) * len(rows.slips), *modes.offsets]
    gaps = [
        g.multiply(modes.masks[row], g.subtract(position, offset))
        for row, position, offset in zip(order, rows.positions, offsets, strict=True)
    ]
    n = len((*permanent.jacobian, *rows.jacobian)[0])
    columns = [gathered([row[i] for row in permanent.jacobian], [row[i] for row in rows.jacobian]) for i in range(n)]
    return Constraints(
        positions=(*permanent.positions, *gaps),
        velocities=gathered(permanent.velocities, rows.velocities),
        accelerations=gathered(permanent.accelerations, rows.accelerations),
        jacobian=tuple(zip(*columns, strict=True)),
    )


def pushes(graph: Graph, rows: RowNumbers, qd: Sequence[Node]) -> list[Node]:
    """The sum of the generalized forces (n,) that all ``rows`` bear; two rows may share a velocity."""
    seeds: dict[Node, Node] = {}
    for velocity, force in zip(rows.velocities, rows.forces, strict=True):
        seeds[velocity] = graph.add(seeds[velocity], force) if velocity in seeds else force
    return reverse(graph, seeds, qd)


def _dissipated_power(equations: EquationsOfMotion) -> Node:
    """The power, in W, that dampers and sliding rows dissipate.

    qd dR/dqd, the power of dampers with a law of force, and less the sum of force times slip velocity.
    """
    g, v, rows, parts = equations.graph, equations.variables, equations.rows, equations.parts
    drag = reverse(g, {parts.dissipation: g.one}, v.qd)
    rubbing = [g.multiply(rows.forces[k], rows.velocities[k]) for k in rows.frictional]
    return g.subtract(g.add(g.dot(v.qd, drag), parts.resistance), g.total(rubbing))


def _modes(graph: Graph, rows: RowNumbers) -> ModeNumbers:
    def symbols(what: str, count: int) -> tuple[Node, ...]:
        return tuple(graph.symbol(f"{what} {i}", "state") for i in range(count))

    return ModeNumbers(
        masks=symbols("mask", len(rows)),
        directions=symbols("direction", len(rows.frictional)),
        offsets=symbols("offset", len(rows.positions) - len(rows.slips)),
        outlooks=symbols("outlook", 2 * rows.slips.count(2)),
    )


def sliding_forces(
    graph: Graph, rows: RowNumbers, modes: ModeNumbers, accelerations: Sequence[Node]
) -> tuple[Node, ...]:
    """The forces (N,) of the N frictional rows as if all of them slide; ``accelerations`` are those of all rows, (R,).

    - A contact with one slip: -direction mu N.
    - A contact with two slips w: -mu N (w + d)/|w + d|. A slip that begins from rest is not told by w, but by the law
      that friction is against the slip which it leaves: d = tau w' - kappa T, with the outlook (tau, kappa), where
      T is this force. Any kappa gives the same forces, as T is along w + d; with the slip's velocity by a unit of T
      in the time tau, w + d does not depend on T. Else d is constant: a velocity of rounding, so that w + d is not 0,
      or one in the direction in which the mode began. The mode ends where (w + d).d = 0. Beyond this point the sign
      turns: the force is smooth there, and the end is located.
    - A dry friction: -direction times its force.

    Source: F. Pfeiffer, Ch. Glocker, Multibody Dynamics with Unilateral Contacts, Wiley 1996, chapter 5; the outlook
    is a step of implicit Euler, D. E. Stewart, J. C. Trinkle, Int. J. Numer. Methods Eng. 39, 1996.
    """
    found: list[Node] = []
    first, outlooks = len(rows.slips), iter(modes.outlooks)
    for contact, count in enumerate(rows.slips):
        largest = graph.multiply(rows.friction[contact], rows.forces[contact])
        ways = modes.directions[len(found) : len(found) + count]
        if count == 2:
            at = range(first + len(found), first + len(found) + 2)
            tau, kappa = next(outlooks), next(outlooks)
            ahead = [
                graph.subtract(graph.multiply(tau, accelerations[k]), graph.multiply(kappa, rows.forces[k])) for k in at
            ]
            d = [graph.add(way, change) for way, change in zip(ways, ahead, strict=True)]
            w = [graph.add(rows.velocities[k], change) for k, change in zip(at, d, strict=True)]
            along = graph.dot(w, d)
            size = graph.apply("sqrt", graph.multiply(graph.dot(w, w), graph.multiply(along, along)))
            ways = tuple(graph.divide(graph.multiply(entry, along), size) for entry in w)
        found += [graph.negate(graph.multiply(way, largest)) for way in ways]
    for force in rows.sliding:
        found.append(graph.negate(graph.multiply(modes.directions[len(found)], force)))
    return tuple(found)
