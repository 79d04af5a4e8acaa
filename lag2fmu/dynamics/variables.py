"""The variables of a mechanism as nodes, and a translator that knows them."""

from __future__ import annotations

from collections.abc import Iterable
from graphlib import TopologicalSorter

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.events import State
from lag2fmu.dynamics.parts import Variables
from lag2fmu.dynamics.tables import interpolant
from lag2fmu.graph.from_sympy import Translator
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.language.units import JOULE
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.record import Mechanism


def integrated_states(mechanism: Mechanism) -> tuple[State, ...]:
    """The further states that an FMU integrates: those of the user, and of a hybrid mechanism the dissipated energy."""
    if not mechanism.hybrid:
        return mechanism.states
    doc = "energy that friction, dampers and impacts have taken since the start"
    return (*mechanism.states, State(names.DISSIPATED_ENERGY, JOULE, 0.0, sp.S.Zero, 1.0, doc))


def declare(graph: Graph, mechanism: Mechanism) -> Variables:
    """All variables of ``mechanism`` as symbols on ``graph``; the module ``names`` gives the names of computed ones."""
    graph.tables = [interpolant(table) for table in mechanism.tables]
    q = [c.name for c in mechanism.coordinates]

    def nodes(labels: Iterable[str], group: str | None = "state") -> tuple[Node, ...]:
        return tuple(graph.symbol(label, group) for label in labels)

    v = Variables(
        t=graph.symbol("t", "state"),
        q=nodes(q),
        qd=nodes(map(names.velocity, q)),
        qdd=nodes(map(names.acceleration, q), None),
        multipliers=nodes([names.multiplier(c.name) for c in mechanism.constraints], None),
        forces=nodes(_forces(mechanism), None),
        Q=nodes(map(names.generalized_force, q)),
        plain=nodes([u.name for u in mechanism.plain_inputs]),
        motions=tuple(
            nodes([u.name, names.velocity(u.name), names.acceleration(u.name)])  # type: ignore[misc]
            for u in mechanism.motions
        ),
        parameters=nodes([p.name for p in mechanism.parameters if p.value is not None]),
        further=nodes([state.name for state in mechanism.states]),
        filtered=tuple(
            nodes([name, names.velocity(name)])  # type: ignore[misc]
            for name in mechanism.filtered
        ),
    )
    if not mechanism.has_input_rates:
        return v
    first = [names.rate(str(graph.leaf[node])) for node in v.inputs]
    return v._replace(rates=nodes([*first, *map(names.rate, first)]))


def _forces(mechanism: Mechanism) -> list[str]:
    """The names of what rows bear, in the order of ``Rows``."""
    contacts = mechanism.unilaterals
    return [
        *(names.force(contact.name) for contact in contacts),
        *(name for contact in contacts for name in names.frictions(contact.name, len(contact.slips))),
        *(names.force(friction.name) for friction in mechanism.frictions),
        *(names.multiplier(latch.name) for latch in mechanism.latches),
    ]


def translator(graph: Graph, mechanism: Mechanism, variables: Variables) -> Translator:
    """A translator that knows the variables, the dependent parameters and the definitions of ``mechanism``."""
    v = variables
    known = [v.t, *v.states, *v.unknowns, *v.forces, *v.signals, *v.parameters]
    translate = Translator(
        graph, {str(graph.leaf[node]): node for node in known}, (e for _, e in mechanism.expressions())
    )
    named = {p.name: p.expression for p in mechanism.parameters if p.expression is not None}
    named |= {d.name: d.expression for d in mechanism.definitions}
    for motion in mechanism.filtered:
        name, first = names.acceleration(motion), names.rate(names.target(motion))
        named[name] = led(motion, named[name], (first, names.rate(first)))
    uses = {name: sorted({s.name for s in e.free_symbols} & named.keys()) for name, e in named.items()}
    for name in TopologicalSorter(uses).static_order():
        translate.define(name, translate(named[name]))
    return translate


def led(motion: str, acceleration: sp.Expr, rates: tuple[str, str]) -> sp.Expr:
    """The ``acceleration`` (SI units) of a filtered motion that follows a target r with derivatives.

    ``rates`` are the names of the first and second derivative of r. The filter acts on the deviation of the motion y
    from r: y_ddot = r_ddot + f(y - r, y_dot - r_dot). So a motion that has come to the target stays on it. Derivatives
    that the importer does not give are 0.
    """
    y_dot, first, second = map(symbol, (names.velocity(motion), *rates))
    return second + acceleration.xreplace({y_dot: y_dot - first})
