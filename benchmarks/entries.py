"""What is compared: lag2fmu itself, and algorithms written by hand put through its graph (the floor)."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction

from benchmarks.cases import Case
from benchmarks.recursive import Given, articulated, inverse_and_mass
from benchmarks.running import Source
from lag2fmu.codegen.c import c_function
from lag2fmu.dynamics import Array, EquationsOfMotion, Function, Program, derive, lower
from lag2fmu.dynamics.lagrange import ACCELERATION_METHODS
from lag2fmu.graph.graph import Graph
from lag2fmu.mechanism import Mechanism

OURS = "lag2fmu"


@dataclass
class Entry:
    """One way to the accelerations: its code, and the CPU seconds that deriving and printing it took.

    ``operations`` of all that is computed, ``mass_operations`` of M and f alone where these are written out;
    ``derivative``: the code of the directional derivative (qdd known), ``next_derivative`` for a further seed;
    ``repeat`` does the derivation and printing again, for a median.
    """

    source: Source
    seconds: float
    operations: int | None = None
    mass_operations: int | None = None
    derivative: Source | None = None
    next_derivative: Source | None = None
    derivative_operations: int | None = None
    repeat: Callable[[], float] | None = None
    note: str = ""
    extra: dict[str, float] = field(default_factory=dict)


def solve_operations(n: int) -> int:
    """The operations of kernels/solve.h."""
    factor = sum(1 + sum(3 + 2 * (n - i) for i in range(k + 1, n)) for k in range(n))
    return factor + sum(1 + 2 * i for i in range(n))


def _program(graph: Graph, function: Function) -> Program:
    return Program(graph, (function,), "", 0, (), (), ())


# ---------------------------------------------------------------------------------------------------------- lag2fmu


def ours(case: Case, method: str | None = None) -> Entry:
    """The derivation of lag2fmu by ``method``, or by its own choice."""
    seconds, equations, text = _derived(case.mechanism(), method)
    g, n = equations.graph, case.n
    program = lower(equations)
    kept = ("mechanism_residual_tangent", "mechanism_factor", "mechanism_solve")
    parts = "\n".join(c_function(program, f) for f in program.functions if f.name in kept)
    macros = {"N_FACTOR": str(max(1, program.factor_size))}
    triangle = [equations.mass_matrix[i][j] for i in range(n) for j in range(i + 1)]
    solution = equations.solution
    if solution is None:
        raise ValueError(f"{case.name}: no order of elimination without a pivot that is zero")
    return Entry(
        source=Source("lag2fmu.c", text, tolerance=1e-12),
        seconds=seconds,
        operations=g.operations(solution.x),
        mass_operations=g.operations([*equations.forcing, *triangle]),
        derivative=Source("lag2fmu_derivative.c", parts, macros),
        next_derivative=Source("lag2fmu_next_derivative.c", parts, macros, tolerance=None),
        derivative_operations=sum(program.operations(name) for name in kept),
        repeat=lambda: _derived(case.mechanism(), method)[0],
        note=f"chosen: {equations.method}" if method is None else "",
        extra=_whole(case) if method is None else {},
    )


def _derived(mechanism: Mechanism, method: str | None) -> tuple[float, EquationsOfMotion, str]:
    """CPU seconds of deriving and printing the accelerations, the equations, and the text."""
    start = time.process_time()
    equations = derive(mechanism, method)
    text = _accelerations_text(equations)
    return time.process_time() - start, equations, text


def _accelerations_text(equations: EquationsOfMotion) -> str:
    v, solution = equations.variables, equations.solution
    assert solution is not None
    results: list[tuple[str, int, int]] = [("qdd", i, node) for i, node in enumerate(solution.x)]
    results += [("pivots", i, node) for i, node in enumerate(solution.pivots)]
    arguments = (
        Array("t", (v.t,), True),
        Array("x", (*v.q, *v.qd)),
        Array("u", v.inputs),
        Array("p", v.parameters),
    )
    function = Function("mechanism_accelerations", "", arguments, ("qdd", "pivots"), tuple(results))
    return c_function(_program(equations.graph, function), function)


def _whole(case: Case) -> dict[str, float]:
    """CPU seconds of building the record, and of deriving and printing all functions of an FMU."""
    start = time.process_time()
    mechanism = case.mechanism()
    built = time.process_time()
    program = lower(derive(mechanism))
    for function in program.functions:
        c_function(program, function)
    return {"record": built - start, "all functions": time.process_time() - built}


def methods() -> tuple[str | None, ...]:
    """The methods of lag2fmu, and None for its own choice."""
    return (None, *ACCELERATION_METHODS)


# ------------------------------------------------------------------------------------------------------- by hand


class Node:
    """A node of the graph of lag2fmu with the operators of a number."""

    def __init__(self, graph: Graph, node: int) -> None:
        self.graph, self.node = graph, node

    def _other(self, other: object) -> int:
        return other.node if isinstance(other, Node) else _constant(self.graph, other)

    def __add__(self, other: object) -> Node:
        return Node(self.graph, self.graph.add(self.node, self._other(other)))

    def __sub__(self, other: object) -> Node:
        return Node(self.graph, self.graph.subtract(self.node, self._other(other)))

    def __rsub__(self, other: object) -> Node:
        return Node(self.graph, self.graph.subtract(self._other(other), self.node))

    def __mul__(self, other: object) -> Node:
        return Node(self.graph, self.graph.multiply(self.node, self._other(other)))

    def __truediv__(self, other: object) -> Node:
        return Node(self.graph, self.graph.divide(self.node, self._other(other)))

    def __rtruediv__(self, other: object) -> Node:
        return Node(self.graph, self.graph.divide(self._other(other), self.node))

    def __neg__(self) -> Node:
        return Node(self.graph, self.graph.negate(self.node))

    __radd__ = __add__
    __rmul__ = __mul__

    def apply(self, name: str) -> Node:
        """The function ``name`` of this."""
        return Node(self.graph, self.graph.apply(name, self.node))


def _constant(graph: Graph, value: object) -> int:
    assert isinstance(value, (int, float))
    return graph.constant(Fraction(str(value)))


def by_hand(case: Case, algorithm: str) -> Entry:
    """The articulated-body ("aba") or composite-body ("crba") algorithm written by hand, on the graph of lag2fmu."""
    start = time.process_time()
    graph = Graph()
    x = [Node(graph, graph.symbol(f"x{i}")) for i in range(2 * case.n)]
    Q = [Node(graph, graph.symbol(f"Q{i}")) for i in range(case.n)]
    p = {name: Node(graph, graph.symbol(name)) for name in case.values}
    given = Given(x[: case.n], x[case.n :], Q, p, lambda a: a.apply("sin"), lambda a: a.apply("cos"))

    def nodes(scalars: Iterable[object]) -> list[int]:
        return [s.node if isinstance(s, Node) else _constant(graph, s) for s in scalars]

    arrays = [Array("x", tuple(nodes(x))), Array("u", tuple(nodes(Q))), Array("p", tuple(nodes(p.values())))]
    if algorithm == "aba":
        results = [("qdd", i, node) for i, node in enumerate(nodes(articulated(case, given)))]
        function = Function("by_hand", "", tuple(arrays), ("qdd",), tuple(results))
    else:
        M, h = inverse_and_mass(case, given)
        upper = [(i * case.n + j, M[i][j]) for i in range(case.n) for j in range(i, case.n)]
        results = [("M", index, node) for (index, _), node in zip(upper, nodes(e for _, e in upper), strict=True)]
        results += [("h", i, node) for i, node in enumerate(nodes(h))]
        function = Function("by_hand", "", (arrays[0], arrays[2]), ("M", "h"), tuple(results))
    text = c_function(_program(graph, function), function)
    seconds = time.process_time() - start
    count = graph.operations([node for *_, node in results])
    if algorithm == "aba":
        return Entry(Source("graph.c", text, tolerance=1e-12), seconds, count)
    total = count + solve_operations(case.n) + case.n
    return Entry(Source("graph_mass.c", text, tolerance=1e-12), seconds, total, count)
