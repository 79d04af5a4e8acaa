"""A cost: one number of a run, of values at its end, sums over its samples, and integrals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lag2fmu.description.events import State
from lag2fmu.errors import LoadError
from lag2fmu.graph.autodiff import reverse
from lag2fmu.graph.batches import Evaluator
from lag2fmu.graph.from_sympy import Translator
from lag2fmu.graph.graph import Graph
from lag2fmu.language.expressions import TIME, free_names, parse
from lag2fmu.mechanism.record import Mechanism, complete
from lag2fmu.reference.trajectory import Floats

INTEGRAL = "integral_of_cost"
"""The further state that integrates a part of the cost."""
PLACES = ("end", "sum", "integral")
Cost = str | Mapping[str, str]
"""An expression of variables at the end, or expressions by where they count: PLACES."""


def parts_of(cost: Cost) -> dict[str, str]:
    """{place: expression} of a ``cost``; raises LoadError for another place, or if there is none."""
    found = {"end": cost} if not isinstance(cost, Mapping) else dict(cost)
    for place, text in found.items():
        if not isinstance(text, str):
            raise LoadError(f"the cost at '{place}' is {text!r}; give an expression as text, such as \"x**2\"")
    unknown = [place for place in found if place not in PLACES]
    if unknown or not found:
        what = f"'{unknown[0]}' is no place" if unknown else "the cost is empty"
        raise LoadError(f"{what}; a cost is an expression, or a mapping of {', '.join(PLACES)} to expressions")
    return found


def with_integral(mechanism: Mechanism, rate: str | None) -> Mechanism:
    """``mechanism`` with a further state that integrates the expression ``rate``; the same if there is none.

    Outputs that are expressions may stand in it. A cost may add what has different units, so they are no error.
    Raises MechanismError and ExpressionError for a rate that cannot be.
    """
    if rate is None:
        return mechanism
    written, expression = mechanism.description, parse(rate, where="the integral of the cost")
    outputs = {output.name: output.expression for output in mechanism.outputs if output.expression is not None}
    expression = expression.xreplace({x: outputs[x.name] for x in expression.free_symbols if x.name in outputs})
    state = State(INTEGRAL, derivative=expression)
    return complete(replace(written, states=(*written.states, state), strict_units=False))


class Expression:
    """An expression of variables and data, with its derivatives by the variables."""

    def __init__(self, text: str, place: str) -> None:
        """Read the ``text`` of the part of a cost that counts at a ``place``; raises ExpressionError."""
        expression = parse(text, where=f"cost, {place}")
        self.names = sorted(free_names([expression]) - {TIME.name})
        graph = Graph()
        symbols = {name: graph.symbol(name) for name in (*self.names, TIME.name)}
        node = Translator(graph, symbols)(expression)
        partials = reverse(graph, {node: graph.one}, [symbols[name] for name in self.names])
        self._values = Evaluator(graph, (node, *partials))

    def __call__(self, columns: Mapping[str, Floats], time: Floats) -> tuple[Floats, dict[str, Floats]]:
        """The values (m,) at ``time`` (m,) in s, and {name: derivatives (m,)}; ``columns`` (m,) are in SI units."""
        given = {name: columns[name] for name in self.names}
        found = self._values({**given, TIME.name: time})
        return found[0], dict(zip(self.names, found[1:], strict=True))
