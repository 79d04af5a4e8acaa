"""From equations to functions of arrays: what the code generators print."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from lag2fmu.dynamics.graph import Graph
from lag2fmu.dynamics.lagrange import EquationsOfMotion
from lag2fmu.dynamics.operations import CONSTANT, SYMBOL
from lag2fmu.dynamics.tangent import differentiate


@dataclass(frozen=True)
class Array:
    """An argument: ``name`` in the printed code and its entries as nodes; ``scalar`` if it is a plain number."""

    name: str
    entries: tuple[int, ...]
    scalar: bool = False


@dataclass(frozen=True)
class Function:
    """array[index] = node for each (array, index, node) in ``results``; other entries of the arrays stay untouched."""

    name: str
    doc: str
    arguments: tuple[Array, ...]
    arrays: tuple[str, ...]
    results: tuple[tuple[str, int, int], ...]


@dataclass(frozen=True)
class Program:
    """The functions of one mechanism on one graph; the names of the FMU's vectors in order.

    ``locals`` are the names of the entries of ``mechanism_locals``; ``dependent`` of ``mechanism_dependent``.
    """

    graph: Graph
    functions: tuple[Function, ...]
    inputs: tuple[str, ...]
    locals: tuple[str, ...]
    dependent: tuple[str, ...]

    def operations(self, function: Function) -> int:
        """The number of arithmetic operations and function calls of ``function``."""
        order = self.graph.schedule(node for *_, node in function.results)
        return sum(self.graph.code[node] not in (CONSTANT, SYMBOL) for node in order)


def lower(equations: EquationsOfMotion) -> Program:
    """The functions an FMU needs: mass matrix and forcing, what is calculated, and the tangents of all of it.

    Arguments: t; x = (q, qd), 2n; u, the inputs (Q first, then the user's, then y0, y0_dot, y0_ddot of each motion); p,
    the independent parameters; qdd, n. M is row-major with only its lower triangle written.
    """
    g, v = equations.graph, equations.variables
    n = len(v.q)
    tangent = differentiate(equations)
    u = (*v.Q, *v.inputs, *(node for motion in v.motions for node in motion))
    time, p, qdd = Array("t", (v.t,), True), Array("p", v.parameters), Array("qdd", v.qdd)
    state = (time, Array("x", (*v.q, *v.qd)), Array("u", u), p)
    seed = (Array("dt", (tangent.dt,), True), Array("dx", tangent.dx), Array("du", tangent.du))
    dp, dqdd = Array("dp", tangent.dp), Array("dqdd", tangent.dqdd)
    lower_triangle = tuple(("M", n * i + j, equations.mass_matrix[i][j]) for i in range(n) for j in range(i + 1))
    named = list(equations.locals())

    def function(name: str, doc: str, arguments: tuple[Array, ...], array: str, nodes: Iterable[int]) -> Function:
        return Function(name, doc, arguments, (array,), _entries(array, nodes))

    functions = (
        function(
            "mechanism_dependent",
            "Dependent parameters c of the parameters p.",
            (p,),
            "c",
            equations.dependent.values(),
        ),
        Function(
            "mechanism_dynamics",
            "Mass matrix M (n x n, row-major, lower triangle only) and forcing f of M qdd = f.",
            state,
            ("M", "f"),
            (*lower_triangle, *_entries("f", equations.forcing)),
        ),
        function(
            "mechanism_locals", "Momenta, energies and outputs y.", (*state, qdd), "y", (node for _, node in named)
        ),
        function(
            "mechanism_residual_tangent",
            "Directional derivative dr of r = M qdd - f at fixed qdd.",
            (*state, qdd, *seed, dp),
            "dr",
            tangent.residual,
        ),
        function(
            "mechanism_locals_tangent",
            "Directional derivative dy of the momenta, energies and outputs.",
            (*state, qdd, *seed, dp, dqdd),
            "dy",
            tangent.locals,
        ),
        function(
            "mechanism_dependent_tangent",
            "Directional derivative dc of the dependent parameters.",
            (p, dp),
            "dc",
            tangent.dependent,
        ),
    )
    return Program(
        graph=g,
        functions=functions,
        inputs=tuple(str(g.first[node]) for node in u),
        locals=tuple(name for name, _ in named),
        dependent=tuple(equations.dependent),
    )


def _entries(array: str, nodes: Iterable[int]) -> tuple[tuple[str, int, int], ...]:
    return tuple((array, index, node) for index, node in enumerate(nodes))
