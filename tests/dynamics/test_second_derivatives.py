"""Second time derivatives on the graph against differences along a curve that is given, not solved for."""

from __future__ import annotations

import random

import numpy as np
import pytest

from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.time_derivatives import differentiate_twice
from lag2fmu.mechanism.loading import bundled, load

STEP = 0.02


@pytest.mark.parametrize("name", bundled())
def test_second_derivatives_along_a_curve(name: str) -> None:
    """q(t) and u(t) are polynomials with random coefficients; differences of order 6."""
    equations = derive(load(name))
    g, v, generator = equations.graph, equations.variables, random.Random(5)
    second = differentiate_twice(equations, [name for name, _ in equations.locals()])
    program = lower(equations)
    nodes = [*equations.residual, *(node for _, node in equations.locals())]
    label = {node: str(g.first[node]) for node in (v.t, *v.q, *v.qd, *v.qdd, *v.inputs, *v.parameters)}
    curves = [np.polynomial.Polynomial([generator.uniform(0.2, 0.9) for _ in range(5)]) for _ in v.q]
    inputs = [np.polynomial.Polynomial([generator.uniform(-1, 1) for _ in range(3)]) for _ in v.inputs]
    parameters = {label[node]: generator.uniform(0.5, 2.0) for node in v.parameters}

    def values(time: float, order: int = 2) -> dict[str, float]:
        """The variables at ``time``; for the residual q is followed up to ``order``."""
        moving = {label[node]: curve.deriv(k)(time) for k, row in enumerate((v.q, v.qd, v.qdd))
                  for node, curve in zip(row, curves, strict=True)}  # fmt: skip
        driven = {label[node]: curve(time) for node, curve in zip(v.inputs, inputs, strict=True)}
        return {label[v.t]: 0.3 + time, **parameters, **moving, **driven}

    found = np.array([g.evaluate(nodes, values(k * STEP)) for k in (-3, -2, -1, 0, 1, 2, 3)])
    expected = np.array([2, -27, 270, -490, 270, -27, 2]) / 180 @ found / STEP**2
    rates = {f"d {label[n]}": c.deriv()(0.0) for n, c in zip(v.inputs, inputs, strict=True)}
    rates |= {f"dd {label[n]}": c.deriv(2)(0.0) for n, c in zip(v.inputs, inputs, strict=True)}
    rates |= {f"d {label[n]}": c.deriv(3)(0.0) for n, c in zip(v.qdd, curves, strict=True)}
    rates |= {f"dd {label[n]}": c.deriv(4)(0.0) for n, c in zip(v.qdd, curves, strict=True)}
    own = g.evaluate([*second.residual, *second.locals.values()], values(0.0) | rates)
    d4q = np.array([c.deriv(4)(0.0) for c in curves])
    M = np.array(g.evaluate([node for row in equations.mass_matrix for node in row], values(0.0))).reshape(len(d4q), -1)
    own[: len(d4q)] += M @ d4q
    assert own == pytest.approx(expected, abs=1e-6 * (1 + np.abs(expected).max()))
    assert {f.name for f in program.functions} > {"mechanism_residual_second", "mechanism_locals_second"}
