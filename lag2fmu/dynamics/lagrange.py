"""The Lagrange equations of a mechanism, M(q, t) qdd = forcing(t, q, qd, inputs), derived on the graph.

With constraints they read M qdd = forcing + G^T multiplier, see ``constraints``.
With L = T - V, generalized forces Q and Rayleigh's dissipation function R the equations are

    d/dt dL/dqd - dL/dq + dR/dqd = Q.

Bodies have T = 1/2 sum w (dr/dt)^2. For them the first two terms are J^T w (d2r/dt2 - gravity) with J = dr/dq. Forward
AD along the motion gives the accelerations d2r/dt2, and one reverse sweep multiplies with J^T, without M and without
Christoffel symbols. For spatial bodies J is dv/dqd, and dv/dt holds the turning of the axes (Kane, Levinson, Dynamics,
section 6.1). Other terms that the user wrote into L are differentiated: p = dL/dqd by reverse AD, dp/dt by forward AD
over it. The accelerations come from the quadratic form of T over the velocity graph, see ``elimination``.
Source: Hand, Finch, Analytical Mechanics, section 1.9; Landau, Lifshitz, Mechanics, sections 2, 6 and 7 for h, section
25 for R.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from lag2fmu.dynamics.consistent_starts import starting_consistently
from lag2fmu.dynamics.constraints import compose
from lag2fmu.dynamics.drives import carried_coordinates, drive_forces
from lag2fmu.dynamics.elimination import mass_matrix, solve
from lag2fmu.dynamics.energies import Composer
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.formulas import formulas
from lag2fmu.dynamics.massless import with_equilibria
from lag2fmu.dynamics.nominals import with_nominals
from lag2fmu.dynamics.outputs import composed_output
from lag2fmu.dynamics.parts import Constraints, Energies, Entries, RowNumbers, Solution, Variables
from lag2fmu.dynamics.rows import compose_rows
from lag2fmu.dynamics.samples import (
    check_agreement,
    check_positive,
    check_rank,
    check_start,
    mass_matrices,
    massless_directions,
    samples,
)
from lag2fmu.dynamics.starts import start_values
from lag2fmu.dynamics.symbolic import Symbolic
from lag2fmu.dynamics.terms import named_energies, quadratic_form, unconstrained_residual, with_constraints
from lag2fmu.dynamics.variables import declare, translator
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import Forward, reverse
from lag2fmu.graph.batches import matrix
from lag2fmu.graph.cost import cycles
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.lazy import latest
from lag2fmu.mechanism.check import check_starts
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.mechanism.unilaterals import check_open

ACCELERATION_METHODS = ("elimination", "factorisation")
"""How M qdd = forcing is solved: by elimination over the velocity graph, or by an LDL^T of M; both on the graph."""

MAX_FACTORISED = 16
"""With more coordinates n the n^3/3 operations of a factorisation cannot be fewer, and it is not tried."""


class DerivedEquations(EquationsOfMotion):
    """The equations of motion as ``derive`` returns them: notebooks show them, and ``sympy`` gives them as formulas."""

    def __repr__(self) -> str:
        """One line: the mechanism, its size, how accelerations are solved for."""
        size = f"{len(self.forcing)} coordinates, {len(self.constraints)} constraints"
        return f"<EquationsOfMotion of {self.mechanism.name}: {size}, by {self.method}>"

    def _repr_latex_(self) -> str | None:
        """The equations of motion for a notebook; nothing where they would fill pages."""
        found = formulas(self)
        if found is None:
            return None
        lines = [*found.motion, *found.further, *found.constraints]
        return "$$\\begin{gathered}" + " \\\\ ".join(line.latex for line in lines) + "\\end{gathered}$$"

    @property
    def sympy(self) -> Symbolic:
        """The equations as SymPy expressions: ``mass_matrix``, ``forcing``, ``lagrangian``, ``equations``."""
        return Symbolic(self.apart())


@latest
def derive(mechanism: Mechanism, method: str | None = None) -> DerivedEquations:
    """Derive the equations of motion of ``mechanism``: M (n, n) and forcing (n,) of n coordinates, in SI units.

    ``method`` is one of ACCELERATION_METHODS, by default the quicker one, see ``cost``.

    Raises DerivationError if T is not quadratic in the velocities, if the mass matrix is singular for every q (naming
    the coordinates), if an energy has no finite value at the start, or if no start meets the constraints. Source: Hand,
    Finch, Analytical Mechanics, section 1.9.
    """
    methods = [method] if method else ACCELERATION_METHODS[: 1 if len(mechanism.coordinates) > MAX_FACTORISED else None]
    solved = _solved(_composed(_inertia(mechanism)), methods)
    if solved.solution is None and not any(c.massless for c in mechanism.constraints):
        completed = with_equilibria(mechanism, solved.graph, solved.variables, solved.entries, solved.forcing)
        if completed is not mechanism:
            return derive(completed, method)
    equations = _equations(solved)
    _check_rows(equations)
    _check(equations, solved.composer.distances())
    equations.graph.seal()
    return equations


def _check_rows(equations: EquationsOfMotion) -> None:
    """Raise DerivationError for a contact, stop, dry friction or latch that acts on a coordinate without mass.

    The equilibrium of such a coordinate is a constraint. It would bear the force, which then would move nothing.
    """
    m, rows = equations.mechanism, equations.rows
    contacts = [(c.name, len(c.slips)) for c in m.unilaterals]
    owners = [*(name for name, _ in contacts), *(name for name, slips in contacts for _ in range(slips))]
    owners += [*(f.name for f in m.frictions), *(c.name for c in m.latches)]
    follows = {c.coordinate for c in m.constraints if c.massless}
    for owner, row in zip(owners, rows.jacobian, strict=True):
        for q, entry in zip(m.coordinates, row, strict=True):
            if q.name in follows and entry != equations.graph.zero:
                raise DerivationError(
                    f"mechanism '{m.name}': '{owner}' acts on {q.name}, which has no mass: its force would have to "
                    f"move the equilibrium of {q.name}, which is not derived; give {q.name} a mass, or let "
                    f"'{owner}' act on what has one"
                )


def _check(equations: EquationsOfMotion, distances: Mapping[str, Node]) -> None:
    """Evaluate the equations at the start and five random states; raise DerivationError if they cannot be solved."""
    mechanism, g, forcing = equations.mechanism, equations.graph, equations.forcing
    states = [start_values(mechanism), *samples(mechanism, 5)]
    masses = mass_matrices(g, equations.entries, equations.variables.qd, states)
    at_start = masses[0]
    if not np.all(np.isfinite(at_start)):  # M may be finite where coefficients of its form are not
        at_start = matrix(g, equations.mass_matrix, states[0], len(forcing))
    check_start(mechanism, g, at_start, forcing, distances)
    if not mechanism.coordinates:
        return
    check_positive(mechanism, at_start)
    check_rank(mechanism, masses[1:], equations.solution is not None)
    check_agreement(mechanism, g, masses[1:], states[1:], forcing, equations.solution)


def with_derived(mechanism: Mechanism, equations: EquationsOfMotion | None = None) -> Mechanism:
    """``mechanism`` with what derivation adds to it: nominal values, and equilibria of coordinates without mass.

    Start values stay as they are. ``equations`` are those of the mechanism, if they are derived already. Raises
    DerivationError as ``derive`` does.
    """
    return (equations or derive(mechanism)).completed


@dataclass(frozen=True)
class _Inertia:
    """M as the quadratic form ``entries`` over the velocity graph, and what it is made of."""

    mechanism: Mechanism
    graph: Graph
    variables: Variables
    composer: Composer
    constraints: Constraints
    energies: Energies
    entries: Entries


@dataclass(frozen=True)
class _Composed(_Inertia):
    """Both sides of M qdd = forcing on the graph, and the rows that act at times."""

    forcing: tuple[Node, ...]
    rows: RowNumbers


@dataclass(frozen=True)
class _Solved(_Composed):
    """Both sides, and the accelerations found by ``method``; ``solution`` is None if M is singular for every q."""

    method: str
    solution: Solution | None


def _inertia(mechanism: Mechanism) -> _Inertia:
    """M, in which constraints that restrict a motion without mass act as inertias.

    A motion without mass makes M singular, but a constraint on it keeps the KKT matrix regular. A fictitious energy
    1/2 weight (G qd + b)^2 then makes M regular. It is 0 along the motion, so it changes neither the motion nor the
    multipliers.
    Source: M. Benzi, G. Golub, J. Liesen, Numerical solution of saddle point problems, Acta Numerica 2005, section 5.
    """
    bare = _carrying(mechanism, {})
    if not mechanism.constraints:
        return bare
    carried = massless_directions(mechanism, bare.graph, bare.entries, bare.variables.qd, bare.constraints.jacobian)
    return _carrying(mechanism, carried) if carried else bare


def _carrying(mechanism: Mechanism, carried: Mapping[int, float]) -> _Inertia:
    """M with the constraints ``carried`` {index: weight} as inertias."""
    graph = Graph()
    variables = declare(graph, mechanism)
    put = translator(graph, mechanism, variables)
    variables = variables._replace(further_rates=tuple(put(state.derivative) for state in mechanism.states))
    composer = Composer(graph, mechanism, put, variables)
    constraints = compose(graph, mechanism, composer.put, variables)
    inertias = {constraints.velocities[k]: graph.constant(Fraction(weight)) for k, weight in sorted(carried.items())}
    energies = replace(composer.energies(), carried=inertias)
    entries = quadratic_form(graph, mechanism, variables, energies)
    return _Inertia(mechanism, graph, variables, composer, constraints, energies, entries)


def _composed(given: _Inertia) -> _Composed:
    """Compose the other side, and the rows."""
    graph, composer = given.graph, given.composer
    residual = unconstrained_residual(graph, given.variables, given.energies, composer.rate, composer.rate)
    forcing = tuple(graph.negate(r) for r in residual)
    rows = compose_rows(graph, given.mechanism, composer.put, given.variables)
    return _Composed(**vars(given), forcing=forcing, rows=rows)


def _solved(given: _Composed, methods: Sequence[str]) -> _Solved:
    """The accelerations by the quickest of ``methods``.

    Each method is tried on its own copy of the graph, so that none profits from nodes of the others. The graph then
    takes over the nodes of the quickest one.
    """
    least = math.inf
    best, method, solution = given.graph, methods[0], None
    for name in methods:
        trial = given.graph.copy()
        found = solve(trial, given.entries, given.variables.qd, given.forcing, early=name == "elimination")
        cost = cycles(trial, found.x) if found else math.inf
        if cost < least:
            least, best, method, solution = cost, trial, name, found
    given.graph.adopt(best)
    return _Solved(**vars(given), method=method, solution=solution)


def _starting(solved: _Solved) -> tuple[Mechanism, Mechanism]:
    """The mechanism with nominal values, and the same with starts that meet the constraints.

    How far a coordinate is moved depends on its nominal value, and the nominal values depend on the start. So a first
    start gives the nominal values, and these give the second start, which is returned.
    """
    mechanism, g, constraints = solved.mechanism, solved.graph, solved.constraints
    first = starting_consistently(mechanism, g, constraints)
    sized = with_nominals(first, g, solved.variables, solved.entries, solved.forcing, constraints)
    if sized is first:
        return mechanism, first
    pairs = zip(mechanism.coordinates, sized.coordinates, strict=True)
    completed = mechanism.starting_at(
        replace(old, nominal=new.nominal, nominal_from=new.nominal_from) for old, new in pairs
    )
    return completed, starting_consistently(completed, g, constraints)


def _equations(solved: _Solved) -> DerivedEquations:
    """The record of the equations: accelerations, mass matrix, residual, momenta, energies and the user's outputs."""
    mechanism, composer, parts = solved.mechanism, solved.composer, solved.energies
    g, v = solved.graph, solved.variables
    completed, started = _starting(solved)
    check_starts(started)
    if mechanism.unilaterals:
        check_open(started, mechanism.unilaterals, solved=True)
    outputs = {
        name: x for o in mechanism.outputs for name, x in zip(o.names, composed_output(composer, o), strict=True)
    }
    dependent = {p.name: composer.put.names[p.name] for p in mechanism.parameters if p.expression is not None}
    momenta = tuple(reverse(g, {parts.lagrangian(g): g.one}, v.qd))
    rate, accelerating = (Forward(g, v.direction(g, along)) for along in (False, True))
    residual = unconstrained_residual(g, v, parts, rate, accelerating)
    drives = drive_forces(g, mechanism, v, parts, solved.constraints, solved.rows)
    rates = (*(y_dot for _, y_dot in v.driven), *(v.qd[i] for i in carried_coordinates(mechanism)))
    return DerivedEquations(
        mechanism=started,
        completed=completed,
        method=solved.method,
        graph=g,
        variables=v,
        entries=solved.entries,
        forcing=solved.forcing,
        solution=solved.solution,
        constraints=solved.constraints,
        permanent=solved.constraints,
        rows=solved.rows,
        outputs=outputs,
        dependent=dependent,
        parts=parts,
        mass_matrix=mass_matrix(g, solved.entries, v.qd),
        residual=with_constraints(g, v, residual, solved.constraints, accelerating),
        momenta=momenta,
        drives=drives,
        powers=tuple(g.multiply(force, speed) for force, speed in zip(drives, rates, strict=True)),
        energies=named_energies(g, v, parts, momenta),
    )
