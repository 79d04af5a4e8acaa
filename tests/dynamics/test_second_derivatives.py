"""Second time derivatives on the graph against differences along a curve that is given, not solved for."""

from __future__ import annotations

import random

import numpy as np
import pytest

from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.time_derivatives import differentiate_twice
from lag2fmu.formats.loading import bundled, load

STEP = 0.02


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(bundled().keys() - {"dc_motor"}))  # a further state cannot be given
def test_second_derivatives_along_a_curve(name: str) -> None:
    """q(t) and u(t) are polynomials with random coefficients; differences of order 6."""
    equations = derive(load(name)).apart()
    g, v, generator = equations.graph, equations.variables, random.Random(5)
    second = differentiate_twice(equations, [name for name, _ in equations.locals()])
    program = lower(equations)
    nodes = [*equations.residual, *(node for _, node in equations.locals())]
    label = {node: str(g.leaf[node]) for node in (v.t, *v.q, *v.qd, *v.unknowns, *v.signals, *v.parameters)}
    curves = [np.polynomial.Polynomial([generator.uniform(0.2, 0.9) for _ in range(5)]) for _ in v.q]
    forces = [np.polynomial.Polynomial([generator.uniform(-1, 1) for _ in range(5)]) for _ in v.multipliers]
    inputs = [np.polynomial.Polynomial([generator.uniform(-1, 1) for _ in range(3)]) for _ in v.inputs]
    if v.rates:
        inputs += [c.deriv(order) for order in (1, 2) for c in inputs]
    parameters = {label[node]: generator.uniform(0.5, 2.0) for node in v.parameters}

    def values(time: float, order: int = 2) -> dict[str, float]:
        """The variables at ``time``; for the residual q is followed up to ``order``."""
        moving = {label[node]: curve.deriv(k)(time) for k, row in enumerate((v.q, v.qd, v.qdd))
                  for node, curve in zip(row, curves, strict=True)}  # fmt: skip
        pairs = ((v.signals, inputs), (v.multipliers, forces))
        driven = {label[node]: curve(time) for nodes, row in pairs for node, curve in zip(nodes, row, strict=True)}
        return {label[v.t]: 0.3 + time, **parameters, **moving, **driven}

    found = np.array([g.evaluate(nodes, values(k * STEP)) for k in (-3, -2, -1, 0, 1, 2, 3)])
    expected = np.array([2, -27, 270, -490, 270, -27, 2]) / 180 @ found / STEP**2
    rates = {f"d {label[n]}": c.deriv()(0.0) for n, c in zip(v.signals, inputs, strict=True)}
    rates |= {f"dd {label[n]}": c.deriv(2)(0.0) for n, c in zip(v.signals, inputs, strict=True)}
    highest = [*(c.deriv(2) for c in curves), *forces]
    rates |= {f"d {label[n]}": c.deriv(1)(0.0) for n, c in zip(v.unknowns, highest, strict=True)}
    rates |= {f"dd {label[n]}": c.deriv(2)(0.0) for n, c in zip(v.unknowns, highest, strict=True)}
    own = g.evaluate([*second.residual, *second.locals.values()], values(0.0) | rates)
    n, m = len(v.q), len(v.multipliers)
    entries = [node for rows in (equations.mass_matrix, equations.constraints.jacobian) for row in rows for node in row]
    M, G = np.split(np.array(g.evaluate(entries, values(0.0))).reshape(n + m, n), [n])
    d4q = np.array([c.deriv(2)(0.0) for c in highest])
    own[: n + m] += np.block([[M, -G.T], [G, np.zeros((m, m))]]) @ d4q
    assert own == pytest.approx(expected, abs=1e-6 * (1 + np.abs(expected).max()))
    assert {f.name for f in program.functions} > {"mechanism_residual_second", "mechanism_locals_second"}
