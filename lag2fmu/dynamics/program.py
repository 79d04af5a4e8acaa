"""From equations to the functions of arrays that the code generators print."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.factors import factor_and_solve, without_dampers
from lag2fmu.dynamics.functions import Array, Function, Program, TableArgument, filling
from lag2fmu.dynamics.kinks import switched
from lag2fmu.dynamics.modes import ModeNumbers, sliding_forces, with_rows
from lag2fmu.dynamics.row_functions import contact_events, rows_in_all_modes, time_stepping_rows
from lag2fmu.dynamics.tables import watched_arguments
from lag2fmu.dynamics.tangent import Tangent, differentiate
from lag2fmu.dynamics.terms import canonical, forcing
from lag2fmu.dynamics.time_derivatives import SecondDerivatives, differentiate_twice
from lag2fmu.graph.autodiff import Forward
from lag2fmu.graph.graph import Node

if TYPE_CHECKING:
    from lag2fmu.dynamics.row_tables import SparseRows

__all__ = ["Array", "Function", "Program", "lower"]


def lower(
    equations: EquationsOfMotion,
    promoted: Collection[str] = (),
    variational: bool = False,
    time_stepping: bool = False,
) -> Program:
    """The functions an FMU needs: accelerations, what is calculated from them, the tangents, second time derivatives.

    ``promoted`` names the accelerations and locals that are outputs beside those of the mechanism. ``variational``
    adds the momenta and forces that variational solvers work on, ``time_stepping`` the sparse rows of time stepping.

    The arguments of the functions are, in SI units,

    - t;
    - x: q, qd, and behind them the f further states, (2n + f,);
    - u: the inputs Q, then the user's, then y0, y0_dot, y0_ddot of each motion. If coordinates without mass follow from
      forces, the rates of the inputs stand behind the inputs;
    - p: the numbers of modes, the switches of kinks, and behind them the independent parameters;
    - qdd: (n,), with the m multipliers behind it.

    M is row-major (n, n), and only its lower triangle is written. Raises DerivationError if a function would need a
    variable that is none of its arguments.
    """
    equations = equations.apart()
    modes = ModeNumbers((), (), (), ())
    places: tuple[int, ...] = ()
    if len(equations.rows):
        equations, modes, places = with_rows(equations)
    g, v, rows = equations.graph, equations.variables, equations.rows
    moving = {v.t, *v.states, *v.signals}
    outputs = frozenset((*equations.mechanism.output_names, *promoted))
    sparse = None
    if time_stepping and places:
        from lag2fmu.dynamics.implicit_dampers import implicit_dampers
        from lag2fmu.dynamics.sparse_rows import sparse_rows

        dampers = implicit_dampers(equations, partial(forcing, g, v))
        sparse = sparse_rows(equations, modes, places, dampers)
    functions, arguments, factor_size = _functions(equations, modes, places, outputs, variational, sparse)
    found = switched(g, v, equations.mechanism, functions, masks=len(modes.numbers), conditions=rows.conditions)
    return Program(
        graph=g,
        functions=tuple(function.check(g) for function in found.functions),
        arguments=arguments,
        method=equations.method,
        factor_size=factor_size,
        inputs=tuple(str(g.leaf[node]) for node in v.inputs),
        signals=len(v.signals),
        locals=tuple(name for name, _ in equations.locals()),
        dependent=tuple(equations.dependent),
        outputs=outputs,
        places=places,
        slips=rows.slips,
        masks=len(modes.numbers),
        frictions=len(rows.sliding),
        loaded_friction=not set(g.cone(rows.sliding)).isdisjoint(v.multipliers),
        changing_friction=not moving.isdisjoint(g.cone(rows.friction)),
        changing_restitution=not moving.isdisjoint(g.cone(rows.restitution)),
        latches=len(rows.latches),
        offsets=len(modes.offsets),
        constraints=len(equations.constraints),
        simultaneous=equations.mechanism.impacts == "simultaneous",
        switches=len(found.margins),
        event_functions=(*found.margins, *contact_events(equations)),
        timed_bounds=found.timed_bounds,
        sparse_rows=sparse,
    )


def _functions(
    equations: EquationsOfMotion,
    modes: ModeNumbers,
    places: tuple[int, ...],
    outputs: Collection[str],
    variational: bool,
    sparse: SparseRows | None,
) -> tuple[tuple[Function, ...], tuple[TableArgument, ...], int]:
    """The functions with their kinks, the arguments of tables that are watched, and ``Program.factor_size``."""
    g, v = equations.graph, equations.variables
    accelerations = Forward(g, v.direction(g, True))(equations.rows.velocities)
    sliding = sliding_forces(g, equations.rows, modes, tuple(accelerations))
    p, qdd = Array("p", v.parameters), Array("qdd", v.unknowns)
    state = (Array("t", (v.t,), True), Array("x", v.states), Array("u", v.signals), p)
    stepped, solution = factor_and_solve(equations, sparse.dampers.entries if sparse else equations.entries, state)
    factor = without_dampers(g, stepped, sparse.dampers) if sparse else stepped
    dense = any(node == g.zero for array, _, node in factor.results if array == "pivots")
    doc = "Momenta, energies and outputs y."
    functions = (
        filling("mechanism_dependent", "Dependent parameters c.", (p,), c=equations.dependent.values()),
        _accelerations(equations, places, sliding, state),
        replace(_dynamics(equations, state), rare=not dense),
        factor,
        solution,
        *_constraints(equations, state, factor),
        *_further(equations, state, qdd),
        *(_canonical(equations, state) if variational else ()),
        filling("mechanism_locals", doc, (*state, qdd), y=(node for _, node in equations.locals())),
        *rows_in_all_modes(equations, sliding, state, qdd),
        *time_stepping_rows(equations, sparse, state, qdd, stepped),
        *_tangents(
            differentiate(equations, sliding), state, qdd, len(equations.constraints) > 0, len(equations.rows) > 0
        ),
        *(
            replace(function, rare=True)
            for function in _second_derivatives(
                differentiate_twice(equations, outputs, sliding), state, qdd, len(equations.rows) > 0
            )
        ),
    )
    watched = watched_arguments(g, functions, state)
    if watched:
        doc = "Arguments a of tables that have no value outside their data."
        functions = (*functions, filling("mechanism_arguments", doc, state, a=(node for node, _ in watched)))
    return functions, tuple(argument for _, argument in watched), len(factor.results) - len(v.q)


def _accelerations(
    equations: EquationsOfMotion, places: tuple[int, ...], sliding: tuple[Node, ...], state: tuple[Array, ...]
) -> Function:
    """qdd and the pivots of its elimination. Pivots of 0 say that there is no solution on the graph."""
    if len(equations.constraints):
        return _constrained_accelerations(equations, places, sliding, state)
    zeros = (equations.graph.zero,) * len(equations.forcing)
    found = equations.solution
    doc = f"Accelerations qdd by {equations.method}, and its pivots: qdd is usable if all of them are positive."
    return filling(
        "mechanism_accelerations", doc, state, qdd=found.x if found else zeros, pivots=found.pivots if found else zeros
    )


def _constrained_accelerations(
    equations: EquationsOfMotion, places: tuple[int, ...], sliding: tuple[Node, ...], state: tuple[Array, ...]
) -> Function:
    """qdd and the multipliers under constraints; all pivots are 0 without a solution on the graph.

    The argument ``drift``, (m,), enters G qdd + gamma + drift = 0; the engine uses it to reduce the constraints'
    drift.
    """
    from lag2fmu.dynamics.open_rows import solve_open
    from lag2fmu.dynamics.schur_complement import solve_constrained

    g, n, m = equations.graph, len(equations.forcing), len(equations.constraints)
    drift = tuple(g.symbol(f"drift {k}") for k in range(m))
    rows = len(equations.rows) > 0
    found = solve_open(equations, places, sliding, drift) if rows else solve_constrained(equations, drift)
    doc = (
        "Accelerations and behind them the multipliers, with G qdd + gamma + drift = 0. Usable if the pivots of M and "
        "the margins of the constraints are positive, and the squares of their distances have not shrunk."
        + (" In modes in which no contact, stop, dry friction or latch holds." if rows else "")
    )
    return filling(
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


def _further(equations: EquationsOfMotion, state: tuple[Array, ...], qdd: Array) -> Iterator[Function]:
    """The derivatives of the further states, if there are any."""
    if equations.variables.further:
        doc = "Derivatives dz of the further states; qdd holds the accelerations and behind them the multipliers."
        yield filling("mechanism_further", doc, (*state, qdd), dz=equations.variables.further_rates)


def _canonical(equations: EquationsOfMotion, state: tuple[Array, ...]) -> Iterator[Function]:
    """Momenta p and forces dp/dt of Lagrange's equations, for variational methods."""
    momenta, forces = canonical(equations.graph, equations.variables, equations.parts)
    doc = "Momenta m = dL/dqd and forces F = dL/dq - dR/dqd + Q, so that dm/dt = F but for the forces of constraints."
    yield filling("mechanism_canonical", doc, state, m=momenta, F=forces)


def _constraints(equations: EquationsOfMotion, state: tuple[Array, ...], factor: Function) -> tuple[Function, ...]:
    """A function that measures how far the constraints are met, and one that gives both sides of the KKT system."""
    c = equations.constraints
    if not len(c):
        return ()
    jacobian = tuple(entry for row in c.jacobian for entry in row)
    doc_met = "Of the constraints: positions phi, velocities v = G qd + b and their Jacobian G (m x n, row-major)."
    whole = filling("", "", state, f=equations.forcing, G=jacobian, gamma=c.accelerations)
    doc = "What mechanism_factor gives, forcing f, and G and gamma of the constraints G qdd + gamma = 0."
    return (
        filling("mechanism_constraints", doc_met, state, phi=c.positions, v=c.velocities, G=jacobian),
        Function(
            "mechanism_constrained",
            doc,
            state,
            (*factor.arrays, *whole.arrays),
            (*factor.results, *whole.results),
        ),
    )


def _tangents(
    tangent: Tangent, state: tuple[Array, ...], qdd: Array, constrained: bool, rows: bool
) -> Iterator[Function]:
    """Directional derivatives along (dt, dx, du, dp)."""
    p, dp, dqdd = state[-1], Array("dp", tangent.dp), Array("dqdd", tangent.dqdd)
    seed = (Array("dt", (tangent.dt,), True), Array("dx", tangent.dx), Array("du", (*tangent.du, *tangent.drates)), dp)
    yield filling(
        "mechanism_residual_tangent",
        "Directional derivative dr of r = M qdd - f at fixed qdd."
        + (" Behind M qdd - f - G^T multiplier: G qdd + gamma, v, phi." if constrained else ""),
        (*state, qdd, *seed),
        dr=tangent.residual,
    )
    if tangent.further:
        yield filling(
            "mechanism_further_tangent",
            "Directional derivative d2z of the derivatives dz of the further states.",
            (*state, qdd, *seed, dqdd),
            d2z=tangent.further,
        )
    doc = "Directional derivative dy of the momenta, energies and outputs."
    locals_tangent = filling("mechanism_locals_tangent", doc, (*state, qdd, *seed, dqdd), dy=tangent.locals)
    yield replace(locals_tangent, rare=True)
    yield filling(
        "mechanism_dependent_tangent",
        "Directional derivative dc of the dependent parameters.",
        (p, dp),
        dc=tangent.dependent,
    )
    if rows:
        doc = "Directional derivative ds of the forces of the rows that slide."
        yield filling("mechanism_friction_tangent", doc, (*state, qdd, *seed, dqdd), ds=tangent.sliding)


def _second_derivatives(
    second: SecondDerivatives, state: tuple[Array, ...], qdd: Array, rows: bool
) -> Iterator[Function]:
    """Second time derivatives along a motion: of the residual and of sliding forces for d4q, then of the outputs."""
    motion = (*state, qdd, Array("du", second.du), Array("d2u", second.d2u), Array("d3q", second.d3q))
    further = (*motion, Array("d4q", second.d4q))
    yield filling(
        "mechanism_residual_second",
        "Second time derivative d2r of r = M qdd - f without M d4q, the inputs moving with du and d2u.",
        motion,
        d2r=second.residual,
    )
    yield Function(
        "mechanism_locals_second",
        "Second time derivatives d2y of those momenta, energies and outputs that are outputs of the FMU.",
        further,
        ("d2y",),
        tuple(("d2y", index, node) for index, node in second.locals.items()),
    )
    if rows:
        doc = "Second time derivatives d2s of the forces of the rows that slide."
        yield filling("mechanism_friction_second", doc, further, d2s=second.sliding)
