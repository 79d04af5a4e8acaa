"""The small-vibration form of a mechanism: T = 1/2 qd.M qd, V = 1/2 q.K q with constant M and K.

Coordinates are measured from the equilibrium. Coefficients stay formulas of the parameters if the equilibrium does not
move with the parameters; otherwise they are numbers. Terms without an energy (gyroscopic and circulatory terms, inputs)
become forces.
Source: Landau, Lifshitz, Mechanics, sections 21, 23 and 25.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from lag2fmu.analysis.canonical import inertia
from lag2fmu.analysis.equilibria import Equilibrium, equilibria
from lag2fmu.analysis.evaluation import at, driven_by_time, operating_inputs, unknowns
from lag2fmu.description import names
from lag2fmu.description.parts import Constraint, Energy, Force
from lag2fmu.description.symbols import Coordinate
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.batches import Floats, evaluate
from lag2fmu.graph.nodes import Node
from lag2fmu.graph.to_sympy import tidy, written
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.record import Mechanism

_NEGLIGIBLE = 1e-13
"""Entries below this share of the largest one of a matrix, in units of nominal values, are rounding."""


def linearized(mechanism: Mechanism, about: Sequence[float] | None = None) -> Mechanism:
    """The mechanism of small motions of ``mechanism`` about an equilibrium, with coordinates of the same names.

    ``about``: q (n,) in SI units, by default the equilibrium found from the start. The new mechanism starts as far from
    equilibrium as ``mechanism`` does. Raises DerivationError if there is no equilibrium, if ``about`` is no
    equilibrium, if there are further states, or if the equations contain the time, for which ``floquet`` is made.
    Source: Landau, Lifshitz, Mechanics, section 23.
    """
    equations = derive(mechanism)
    if equations.variables.further:
        raise DerivationError(
            f"mechanism '{mechanism.name}' has further states, which no mechanism of small motions is made of; "
            "lag2fmu.analysis.linearize gives A, B, C and D with them"
        )
    return _Form(equations, _equilibrium(equations, about)).mechanism()


def _equilibrium(equations: EquationsOfMotion, about: Sequence[float] | None) -> Equilibrium:
    name = equations.mechanism.name
    if about is None:
        found = equilibria(equations, most=1)
        if not found:
            raise DerivationError(f"mechanism '{name}': no equilibrium was found near the start; give one as 'about'")
        return found[0]
    q = np.asarray(about, dtype=np.float64)
    if q.shape != (len(equations.forcing),):
        raise DerivationError(f"mechanism '{name}': 'about' has shape {q.shape}; give {len(equations.forcing)} values")
    values = at(equations, operating_inputs(equations), q, np.zeros_like(q))
    qdd, multipliers = unknowns(equations, values)
    missed = evaluate(equations.graph, equations.constraints.residuals, values)
    nominal = np.array([c.nominal for c in equations.mechanism.coordinates])
    if not (np.abs(qdd / nominal).max() < 1e-6 and np.abs(missed).max(initial=0.0) < 1e-6):
        listed = ", ".join(
            f"{names.acceleration(c.name)} = {a:.3g}" for c, a in zip(equations.mechanism.coordinates, qdd, strict=True)
        )
        raise DerivationError(f"mechanism '{name}': 'about' is no equilibrium ({listed}); give a configuration at rest")
    return Equilibrium(q, multipliers)


class _Form:
    """M, C, K, the constraints' rows and the inputs' forces at an equilibrium, as expressions."""

    def __init__(self, equations: EquationsOfMotion, about: Equilibrium) -> None:
        self.equations = equations = equations.apart()
        self.about = about
        g, v = equations.graph, equations.variables
        if driven_by_time(equations):
            raise DerivationError(
                f"mechanism '{equations.mechanism.name}': the time is in the equations, so that small motions have no "
                "constant coefficients; ask for Floquet's exponents instead"
            )
        if equations.mechanism.motions and not self._real():
            raise DerivationError(
                f"mechanism '{equations.mechanism.name}': small motions are not supported where both motion inputs and "
                "coordinates without mass are; give what has no mass a small one"
            )
        self.place = {node: self._number(value) for node, value in zip(v.q, about.q, strict=True)}
        self.place |= dict.fromkeys((v.t, *v.qd, *v.qdd, *v.Q, *v.rates), g.zero)
        self.place |= {node: self._number(x) for node, x in zip(v.multipliers, about.multipliers, strict=True)}
        starts = {u.name: u.start for u in equations.mechanism.inputs}
        self.place |= {node: self._number(starts.get(str(g.leaf[node]), 0.0)) for node in v.inputs[len(v.Q) :]}
        self.symbolic = self._stays()

    def _real(self) -> bool:
        """Whether M is the mechanism's own: nothing was added to make it regular."""
        return all(list(a) == b for a, b in zip(self.equations.mass_matrix, inertia(self.equations), strict=True))

    def _number(self, value: float) -> Node:
        from fractions import Fraction

        return self.equations.graph.constant(Fraction(value))

    def _stays(self) -> bool:
        """Whether the equilibrium does not move with the parameters."""
        e = self.equations
        resting = e.graph.substitute([*e.residual[: len(e.forcing)], *e.constraints.residuals], self.place)
        return all(node == e.graph.zero for node in resting)

    def _columns(self, rows: Sequence[Node], variables: Sequence[Node]) -> sp.Matrix:
        """The derivatives of ``rows`` (r,) by ``variables`` (c,) at the equilibrium, (r, c)."""
        e, g = self.equations, self.equations.graph
        nodes = [x for variable in variables for x in g.substitute(forward(g, rows, {variable: g.one}), self.place)]
        # a node may stand for an equal expression in which variables cancel out: these get their values here
        left = {str(g.leaf[node]): float(g.value(value)) for node, value in self.place.items()}
        if self.symbolic:
            numbers = {symbol(name): sp.nsimplify(value) for name, value in left.items()}
            entries = [tidy(x.xreplace(numbers)) for x in written(g, nodes)]
        else:
            values = left | {p.name: p.value for p in e.mechanism.parameters if p.value is not None}
            entries = [sp.Float(x, 17) for x in _clean(evaluate(g, nodes, values))]
        return sp.Matrix(len(variables), len(rows), entries).T

    def mechanism(self) -> Mechanism:
        """The mechanism with these coefficients."""
        e, m, v = self.equations, self.equations.mechanism, self.equations.variables
        residual = e.residual[: len(e.forcing)]
        q = sp.Matrix([symbol(c.name) for c in m.coordinates])
        qd = sp.Matrix([symbol(names.velocity(c.name)) for c in m.coordinates])
        M, C, K = self._columns(e.momenta, v.qd), self._columns(residual, v.qd), self._columns(residual, v.q)
        friction = _half(C + C.T)
        driving = v.inputs[len(v.Q) :]
        inputs = sp.Matrix([symbol(str(e.graph.leaf[node])) for node in driving])
        starts = sp.Matrix([sp.nsimplify(e.graph.value(self.place[node])) for node in driving])
        push = -self._columns(residual, driving) * (inputs - starts) if driving else sp.zeros(len(residual), 1)
        forces = push - _half(C - C.T) * qd - _half(K - K.T) * q
        return Mechanism(
            f"{m.name}_linearized",
            title=f"{m.title}, small motions",
            source=m.source,
            author=m.author,
            version=m.version,
            copyright=m.copyright,
            license=m.license,
            coordinates=[
                self._coordinate(c, float(place)) for c, place in zip(m.coordinates, self.about.q, strict=True)
            ],
            parameters=m.parameters,
            inputs=m.inputs,
            energy=Energy(
                kinetic=_form(M, qd),
                potential=_form(K, q),
                dissipation=None if friction.is_zero_matrix else _form(friction, qd),
            ),
            forces=[Force(c.name, x) for c, x in zip(m.coordinates, forces, strict=True) if x != 0],
            constraints=self._constraints(q, qd, inputs, starts),
            experiment=m.experiment,
        )

    def _constraints(self, q: sp.Matrix, qd: sp.Matrix, inputs: sp.Matrix, starts: sp.Matrix) -> list[Constraint]:
        """The linearized constraints, without equilibria of coordinates without mass, which derivation adds again."""
        e, v = self.equations, self.equations.variables
        rows, driving = e.constraints.residuals, v.inputs[len(v.Q) :]
        if not rows:
            return []
        found = self._columns(rows, v.q) * q + self._columns(rows, v.qd) * qd
        if driving:
            found += self._columns(rows, driving) * (inputs - starts)
        pairs = zip(e.mechanism.constraints, found, strict=True)
        return [replace(c, expression=x, unit=None) for c, x in pairs if not c.massless]

    def _coordinate(self, c: Coordinate, place: float) -> Coordinate:
        """``c`` counted from ``place``; where there are constraints its start becomes a guess."""
        low, high = (None if x is None else x - place for x in (c.minimum, c.maximum))
        doc = f"{c.doc}, from equilibrium" if place else c.doc
        given = not len(self.equations.constraints)
        return replace(c, start=c.start - place, minimum=low, maximum=high, doc=doc, given=given, velocity_given=given)


def _clean(values: Floats) -> Floats:
    size = np.abs(values).max(initial=0.0)
    return np.where(np.abs(values) <= _NEGLIGIBLE * size, 0.0, values)


def _half(matrix: sp.Matrix) -> sp.Matrix:
    return (matrix / 2).applyfunc(sp.expand)


def _form(matrix: sp.Matrix, x: sp.Matrix) -> sp.Expr:
    """1/2 x.matrix x"""
    return sp.expand((x.T * matrix * x)[0] / 2)
