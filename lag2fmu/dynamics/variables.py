"""The variables of a mechanism as nodes, and a translator that knows them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from graphlib import TopologicalSorter

import sympy as sp

from lag2fmu.description import names
from lag2fmu.description.events import State
from lag2fmu.dynamics.tables import interpolant
from lag2fmu.graph.from_sympy import Translator
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.language.units import JOULE
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.record import Mechanism


@dataclass(frozen=True)
class Variables:
    """The variables as nodes: t; q, qd, qdd, Q of n entries each; plain inputs, motions and independent parameters.

    ``further``: the further states z, (f,), and ``further_rates``: their derivatives as nodes, once they are composed.

    ``filtered``: those of them that are position and velocity of a filtered motion.

    ``multipliers``: one for each constraint, (m,). ``forces``: those of the rows that modes switch, see ``Rows``; of
    latches they are multipliers too. ``motions`` holds (y0, y0_dot, y0_ddot) for each motion input.
    ``rates`` holds the first, then the second time derivatives of all inputs; it is empty unless ``has_input_rates``.
    """

    t: Node
    q: tuple[Node, ...]
    qd: tuple[Node, ...]
    qdd: tuple[Node, ...]
    multipliers: tuple[Node, ...]
    forces: tuple[Node, ...]
    Q: tuple[Node, ...]
    plain: tuple[Node, ...]
    motions: tuple[tuple[Node, Node, Node], ...]
    parameters: tuple[Node, ...]
    rates: tuple[Node, ...] = ()
    further: tuple[Node, ...] = ()
    filtered: tuple[tuple[Node, Node], ...] = ()
    further_rates: tuple[Node, ...] = ()

    @property
    def states(self) -> tuple[Node, ...]:
        """The vector x of the generated functions: q, qd and the further states, (2 n + f,)."""
        return (*self.q, *self.qd, *self.further)

    @property
    def unknowns(self) -> tuple[Node, ...]:
        """What the equations of motion determine: accelerations and multipliers, n + m."""
        return (*self.qdd, *self.multipliers)

    @property
    def inputs(self) -> tuple[Node, ...]:
        """All inputs in the order of the FMU: Q, plain inputs, each motion with its derivatives."""
        return (*self.Q, *self.plain, *(node for motion in self.motions for node in motion))

    @property
    def driven(self) -> tuple[tuple[Node, Node], ...]:
        """Position and velocity of each prescribed motion, filtered ones behind."""
        return (*((y, y_dot) for y, y_dot, _ in self.motions), *self.filtered)

    @property
    def signals(self) -> tuple[Node, ...]:
        """The inputs and behind them their rates."""
        return (*self.inputs, *self.rates)

    def direction(self, graph: Graph, accelerating: bool) -> dict[Node, Node]:
        """The direction of time {variable: its rate}: t -> 1, q -> qd, motions alike, qd -> qdd if ``accelerating``.

        Further states have the rates that are composed so far.
        """
        rates = {self.t: graph.one} | dict(zip(self.q, self.qd, strict=True))
        rates |= zip(self.further, self.further_rates, strict=False)
        if self.rates:
            rates |= dict(zip(self.signals, self.rates, strict=False))
        for y, y_dot, y_ddot in self.motions:
            rates |= {y: y_dot, y_dot: y_ddot}
        return rates | dict(zip(self.qd, self.qdd, strict=True)) if accelerating else rates

    def moves(self, graph: Graph, node: Node) -> bool:
        """Whether ``node`` contains velocities."""
        return bool(set(self.qd) & set(graph.cone([node])))


def further_states(mechanism: Mechanism) -> tuple[State, ...]:
    """The further states in the order of the vector z: those of the user."""
    return mechanism.states


def integrated_states(mechanism: Mechanism) -> tuple[State, ...]:
    """The further states that an FMU integrates: those of the user, and of a hybrid mechanism the dissipated energy."""
    if not mechanism.hybrid:
        return further_states(mechanism)
    doc = "energy that friction, dampers and impacts have taken since the start"
    return (*further_states(mechanism), State(names.DISSIPATED_ENERGY, JOULE, 0.0, sp.S.Zero, 1.0, doc))


def declare(graph: Graph, mechanism: Mechanism) -> Variables:
    """All variables of ``mechanism`` as symbols on ``graph``; names that are not the user's are those of ``names``."""
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
        further=nodes([state.name for state in further_states(mechanism)]),
        filtered=tuple(
            nodes([name, names.velocity(name)])  # type: ignore[misc]
            for name in mechanism.filtered
        ),
    )
    if not has_input_rates(mechanism):
        return v
    first = [names.rate(str(graph.leaf[node])) for node in v.inputs]
    return replace(v, rates=nodes([*first, *map(names.rate, first)]))


def has_input_rates(mechanism: Mechanism) -> bool:
    """Whether the equations of ``mechanism`` contain the time derivatives of inputs.

    Forces move the equilibrium of a coordinate without mass; where that is a constraint, its derivatives contain their
    rates. Filters of motions are led by the derivatives of what they follow.
    """
    return bool(mechanism.filtered) or any(c.massless for c in mechanism.constraints)


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
    named |= {names.acceleration(y): _led(y, named[names.acceleration(y)]) for y in mechanism.filtered}
    uses = {name: sorted({s.name for s in e.free_symbols} & named.keys()) for name, e in named.items()}
    for name in TopologicalSorter(uses).static_order():
        translate.define(name, translate(named[name]))
    return translate


def _led(name: str, acceleration: sp.Expr) -> sp.Expr:
    """The ``acceleration`` of a filtered motion where the time derivatives of its target are known.

    The filter then acts on what the motion deviates by from the target r: y_ddot = r_ddot + f(y - r, y_dot - r_dot). A
    motion that has come to the target stays on it. Where the importer gives no derivatives, they are 0.
    """
    y_dot, first = symbol(names.velocity(name)), names.rate(names.target(name))
    return symbol(names.rate(first)) + acceleration.xreplace({y_dot: y_dot - symbol(first)})
