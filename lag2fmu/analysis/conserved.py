"""Conserved quantities: momenta, the generalized energy, linear and angular momentum of all bodies.

Along the motion d/dt p = dL/dq + N + G^T multiplier, with the non-potential forces N. A momentum is conserved if the
right side vanishes for every state, which nodes of the graph show exactly. The energy h = sum qd p - L has
dh/dt = N.qd - dL/dt - multiplier.b, and is conserved if this right side vanishes. The linear and angular momenta of all
bodies are conserved if their derivatives vanish at random states; such states confirm every other quantity too.
External forces count as zero.
Source: Landau, Lifshitz, Mechanics, sections 6, 7, 9 and 40; E. Noether, Invariante Variationsprobleme, 1918.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import sympy as sp

from lag2fmu.analysis.drifts import drifts_of
from lag2fmu.description import names
from lag2fmu.dynamics.energies import Composer
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.silence import without_inputs
from lag2fmu.dynamics.variables import translator
from lag2fmu.graph.autodiff import forward, reverse
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.to_sympy import tidy, written, written_operations
from lag2fmu.graph.vectors import Vector, apply, cross, plus, times
from lag2fmu.mechanism.record import Mechanism

CONSTANT_IF = 1e-9
"""Relative to the sum of the magnitudes of its terms: a smaller derivative is rounding and counts as zero."""

_MAX_WRITTEN = 120
"""The most operations of a conserved quantity that is written out."""


class Conserved(NamedTuple):
    """A quantity that is constant along the motion: a ``node`` on ``graph``, a copy of the graph of the equations.

    ``meaning`` is a phrase that says what it is. ``expression`` is its formula, None if it is long. ``drift`` is the
    largest derivative found at random states, relative to its terms.
    """

    name: str
    meaning: str
    graph: Graph
    node: Node
    drift: float
    expression: sp.Expr | None

    @property
    def formula(self) -> str:
        """What it is made of, in general terms; for quantities whose ``expression`` is long."""
        kind, _, axis = self.name.rpartition("_")
        sums = {"linear_momentum": f"sum m v_{axis}", "angular_momentum": f"(sum m r x v + I omega)_{axis}"}
        if self.name == "generalized_energy":
            return "T + V" if "T + V" in self.meaning else "sum qd dL/dqd - L"
        return sums.get(kind, f"dL/d({names.velocity(self.name.removeprefix('p_'))})")


def lagrangian(equations: EquationsOfMotion) -> Node:
    """L = sum qd p - h, in J, as a node; it is added to the graph of ``equations``, which is a copy (``apart``).

    Source: Goldstein, Classical Mechanics, section 2.7 (h).
    """
    g = equations.graph
    return g.subtract(g.dot(equations.variables.qd, equations.momenta), equations.energies["generalized_energy"])


def momentum_rates(equations: EquationsOfMotion) -> list[Node]:
    """The rates of the momenta along the motion, dL/dq + N + G^T multiplier, (n,) nodes in J by the unit of q.

    The nodes are added to the graph of ``equations``, which is a copy (``apart``). Source: Goldstein, Classical
    Mechanics, section 2.4 (multipliers).
    """
    g, v = equations.graph, equations.variables
    rates = forward(g, equations.momenta, v.direction(g, accelerating=True))
    return [g.subtract(rate, r) for rate, r in zip(rates, equations.residual, strict=False)]


def energy_rate(equations: EquationsOfMotion) -> Node:
    """The rate of h along the motion, N.qd - dL/dt - multiplier.b, in W, as a node.

    The node is added to the graph of ``equations``, which is a copy (``apart``). Source: Goldstein, Classical
    Mechanics, section 2.7 (the energy function).
    """
    g, v, c = equations.graph, equations.variables, equations.constraints
    (rate,) = forward(g, [equations.energies["generalized_energy"]], v.direction(g, accelerating=True))
    work = g.dot(v.qd, equations.residual[: len(v.qd)])
    return g.subtract(g.subtract(rate, work), g.dot(v.multipliers, c.velocities))


def conserved(equations: EquationsOfMotion) -> tuple[Conserved, ...]:
    """The conserved quantities of ``equations``, each confirmed at random states; external forces are zero.

    They are those that symmetries give (cyclic coordinates, L without t), and the momenta of all bodies. There are none
    for a mechanism with contacts, stops, dry friction or latches, because their forces are not among the ``equations``.
    Source: Landau, Lifshitz, Mechanics, sections 6, 7 and 9.
    """
    if equations.mechanism.hybrid:
        return ()
    equations = equations.apart()
    found: dict[Node, tuple[str, str]] = {}
    for name, meaning, node in [*_by_symmetry(equations), *_of_bodies(equations)]:
        if not equations.variables.moves(equations.graph, node):
            continue  # this body's motion is prescribed
        if node in found:
            known, phrase = found[node]
            found[node] = known, f"{phrase}; {meaning}"
        else:
            found[node] = name, meaning
    silent = replace(equations, forcing=tuple(_silent(equations, equations.forcing)))
    drifts = drifts_of(silent, list(found))
    return tuple(
        Conserved(name, meaning, equations.graph, node, drift, _formula(equations.graph, node))
        for (node, (name, meaning)), drift in zip(found.items(), drifts, strict=True)
        if drift <= CONSTANT_IF
    )


def why_energy_changes(equations: EquationsOfMotion) -> str:
    """A phrase that says what makes the generalized energy h change; "" if h is conserved."""
    if equations.mechanism.hybrid:
        return "contacts, stops, dry friction or latches act"
    equations = equations.apart()
    g, v = equations.graph, equations.variables
    (rate,) = _silent(equations, [energy_rate(equations)])
    if rate == g.zero:
        return ""
    work = g.dot(_silent(equations, _nonpotential(equations)), v.qd)
    reasons = []
    if work != g.zero and _forced(equations.mechanism):
        reasons.append("forces that have no potential, or friction, do work")
    if forward(g, [lagrangian(equations)], {v.t: g.one}) != [g.zero]:
        reasons.append("the Lagrangian contains the time")
    if set(g.cone([rate])) & {node for motion in (*v.motions, *v.filtered) for node in motion}:
        reasons.append("motion inputs drive it")
    if set(g.cone([rate])) & set(v.multipliers):
        reasons.append("constraints move")
    return " and ".join(reasons) or "its rate does not vanish"


def while_smooth(m: Mechanism) -> str:
    """When the hybrid elements of ``m`` bear nothing."""
    elements = {"dry friction": m.frictions, "latches": m.latches}
    idle = [word for word, present in elements.items() if present]
    apart = ["between impacts"] * bool(m.unilaterals) + [f"without the forces of {' and '.join(idle)}"] * bool(idle)
    return ", ".join(apart)


def _forced(m: Mechanism) -> bool:
    """Whether there are forces beside those of potentials and constraints."""
    return bool(m.forces or m.loads or m.dampers or m.energy.dissipation is not None)


def _nonpotential(equations: EquationsOfMotion) -> list[Node]:
    """N = Q - dR/dqd, (n,)."""
    g, v = equations.graph, equations.variables
    slopes = reverse(g, {lagrangian(equations): g.one}, v.q)
    reactions = reverse(g, dict(zip(equations.constraints.velocities, v.multipliers, strict=True)), v.qd)
    triples = zip(momentum_rates(equations), slopes, reactions, strict=True)
    return [g.subtract(g.subtract(rate, slope), reaction) for rate, slope, reaction in triples]


def _silent(equations: EquationsOfMotion, nodes: Sequence[Node]) -> list[Node]:
    """The ``nodes`` (k,) with all external forces set to zero, (k,)."""
    v = equations.variables
    return without_inputs(equations.graph, nodes, (*v.Q, *v.plain, *v.rates))


Candidate = tuple[str, str, Node]
"""Name, meaning and node of a quantity."""


def _by_symmetry(equations: EquationsOfMotion) -> Iterator[Candidate]:
    """The momenta and h whose rates vanish identically.

    Under constraints all of them are candidates, because their rates need to vanish on the constraint manifold only.
    """
    zero, bound = equations.graph.zero, bool(len(equations.constraints))
    rates = [zero for _ in equations.momenta] if bound else _silent(equations, momentum_rates(equations))
    for q, momentum, rate in zip(equations.mechanism.coordinates, equations.momenta, rates, strict=True):
        if rate == zero and momentum != zero:
            yield names.momentum(q.name), f"momentum of the cyclic coordinate {q.name}", momentum
    if bound or _silent(equations, [energy_rate(equations)]) == [zero]:
        yield "generalized_energy", _energy_meaning(equations), equations.energies["generalized_energy"]


def _energy_meaning(equations: EquationsOfMotion) -> str:
    same = equations.energies.get("total_energy") == equations.energies["generalized_energy"]
    return "energy T + V" if same else "generalized energy h = sum qd p - L"


def _of_bodies(equations: EquationsOfMotion) -> Iterator[Candidate]:
    """The linear momentum of all bodies along the fixed axes, and their angular momentum about these axes."""
    mechanism, g = equations.mechanism, equations.graph
    composer = Composer(g, mechanism, translator(g, mechanism, equations.variables), equations.variables)
    linear: Vector = (g.zero,) * 3
    angular: Vector = (g.zero,) * 3
    spatial = mechanism.dimension == 3
    for body in mechanism.bodies:
        at = composer.place(body.name) if body.placed else (g.zero,) * mechanism.dimension
        place: Vector = (*at, *((g.zero,) if not spatial else ()))
        mass, velocity = composer.put(body.mass), tuple(composer.rate(place))
        momentum = times(g, mass, velocity)
        linear, angular = plus(g, linear, momentum), plus(g, angular, cross(g, place, momentum))
        angular = plus(g, angular, _spin(composer, body.name))
    if not mechanism.bodies:
        return
    for axis, p, moment in zip("xyz", linear, angular, strict=True):
        if (spatial or axis != "z") and p != g.zero:
            yield f"linear_momentum_{axis}", f"linear momentum of the bodies along {axis}", p
        if (spatial or axis == "z") and moment != g.zero:
            yield f"angular_momentum_{axis}", f"angular momentum of the bodies about the {axis} axis", moment


def _spin(composer: Composer, name: str) -> Vector:
    """The angular momentum (3,) of a body about its own mass centre, in fixed axes."""
    g = composer.g
    body = next(b for b in composer.mechanism.bodies if b.name == name)
    if body.inertia is None:
        return (g.zero,) * 3
    if body.frame is None:
        return (g.zero, g.zero, g.multiply(composer.put(body.inertia), *composer.rate([composer.put(body.angle)])))
    frame = str(body.frame)
    return composer.frames.to_world(frame, apply(g, composer.tensor(body), composer.velocities[frame].angular))


def _formula(graph: Graph, node: Node) -> sp.Expr | None:
    if written_operations(graph, [node]) > _MAX_WRITTEN:
        return None
    return tidy(written(graph, [node])[0])
