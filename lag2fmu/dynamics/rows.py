"""Contacts, stops, dry friction and latches on the graph: rows of constraints that modes switch on and off.

A closed gap is a holonomic constraint. Sticking is a constraint on velocities. Sliding is a force along the row, which
depends on what other rows bear. ``modes`` puts the rows into the equations.
Source: Ch. Glocker, Set-Valued Force Laws, Springer 2001, chapters 5 and 6.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from lag2fmu.dynamics.parts import RowNumbers, Variables
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import forward, reverse
from lag2fmu.graph.from_sympy import Translator
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.mechanism.record import Mechanism


def compose_rows(graph: Graph, mechanism: Mechanism, put: Translator, v: Variables) -> RowNumbers:
    """The rows of ``mechanism`` as nodes; ``put`` translates expressions, ``v`` are the variables.

    Raises DerivationError for a slip, a dry friction or a latch that is not affine in the velocities. Source: Ch.
    Glocker, Set-Valued Force Laws, Springer 2001, chapters 5 and 6.
    """
    contacts, frictions, latches = mechanism.unilaterals, mechanism.frictions, mechanism.latches
    direction = v.direction(graph, accelerating=False)
    positions, velocities = _kinematics(graph, mechanism, put, direction)
    return RowNumbers(
        positions=positions,
        velocities=velocities,
        accelerations=tuple(forward(graph, velocities, direction)),
        jacobian=_jacobian(graph, mechanism, v, velocities),
        forces=v.forces,
        slips=tuple(len(contact.slips) for contact in contacts),
        restitution=tuple(put(contact.restitution) for contact in contacts),
        friction=tuple(put(contact.friction) for contact in contacts),
        static_friction=tuple(put(contact.static_friction) for contact in contacts),
        sliding=tuple(put(friction.force) for friction in frictions),
        holding=tuple(put(friction.force if friction.static is None else friction.static) for friction in frictions),
        conditions=tuple(put(latch.while_) for latch in latches),
    )


def _kinematics(
    graph: Graph, mechanism: Mechanism, put: Translator, direction: Mapping[Node, Node]
) -> tuple[tuple[Node, ...], tuple[Node, ...]]:
    """The positions of gaps and holonomic latches, and the velocities of all rows, in the order of ``RowNumbers``.

    ``direction`` {variable: its rate} is the direction of time.
    """
    contacts, latches = mechanism.unilaterals, mechanism.latches
    gaps = [put(contact.gap) for contact in contacts]
    slips = [put(slip) for contact in contacts for slip in contact.slips]
    rubbing = [put(friction.on) for friction in mechanism.frictions]
    held = [put(latch.expression) for latch in latches]
    holonomic = sum(latch.holonomic for latch in latches)
    velocities = (
        *forward(graph, gaps, direction),
        *slips,
        *rubbing,
        *forward(graph, held[:holonomic], direction),
        *held[holonomic:],
    )
    return (*gaps, *held[:holonomic]), velocities


def _jacobian(
    graph: Graph, mechanism: Mechanism, v: Variables, velocities: Sequence[Node]
) -> tuple[tuple[Node, ...], ...]:
    """G (R, n) of the rows; raises DerivationError for one that is not affine in the velocities."""
    jacobian = tuple(tuple(reverse(graph, {velocity: graph.one}, v.qd)) for velocity in velocities)
    moving = graph.depending((entry for row in jacobian for entry in row), v.qd)
    for label, row in zip(_labels(mechanism), jacobian, strict=True):
        if not moving.isdisjoint(row):
            raise DerivationError(
                f"{label}: it is not affine in the velocities; write it as a sum of velocities with factors that "
                "contain none"
            )
    return jacobian


def _labels(mechanism: Mechanism) -> Iterator[str]:
    """The place in the mechanism of each row, for messages."""
    contacts = mechanism.unilaterals
    yield from (contact.where for contact in contacts)
    yield from (f"{contact.where}, slip" for contact in contacts for _ in contact.slips)
    yield from (f"frictions.{friction.name}, on" for friction in mechanism.frictions)
    yield from (f"constraints.{latch.kind}.{latch.name}" for latch in mechanism.latches)
