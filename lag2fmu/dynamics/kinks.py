"""Kinks as switches: sign, abs, heaviside, min, max and choices are smooth formulas while their margins keep signs.

A kink whose margin moves with time, motion or inputs is replaced by a formula with a switch, +1 or -1, which the
engine turns where the margin crosses 0: between such events the equations are smooth, and derivatives are exact. Kinks
of one margin, or of margins that are opposite, share a switch. Kinks stay in what depends on parameters alone, in what
is calculated from the motion without acting on it, and in coefficients of restitution.

Source: H. Elmqvist, F. E. Cellier, M. Otter, Object-oriented modeling of hybrid systems, ESS 1993 (relations that are
frozen between events).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from lag2fmu.dynamics.functions import EventFunction, Function, nodes_of, with_nodes
from lag2fmu.dynamics.held_margins import Switches, beside_zero
from lag2fmu.dynamics.parts import Variables
from lag2fmu.dynamics.starts import start_values
from lag2fmu.dynamics.tables import in_pieces
from lag2fmu.dynamics.variables import integrated_states
from lag2fmu.graph.autodiff import reverse
from lag2fmu.graph.batches import evaluate
from lag2fmu.graph.derivatives import kink_margin
from lag2fmu.graph.fingerprint import PRIME
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import KINKS, OPERATIONS, ROOTS, SYMBOL
from lag2fmu.graph.to_sympy import written, written_operations
from lag2fmu.mechanism.record import Mechanism

_WITHOUT_EFFECT = {f"mechanism_{x}" for x in ("locals", "locals_tangent", "locals_second", "dependent", "restitution")}
"""Functions that compute from the motion and do not act on it, or at single times alone."""

_LIMITED = (*ROOTS, "log", "asin", "acos")
"""Operations that have values for some operands only."""
PLACES = 65
"""The number of times at which a function of the time is evaluated to tell its size."""
_READABLE = 200
"""The most operations of a margin that a message writes out."""


class Switched(NamedTuple):
    """Functions with switches in their argument p, behind its ``masks`` first entries, and the switches' margins.

    ``timed_bounds`` as in ``Program``.
    """

    functions: tuple[Function, ...]
    margins: tuple[EventFunction, ...]
    timed_bounds: Function | None = None


def switched(
    graph: Graph,
    variables: Variables,
    mechanism: Mechanism,
    functions: Sequence[Function],
    masks: int = 0,
    conditions: Sequence[Node] = (),
) -> Switched:
    """``functions`` with switches instead of kinks, and ``mechanism_switches``, which computes the margins.

    ``conditions`` are further margins: their switches stand behind those of kinks, and no kink need contain them.
    Without kinks and conditions the functions stay as they are. Nodes are added to ``graph``. Source: H. Elmqvist,
    F. E. Cellier, M. Otter, Object-oriented modeling of hybrid systems, ESS 1993.
    """
    moving = {variables.t, *variables.states, *variables.signals}
    functions = in_pieces(graph, functions, _effective(functions), moving, forceful=mechanism.hybrid)
    effective = _effective(functions)
    kinks = _Kinks(graph, moving, {*variables.unknowns})
    margins = kinks.margins([*effective, *conditions])
    if not margins and not conditions and not masks:
        return Switched(tuple(functions), ())
    every = [*margins, *conditions]
    switches = tuple(graph.symbol(f"switch {k}") for k in range(len(every)))
    described = _described(graph, variables, mechanism, every)
    state = next(f.arguments[:4] for f in functions if f.name == "mechanism_dynamics")
    results = tuple(("S", k, node) for k, node in enumerate(every))
    doc = "Margins S, at whose signs the equations of motion change."
    margin_function = Function("mechanism_switches", doc, state, ("S",), results)
    timed = [k for k, margin in enumerate(described) if margin.timed]
    with graph.as_written():
        new = [*functions, margin_function]
        if margins:
            new = kinks.replaced(dict(zip(margins, switches, strict=False)), new)
            new[-1] = kinks.conditional(dict(zip(margins, switches, strict=False)), new[-1])
        new += _timed_functions(graph, variables, new[-1], timed) if timed else ()
    *others, last = (_with_modes(graph, f, switches, masks) for f in new)
    return Switched((*others,), described, last) if timed else Switched((*others, last), described)


def _effective(functions: Sequence[Function]) -> list[Node]:
    return [node for f in functions if f.name not in _WITHOUT_EFFECT for *_, node in f.results]


class _Kinks:
    """The kinks on a graph whose margins contain a variable that is ``moving`` and no variable that is ``unknown``."""

    def __init__(self, graph: Graph, moving: set[Node], unknown: set[Node]) -> None:
        self.graph, self.moving, self.unknown = graph, moving, unknown

    def margins(self, outputs: Sequence[Node]) -> list[Node]:
        """The margins of the kinks that ``outputs`` need, in order of the graph; of two opposite ones, one."""
        found: dict[int, Node] = {}
        for node in self.graph.cone(outputs):
            margin = self._margin(node)
            if margin is not None and self._key(margin)[0] not in found:
                needed = {*self.graph.cone([margin])}
                if needed & self.moving and not needed & self.unknown:
                    found[self._key(margin)[0]] = margin
        return list(found.values())

    def replaced(self, switches: Mapping[Node, Node], functions: Sequence[Function]) -> list[Function]:
        """``functions`` with ``switches`` {margin: switch} instead of kinks, also in what one hands to another."""
        known = {self._key(margin): switch for margin, switch in switches.items()}
        new = with_nodes(functions, self._new_nodes(known, nodes_of(self.graph, functions)))
        code = self.graph.code
        takes = [any(code[node] != SYMBOL for a in f.arguments for node in a.entries) for f in functions]
        return [
            self._apart(known, old) if taking and found.missing(self.graph) else found
            for old, found, taking in zip(functions, new, takes, strict=True)
        ]

    def conditional(self, switches: Mapping[Node, Node], margins: Function) -> Function:
        """``margins`` in which conditions, behind those of the ``switches``, are -1 where kinks hold them at 0."""
        g, known = self.graph, {self._key(margin): switch for margin, switch in switches.items()}
        first, behind = margins.results[: len(switches)], margins.results[len(switches) :]
        moved = (beside_zero(g, partial(self._switch, known), node, node, g.minus_one) for *_, node in behind)
        return replace(margins, results=(*first, *((*row[:2], node) for row, node in zip(behind, moved, strict=True))))

    def _apart(self, known: Mapping[tuple[int, bool], Node], old: Function) -> Function:
        """The function ``old`` with ``known`` switches, where a formula would be simplified with what is handed over.

        What another function hands over is a symbol here, so that products with it are not written in another way.
        """
        g = self.graph
        entries = dict.fromkeys(node for a in old.arguments for node in a.entries)
        held = {node: node if g.code[node] == SYMBOL else g.symbol(f"handed {i}") for i, node in enumerate(entries)}
        cone = g.cone((node for *_, node in old.results), old.given)
        (found,) = with_nodes([old], self._new_nodes(known, cone, held))
        return found

    def _new_nodes(
        self, known: Mapping[tuple[int, bool], Node], cone: Sequence[Node], held: Mapping[Node, Node] | None = None
    ) -> dict[Node, Node]:
        """{node of ``cone``: what stands for it}, ``held`` ones as they are there.

        ``known`` {key of a margin: switch} are the switches there are.
        """
        graph = self.graph
        kept = self._kept(cone)
        new: dict[Node, Node] = dict(held or {})
        for node in (node for node in cone if node not in new):
            operands = graph.operands[node]
            moved = [new[operand] for operand in operands]
            margin = None if node in kept else self._margin(node)
            switch = None if margin is None else self._switch(known, margin)
            if switch is not None:
                new[node] = self._formula(node, switch, moved, partial(self._switch, known))
            else:
                new[node] = node if list(operands) == moved else graph.rebuild(node, moved)
        return new

    def _margin(self, node: Node) -> Node | None:
        """The margin at whose sign the kink ``node`` changes; None if it is no kink, or one that may be passed."""
        name, operands = OPERATIONS[self.graph.code[node]].name, self.graph.operands[node]
        if name not in KINKS or all(self._passed(operand) for operand in operands[: KINKS[name]]):
            return None
        return kink_margin(self.graph, node)

    def _kept(self, cone: Sequence[Node]) -> set[Node]:
        """The abs, min and max of ``cone`` that stay as they are: the operands of roots, logarithms and powers.

        Without its kink such a function need not have a value where a trial step goes on beyond the event: of
        max(0, -x)**(3/2) there would remain (-x)**(3/2). Solver steps end at the event nevertheless, so that no step
        has the kink inside.
        """
        g = self.graph
        limited = [node for node in cone if OPERATIONS[g.code[node]].name in _LIMITED]
        below = g.cone(operand for node in limited for operand in g.operands[node])
        return {node for node in below if OPERATIONS[g.code[node]].name in ("abs", "min", "max")}

    def _passed(self, margin: Node) -> bool:
        """Whether solvers may pass a kink of ``margin``: it is made of numbers and arguments of ``smooth`` alone."""
        name = OPERATIONS[self.graph.code[margin]].name
        if name in ("negate", "subtract"):
            return all(self._passed(operand) for operand in self.graph.operands[margin])
        return name in ("passed", "constant")

    def _key(self, margin: Node) -> tuple[int, bool]:
        """A key that margins of equal and of opposite value share, and which of the two opposites ``margin`` is."""
        mark = self.graph.marks[margin]
        opposite = -mark % PRIME
        return min(mark, opposite), mark > opposite

    def _switch(self, known: Mapping[tuple[int, bool], Node], margin: Node) -> Node | None:
        """The switch of ``margin``, or minus the switch of its opposite; None if neither has a switch."""
        mark, greater = self._key(margin)
        if (mark, greater) in known:
            return known[mark, greater]
        opposite = known.get((mark, not greater))
        return None if opposite is None else self.graph.negate(opposite)

    def _formula(self, node: Node, switch: Node, operands: Sequence[Node], switch_of: Switches) -> Node:
        """The smooth formula that the kink ``node`` of ``operands`` is as long as no ``switch`` turns."""
        g, name = self.graph, OPERATIONS[self.graph.code[node]].name
        if name == "sign":
            return beside_zero(g, switch_of, operands[0], switch, g.zero)
        if name == "abs":
            return g.multiply(switch, operands[0])
        if name == "heaviside":
            return beside_zero(g, switch_of, operands[0], g.choose(switch, g.one, g.zero), g.apply("heaviside", g.zero))
        if name == "choice":
            return beside_zero(g, switch_of, operands[0], g.choose(switch, *operands[1:]), operands[2])
        a, b = operands if name == "max" else operands[::-1]
        return g.choose(switch, a, b)


def _with_modes(graph: Graph, function: Function, switches: tuple[Node, ...], masks: int) -> Function:
    """``function`` with ``switches`` behind the ``masks`` first entries of p; derivatives along dp hold them fixed."""
    resting = tuple(graph.symbol(f"d {graph.leaf[switch]}") for switch in switches)
    inserted = {"p": switches, "dp": resting}
    return replace(
        function,
        arguments=tuple(
            a._replace(entries=(*a.entries[:masks], *inserted[a.name], *a.entries[masks:])) if a.name in inserted else a
            for a in function.arguments
        ),
    )


def _described(graph: Graph, v: Variables, mechanism: Mechanism, margins: Sequence[Node]) -> tuple[EventFunction, ...]:
    """The name, nominal size and kind of each margin."""
    found = []
    for margin in margins:
        timed, size = _timed(graph, v, margin), nominal_size(graph, v, mechanism, margin)
        size = min(size, _greatest(graph, v, mechanism, margin)) if timed else size
        found.append(EventFunction(_text(graph, margin), size, timed))
    return tuple(found)


def _text(graph: Graph, margin: Node) -> str:
    """``margin`` as one writes it; if it is long, only its number of operations."""
    operations = written_operations(graph, [margin])
    return str(written(graph, [margin])[0]) if operations <= _READABLE else f"an expression of {operations} operations"


def nominal_size(graph: Graph, v: Variables, mechanism: Mechanism, margin: Node) -> float:
    """The change of ``margin`` if every variable changes by its nominal value, in SI units.

    It is the greater one at the start and beside it, where each coordinate is at another part of its nominal value: a
    lever may vanish at a symmetrical start, but for rounding. A change of 0 is no size; the result then is 1.
    """
    sizes = [mechanism.experiment.stop_time]
    sizes += 2 * [c.nominal for c in mechanism.coordinates]
    sizes += [state.nominal for state in integrated_states(mechanism)]
    start, inputs = start_values(mechanism), v.signals
    sizes += [abs(start.get(str(graph.leaf[u]), 0.0)) or 1.0 for u in inputs]
    slopes, found = reverse(graph, {margin: graph.one}, (v.t, *v.states, *inputs)), 0.0
    beside = {c.name: start[c.name] + (0.3 + 0.618 * i % 0.4) * c.nominal for i, c in enumerate(mechanism.coordinates)}
    for values in (start, start | beside):
        change = sum(abs(slope) * size for slope, size in zip(graph.evaluate(slopes, values), sizes, strict=True))
        found = max(found, change) if math.isfinite(change) else found
    return found or 1.0


def _greatest(graph: Graph, v: Variables, mechanism: Mechanism, margin: Node) -> float:
    """About the greatest absolute value of ``margin``, a function of the time, in the experiment; infinite if unknown.

    One that turns often changes by far less than its rate at the start says.
    """
    values = start_values(mechanism)
    times = np.linspace(0.0, mechanism.experiment.stop_time, PLACES)
    sizes = np.abs(evaluate(graph, [margin], {**values, str(graph.leaf[v.t]): times})).ravel()
    return float(sizes[np.isfinite(sizes)].max(initial=0.0)) or math.inf


def _timed(graph: Graph, v: Variables, margin: Node) -> bool:
    """Whether ``margin`` depends on nothing but the time and parameters."""
    variables = {node for node in graph.cone([margin]) if node in graph.leaf and not graph.is_constant(node)}
    return variables <= {*v.parameters, v.t}


def _timed_functions(graph: Graph, v: Variables, margins: Function, timed: Sequence[int]) -> tuple[Function, ...]:
    """The ``timed`` ones of the ``margins`` as a function, and a second one with their rates for intervals."""
    t, _, _, p = margins.arguments
    results = tuple(result for result in margins.results if result[1] in timed)
    rates = tuple(("rates", k, reverse(graph, {node: graph.one}, (v.t,))[0]) for _, k, node in results)
    doc = "Margins S that depend on nothing but the time"
    values = Function("mechanism_timed", f"{doc}.", (t, p), ("S",), results)
    bounds = Function("mechanism_timed_bounds", f"{doc}, and their rates.", (t, p), ("S", "rates"), (*results, *rates))
    return values, bounds
