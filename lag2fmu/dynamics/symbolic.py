"""The equations of motion as SymPy expressions, for reading and for further algebra."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.graph.to_sympy import written


@dataclass(frozen=True)
class Symbolic:
    """Equations of motion in symbols: NAME, NAME_dot, NAME_ddot, Q_NAME, t, inputs, parameters, all in SI units.

    ``of`` are the equations, on a graph of their own. Expressions are written out: they grow with the mechanism, and
    are large from some ten coordinates on.
    """

    of: EquationsOfMotion

    @cached_property
    def mass_matrix(self) -> sp.ImmutableMatrix:
        """M(q, t), (n, n)."""
        rows = self.of.mass_matrix
        return sp.ImmutableMatrix(len(rows), len(rows), self._written([node for row in rows for node in row]))

    @cached_property
    def forcing(self) -> sp.ImmutableMatrix:
        """The right side of M qdd = forcing + G^T multiplier, (n, 1)."""
        return sp.ImmutableMatrix(self._written(self.of.forcing))

    @cached_property
    def lagrangian(self) -> sp.Expr:
        """L = sum qd dL/dqd - h, in J."""
        g = self.of.graph
        whole = g.subtract(g.dot(self.of.variables.qd, self.of.momenta), self.of.energies["generalized_energy"])
        return self._written([whole])[0]

    @cached_property
    def equations(self) -> tuple[sp.Eq, ...]:
        """M qdd = forcing + G^T multiplier, row by row, (n,). Source: Goldstein, Classical Mechanics, section 1.4."""
        g, v = self.of.graph, self.of.variables
        qdd = sp.Matrix(self._written(v.qdd))
        reactions = [g.dot(v.multipliers, [row[i] for row in self.of.constraints.jacobian]) for i in range(len(v.q))]
        right = self.forcing + sp.Matrix(self._written(reactions))
        return tuple(sp.Eq(a, b, evaluate=False) for a, b in zip(self.mass_matrix * qdd, right, strict=True))

    def _written(self, nodes: object) -> list[sp.Expr]:
        return list(written(self.of.graph, list(nodes)))  # type: ignore[call-overload]
