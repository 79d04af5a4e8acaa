"""How fast quantities change along the motion at random states around the start.

A force that is a narrow pulse is 0 at random states, and yet it changes momenta. So functions that can be flat are
replaced by variables with any value. A conserved quantity remains conserved, because the function then stands in its
rate with both signs.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lag2fmu.analysis.evaluation import Unknowns, resting_inputs
from lag2fmu.analysis.one_side import on_each_side
from lag2fmu.description.symbols import Coordinate
from lag2fmu.dynamics.consistent_starts import starting_consistently
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.batches import Evaluator, Floats
from lag2fmu.graph.graph import Node
from lag2fmu.graph.operations import OPERATIONS

_STATES = 6
_FLAT = ("exp", "tanh", "heaviside", "sign", "choice", "lookup", "lookup_2")
_PARTLY = ("min", "max")
"""Flat on one side. In constraints they stay, which the velocities of states would not meet with other values."""


def drifts_of(equations: EquationsOfMotion, nodes: list[Node]) -> list[float]:
    """The largest derivatives of ``nodes`` along the motion at random states, relative to their terms, (k,).

    Where constraints have kinks the states are on both sides of them, however far from the start those are. Nodes are
    added to the graph of ``equations``, which is a copy (``apart``). Infinite if no state is found.
    """
    g, v = equations.graph, equations.variables
    direction = v.direction(g, accelerating=True)
    seeds = [f"d {i}" for i in range(len(direction))]
    changes = forward(g, nodes, dict(zip(direction, map(g.symbol, seeds), strict=True)))
    each = dict(zip(seeds, np.eye(len(seeds)), strict=True))
    worst, states = np.zeros(len(nodes)), 0
    for side, there in on_each_side(equations, changes):
        for size in _sizes_of_rates(side, there, list(direction.values()), each):
            worst, states = np.maximum(worst, size), states + 1
    return worst.tolist() if states else [np.inf] * len(nodes)


def _sizes_of_rates(
    equations: EquationsOfMotion, changes: list[Node], rates: list[Node], each: dict[str, Floats]
) -> Iterator[Floats]:
    """At each random state, how large sums of ``changes`` times ``rates`` are relative to their terms, (k,).

    ``each`` {seed: its unit vector} are the seeds in ``changes``.
    """
    freed, (changes,), free = _freed_of_flat_functions(equations, [changes])
    moving, slopes = Evaluator(equations.graph, rates), Evaluator(equations.graph, changes)
    accelerations, labels = Unknowns(freed), [str(equations.graph.leaf[node]) for node in equations.variables.unknowns]
    generator = random.Random(43)
    for state in random_states(equations, _STATES):
        state |= {name: generator.uniform(-1, 1) for name in free}
        values = state | dict(zip(labels, np.concatenate(accelerations(state)), strict=True))
        terms = slopes(values | each) * moving(values)
        if np.isfinite(terms).all():
            size = np.abs(terms).sum(axis=1)
            yield np.abs(terms.sum(axis=1)) / np.where(size > 0, size, 1.0)


def _within(q: Coordinate, value: float) -> float:
    """``value``, or the nearest bound of ``q`` if it is out of bounds."""
    low, high = (-np.inf if q.minimum is None else q.minimum), (np.inf if q.maximum is None else q.maximum)
    return float(np.clip(value, low, high))


def random_states(equations: EquationsOfMotion, count: int) -> Iterator[dict[str, float | Floats]]:
    """``count`` states {variable: SI value} around the start that meet the constraints, the same in each call.

    External forces are zero. Without constraints the parameters are moved too, by up to a tenth. There may be fewer
    states, if Newton's method seldom meets the constraints.
    """
    generator = random.Random(41)
    mechanism, c = equations.mechanism, equations.constraints
    for _ in range(count):
        coordinates = tuple(
            replace(
                q,
                start=_within(q, q.start + q.nominal * generator.uniform(-0.7, 0.7)),
                velocity=q.velocity + q.nominal * generator.uniform(-1, 1),
                given=False if len(c) else q.given,
                velocity_given=False if len(c) else q.velocity_given,
            )
            for q in mechanism.coordinates
        )
        moved = mechanism.starting_at(coordinates)
        try:
            moved = starting_consistently(moved, equations.graph, c)
        except DerivationError:
            continue
        values = resting_inputs(replace(equations, mechanism=moved)) | {"t": generator.uniform(0, 5)}
        if not len(c):
            values |= {p.name: values[p.name] * generator.uniform(0.9, 1.1) for p in mechanism.parameters if p.value}
        values |= {z.name: z.start + z.nominal * generator.uniform(-1, 1) for z in mechanism.states}
        yield values


def _freed_of_flat_functions(
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
