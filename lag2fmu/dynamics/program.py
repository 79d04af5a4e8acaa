"""From equations to functions of arrays: what the code generators print."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass

from lag2fmu.dynamics.elimination import solve
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.schur_complement import solve_constrained
from lag2fmu.dynamics.tables import lookups
from lag2fmu.dynamics.tangent import Tangent, differentiate
from lag2fmu.dynamics.terms import canonical
from lag2fmu.dynamics.time_derivatives import SecondDerivatives, differentiate_twice
from lag2fmu.errors import DerivationError
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.graph.operations import SYMBOL


@dataclass(frozen=True)
class Array:
    """An argument: ``name`` in the printed code and its entries as nodes; ``scalar`` if it is a plain number."""

    name: str
    entries: tuple[Node, ...]
    scalar: bool = False


@dataclass(frozen=True)
class Function:
    """array[index] = node for each (array, index, node) in ``results``; other entries of the arrays stay untouched.

    ``name`` and ``doc`` stand in the printed code. ``arrays`` are the names of the arrays that it fills, in order.
    """

    name: str
    doc: str
    arguments: tuple[Array, ...]
    arrays: tuple[str, ...]
    results: tuple[tuple[str, int, Node], ...]

    @property
    def given(self) -> frozenset[Node]:
        """The nodes that are entries of arguments and need not be computed."""
        return frozenset(entry for argument in self.arguments for entry in argument.entries)

    def check(self, graph: Graph) -> Function:
        """The function itself. Raises DerivationError if a result depends on a variable that no argument holds."""
        needed, given = graph.cone((node for *_, node in self.results), self.given), self.given
        missing = [str(graph.leaf[node]) for node in needed if graph.code[node] == SYMBOL and node not in given]
        if missing:
            raise DerivationError(
                f"{self.name} needs {', '.join(missing)}, which are none of its arguments; "
                "this is a fault of lag2fmu, please report it with the model"
            )
        return self


@dataclass(frozen=True)
class TableArgument:
    """An argument, at ``position`` from 1 on, of a table that has no value outside ``least`` to ``greatest`` (SI)."""

    table: str
    position: int
    least: float
    greatest: float


@dataclass(frozen=True)
class Program:
    """The functions of one mechanism on one graph, and the names of the entries of the FMU's vectors.

    ``locals`` are the names of the entries of ``mechanism_locals``, ``dependent`` those of ``mechanism_dependent``.
    ``method`` says how M is solved, one of ACCELERATION_METHODS. ``factor_size`` is the length of the array that
    ``mechanism_factor`` hands to ``mechanism_solve``, ``signals`` that of u, the inputs with their rates. ``outputs``
    names the outputs beside q and qd; each of them has a second time derivative. ``arguments`` are those that
    ``mechanism_arguments`` evaluates.
    """

    graph: Graph
    functions: tuple[Function, ...]
    method: str
    factor_size: int
    inputs: tuple[str, ...]
    locals: tuple[str, ...]
    dependent: tuple[str, ...]
    outputs: frozenset[str] = frozenset()
    signals: int = 0
    arguments: tuple[TableArgument, ...] = ()

    def contains(self, variable: str) -> bool:
        """Whether the equations of motion, further states or constraints contain the ``variable``; the time is 't'."""
        names = ("mechanism_dynamics", "mechanism_constrained", "mechanism_further")
        equations = [f for f in self.functions if f.name in names]
        return variable in self.graph.symbols([node for f in equations for *_, node in f.results])

    def operations(self, name: str) -> int:
        """The number of arithmetic operations and function calls of the function ``name``."""
        function = next(f for f in self.functions if f.name == name)
        return self.graph.operations((node for *_, node in function.results), function.given)


def lower(equations: EquationsOfMotion, promoted: Collection[str] = (), variational: bool = False) -> Program:
    """The functions an FMU needs: accelerations, what is calculated from them, the tangents, second time derivatives.

    ``promoted`` names the accelerations and locals that are outputs beside those of the mechanism. ``variational``
    adds the momenta and forces that variational solvers work on.

    The arguments of the functions are t; x = (q, qd) with the f further states behind, (2n + f,); u, the inputs: Q,
    then the user's, then y0, y0_dot, y0_ddot of each motion; p, the independent parameters; qdd, (n,), with the m
    multipliers behind it. Where coordinates without mass follow from forces, the rates of the inputs stand behind the
    inputs in u. Of M, which is row-major, only the lower triangle is written. All values are in SI units. Raises
    DerivationError if a function would need a variable that is none of its arguments.
    """
    equations = equations.apart()
    g, v = equations.graph, equations.variables
    p = Array("p", v.parameters)
    state = (Array("t", (v.t,), True), Array("x", v.states), Array("u", v.signals), p)
    factor, solution = _factor_and_solve(equations, state)
    outputs = frozenset((*equations.mechanism.output_names, *promoted))
    qdd = Array("qdd", v.unknowns)
    functions = (
        _function("mechanism_dependent", "Dependent parameters c.", (p,), c=equations.dependent.values()),
        _accelerations(equations, state),
        _dynamics(equations, state),
        factor,
        solution,
        *_constraints(equations, state, factor),
        *_further(equations, state, qdd),
        *(_canonical(equations, state) if variational else ()),
        _function(
            "mechanism_locals",
            "Momenta, energies and outputs y.",
            (*state, qdd),
            y=(node for _, node in equations.locals()),
        ),
        *_tangents(differentiate(equations), state, qdd, len(equations.constraints) > 0),
        *_second_derivatives(differentiate_twice(equations, outputs), state, qdd),
    )
    arguments = _arguments(g, functions, state)
    if arguments:
        doc = "Arguments a of tables that have no value outside their data."
        functions = (*functions, _function("mechanism_arguments", doc, state, a=(node for node, _ in arguments)))
    return Program(
        graph=g,
        functions=tuple(function.check(g) for function in functions),
        arguments=tuple(argument for _, argument in arguments),
        method=equations.method,
        factor_size=len(factor.results) - len(v.q),
        inputs=tuple(str(g.leaf[node]) for node in v.inputs),
        signals=len(v.signals),
        locals=tuple(name for name, _ in equations.locals()),
        dependent=tuple(equations.dependent),
        outputs=outputs,
    )


def _arguments(
    graph: Graph, functions: Iterable[Function], state: tuple[Array, ...]
) -> list[tuple[Node, TableArgument]]:
    """The arguments, functions of the ``state``, of tables that have no value outside their data."""
    given = {entry for array in state for entry in array.entries}
    nodes = graph.cone(node for f in functions for *_, node in f.results)
    found: dict[tuple[Node, str], TableArgument] = {}
    for table, _, arguments in lookups(graph, nodes):
        for axis, argument in enumerate(arguments):
            symbols = {node for node in graph.cone([argument]) if graph.code[node] == SYMBOL}
            if table.outside == "error" and symbols <= given:
                knots = table.knots[axis]
                found[argument, table.name] = TableArgument(table.name, axis + 1, float(knots[0]), float(knots[-1]))
    return [(argument, range_of) for (argument, _), range_of in found.items()]


def _function(name: str, doc: str, arguments: tuple[Array, ...], **arrays: Iterable[Node]) -> Function:
    """A function that fills ``arrays`` with nodes."""
    results = tuple((array, index, node) for array, nodes in arrays.items() for index, node in enumerate(nodes))
    return Function(name, doc, arguments, tuple(arrays), results)


def _accelerations(equations: EquationsOfMotion, state: tuple[Array, ...]) -> Function:
    """qdd and the pivots of its elimination. Pivots of 0 say that there is no solution on the graph."""
    if len(equations.constraints):
        return _constrained_accelerations(equations, state)
    zeros = (equations.graph.zero,) * len(equations.forcing)
    found = equations.solution
    doc = f"Accelerations qdd by {equations.method}, and its pivots: qdd is usable if all of them are positive."
    return _function(
        "mechanism_accelerations", doc, state, qdd=found.x if found else zeros, pivots=found.pivots if found else zeros
    )


def _constrained_accelerations(equations: EquationsOfMotion, state: tuple[Array, ...]) -> Function:
    """qdd and the multipliers under constraints; all pivots are 0 without a solution on the graph.

    The argument ``drift``, (m,), enters G qdd + gamma + drift = 0; the runtime uses it to reduce the constraints'
    drift.
    """
    g, n, m = equations.graph, len(equations.forcing), len(equations.constraints)
    drift = tuple(g.symbol(f"drift {k}") for k in range(m))
    found = solve_constrained(equations, drift)
    doc = (
        "Accelerations and behind them the multipliers, with G qdd + gamma + drift = 0. Usable if the pivots of M and "
        "the margins of the constraints are positive, and the squares of their distances have not shrunk."
    )
    return _function(
        "mechanism_accelerations",
        doc,
        (*state, Array("drift", drift)),
        qdd=found.unknowns if found else (g.zero,) * (n + m),
        pivots=found.pivots if found else (g.zero,) * n,
        margins=found.margins if found else (g.zero,) * m,
        squares=found.squares if found else (g.zero,) * m,
    )


def _dynamics(equations: EquationsOfMotion, state: tuple[Array, ...]) -> Function:
    n = len(equations.forcing)
    triangle = tuple(("M", n * i + j, equations.mass_matrix[i][j]) for i in range(n) for j in range(i + 1))
    forcing = tuple(("f", i, node) for i, node in enumerate(equations.forcing))
    doc = "Mass matrix M (n x n, row-major, lower triangle only) and forcing f of M qdd = f."
    return Function("mechanism_dynamics", doc, state, ("M", "f"), (*triangle, *forcing))


def _factor_and_solve(equations: EquationsOfMotion, state: tuple[Array, ...]) -> tuple[Function, Function]:
    """Two functions that solve M a = b together: the first computes w, which does not depend on b, the second a."""
    g, n = equations.graph, len(equations.forcing)
    rhs = tuple(g.symbol(f"rhs {i}") for i in range(n))
    found = solve(g, equations.entries, equations.variables.qd, rhs, early=equations.method == "elimination")
    x, pivots = (found.x, found.pivots) if found else (rhs, (g.zero,) * n)
    w = tuple(g.frontier(x, rhs))
    doc = "What the solution a of M a = b takes beside b, w, and the pivots."
    factor = _function("mechanism_factor", doc, state, w=w, pivots=pivots)
    return factor, _function("mechanism_solve", "The solution a of M a = b.", (Array("w", w), Array("b", rhs)), a=x)


def _further(equations: EquationsOfMotion, state: tuple[Array, ...], qdd: Array) -> Iterator[Function]:
    """The derivatives of the further states, if there are any."""
    if equations.variables.further:
        doc = "Derivatives dz of the further states; qdd holds the accelerations and behind them the multipliers."
        yield _function("mechanism_further", doc, (*state, qdd), dz=equations.variables.further_rates)


def _canonical(equations: EquationsOfMotion, state: tuple[Array, ...]) -> Iterator[Function]:
    """Momenta and forces of Lagrange's equations, for variational methods."""
    momenta, forces = canonical(equations.graph, equations.variables, equations.parts)
    doc = "Momenta m = dL/dqd and forces F = dL/dq - dR/dqd + Q, so that dm/dt = F but for the forces of constraints."
    yield _function("mechanism_canonical", doc, state, m=momenta, F=forces)


def _constraints(equations: EquationsOfMotion, state: tuple[Array, ...], factor: Function) -> tuple[Function, ...]:
    """A function that measures how far the constraints are met, and one that gives both sides of the KKT system."""
    c = equations.constraints
    if not len(c):
        return ()
    jacobian = tuple(entry for row in c.jacobian for entry in row)
    doc_met = "Of the constraints: positions phi, velocities v = G qd + b and their Jacobian G (m x n, row-major)."
    whole = _function("", "", state, f=equations.forcing, G=jacobian, gamma=c.accelerations)
    doc = "What mechanism_factor gives, forcing f, and G and gamma of the constraints G qdd + gamma = 0."
    return (
        _function("mechanism_constraints", doc_met, state, phi=c.positions, v=c.velocities, G=jacobian),
        Function(
            "mechanism_constrained",
            doc,
            state,
            (*factor.arrays, *whole.arrays),
            (*factor.results, *whole.results),
        ),
    )


def _tangents(tangent: Tangent, state: tuple[Array, ...], qdd: Array, constrained: bool) -> Iterator[Function]:
    """Directional derivatives along (dt, dx, du, dp)."""
    p, dp, dqdd = state[-1], Array("dp", tangent.dp), Array("dqdd", tangent.dqdd)
    seed = (Array("dt", (tangent.dt,), True), Array("dx", tangent.dx), Array("du", (*tangent.du, *tangent.drates)), dp)
    yield _function(
        "mechanism_residual_tangent",
        "Directional derivative dr of r = M qdd - f at fixed qdd."
        + (" Behind M qdd - f - G^T multiplier: G qdd + gamma, v, phi." if constrained else ""),
        (*state, qdd, *seed),
        dr=tangent.residual,
    )
    if tangent.further:
        yield _function(
            "mechanism_further_tangent",
            "Directional derivative d2z of the derivatives dz of the further states.",
            (*state, qdd, *seed, dqdd),
            d2z=tangent.further,
        )
    yield _function(
        "mechanism_locals_tangent",
        "Directional derivative dy of the momenta, energies and outputs.",
        (*state, qdd, *seed, dqdd),
        dy=tangent.locals,
    )
    yield _function(
        "mechanism_dependent_tangent",
        "Directional derivative dc of the dependent parameters.",
        (p, dp),
        dc=tangent.dependent,
    )


def _second_derivatives(second: SecondDerivatives, state: tuple[Array, ...], qdd: Array) -> tuple[Function, Function]:
    """Second time derivatives along a motion: of the residual for d4q, then of the outputs."""
    motion = (*state, qdd, Array("du", second.du), Array("d2u", second.d2u), Array("d3q", second.d3q))
    residual = _function(
        "mechanism_residual_second",
        "Second time derivative d2r of r = M qdd - f without M d4q, the inputs moving with du and d2u.",
        motion,
        d2r=second.residual,
    )
    outputs = Function(
        "mechanism_locals_second",
        "Second time derivatives d2y of those momenta, energies and outputs that are outputs of the FMU.",
        (*motion, Array("d4q", second.d4q)),
        ("d2y",),
        tuple(("d2y", index, node) for index, node in second.locals.items()),
    )
    return residual, outputs
