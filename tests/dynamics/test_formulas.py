"""Formulas to read: they mean what the graph computes, they are as short as on paper, large mechanisms have none."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
import sympy as sp

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.formulas import formulas
from lag2fmu.formats.loading import bundled, load
from lag2fmu.graph.to_sympy import tidy, written

LARGE = {"six_axis_arm", "humanoid_planar", "andrews_squeezer", "bricard", "n_four_bar", "parallel_manipulator"}
LARGE |= {"whipple_bicycle", "rolling_disc", "heavy_top_quaternion", "free_body"}
LARGE |= {"two_armed_robot", "particles", "rattleback", "stack_of_blocks"}
TABLES = {"dc_motor"}
"""Whose tables stand in the formulas by name."""
a, b, c = sp.symbols("a b c", real=True)


@pytest.mark.long
@pytest.mark.parametrize("model", sorted(set(bundled()) - LARGE - TABLES))
def test_written_formulas_mean_what_the_graph_computes(model: str) -> None:
    equations = derive(load(model))
    g = equations.graph
    nodes = [
        *equations.energies.values(),
        *equations.forcing,
        *(entry for row in equations.mass_matrix for entry in row),
    ]
    names = sorted(g.symbols(nodes))
    texts = [tidy(e) for e in written(g, nodes)]
    generator = np.random.default_rng(3)
    for _ in range(3):
        values = dict(zip(names, generator.uniform(0.3, 1.7, len(names)), strict=True))
        found = [float(e.subs({sp.Symbol(n, real=True): x for n, x in values.items()})) for e in texts]
        assert found == pytest.approx(g.evaluate(nodes, values), rel=1e-10, abs=1e-10)


@pytest.mark.parametrize(
    ("long", "short"),
    [
        (c * sp.sin(a) * sp.sin(b) + c * sp.cos(a) * sp.cos(b), c * sp.cos(a - b)),
        (3 * sp.cos(a) * sp.cos(b) - 3 * sp.sin(a) * sp.sin(b), 3 * sp.cos(a + b)),
        (c * sp.sin(a) * sp.cos(b) + c * sp.cos(a) * sp.sin(b), c * sp.sin(a + b)),
        (c * sp.sin(a) * sp.cos(b) - c * sp.cos(a) * sp.sin(b), c * sp.sin(a - b)),
        (c * sp.cos(a) * sp.sin(b) - c * sp.sin(a) * sp.cos(b), c * sp.sin(b - a)),
        ((c * sp.sin(a)) ** 2 + (c * sp.cos(a)) ** 2 - c**2, sp.Integer(0)),
        (sp.cos(a) ** 2 - sp.sin(a) ** 2, sp.cos(2 * a)),
        (sp.sin(a) * sp.sin(b) + 2 * sp.cos(a) * sp.cos(b), sp.sin(a) * sp.sin(b) + 2 * sp.cos(a) * sp.cos(b)),
        (sp.Integer(0), sp.Integer(0)),
    ],
)
def test_addition_theorems(long: sp.Expr, short: sp.Expr) -> None:
    assert sp.expand(tidy(long) - short) == 0


def test_what_is_divided_by_stays_as_it_stands() -> None:
    cube = sp.sqrt(b**2 + c**2) ** 3
    assert tidy(a * (b + c) / cube) == a * b / cube + a * c / cube
    assert tidy((a + b) ** 3 / c) == a**3 / c + 3 * a**2 * b / c + 3 * a * b**2 / c + b**3 / c


def test_the_double_pendulum_as_on_paper() -> None:
    """Landau, Lifshitz, Mechanics, section 5, problem 1."""
    found = formulas(derive(load("double_pendulum")))
    assert found is not None
    kinetic, potential = (formula.latex for formula in found.energies)
    assert kinetic.count("cos") == 1
    assert r"\cos{\left(\theta_{1} - \theta_{2} \right)}" in kinetic
    assert kinetic.startswith("T = ")
    assert potential.startswith("V = ")
    assert found.mass_matrix.latex.startswith(r"M = \left(\begin{matrix}l_{1}^{2} m_{1} + l_{1}^{2} m_{2} &")
    assert [formula.latex.partition(" = ")[2] for formula in found.motion] == [r"Q_{\theta_{1}}", r"Q_{\theta_{2}}"]
    assert all(r"\ddot{\theta}_{2}" in formula.latex for formula in found.motion)


@pytest.mark.long
@pytest.mark.parametrize("model", sorted(set(bundled()) - LARGE))
def test_mathml_is_well_formed(model: str) -> None:
    found = formulas(derive(load(model)))
    assert found is not None
    for formula in (*found.energies, found.mass_matrix, *found.motion):
        assert [child.text for child in ET.fromstring(formula.mathml)].count("=") == 1
        assert formula.latex.count("{") == formula.latex.count("}")


@pytest.mark.parametrize("model", sorted(LARGE))
def test_large_mechanisms_are_not_written_out(model: str) -> None:
    assert formulas(derive(load(model))) is None
