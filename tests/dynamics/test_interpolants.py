"""Tables of measured data: values and derivatives of all orders against SciPy's interpolators, and what is beyond."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator, RectBivariateSpline
from sympy import cos, sin

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.functions import Array, Function
from lag2fmu.dynamics.tables import in_pieces, interpolant
from lag2fmu.errors import MechanismError
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.batches import evaluate
from lag2fmu.mechanism import Energy, Mechanism, Table, coordinate

Floats = NDArray[np.float64]
RANDOM = np.random.default_rng(7)
X, Y = np.sort(RANDOM.uniform(-2, 3, 8)), np.sort(RANDOM.uniform(0, 5, 6))
LINE, GRID = RANDOM.normal(size=8), RANDOM.normal(size=(8, 6))
INSIDE, BESIDE = RANDOM.uniform(X[0], X[-1], 40), RANDOM.uniform(Y[0], Y[-1], 40)
OUTSIDE = np.array([X[0] - 1, X[-1] + 0.5])


def line(kind: str, outside: str = "hold") -> Table:
    return Table("f", columns=[X, LINE], interpolation=kind, outside=outside)


@pytest.mark.parametrize(("kind", "spline"), [("cubic", CubicSpline), ("pchip", PchipInterpolator)])
def test_one_argument_is_that_of_scipy(kind: str, spline: type) -> None:
    expected = spline(X, LINE)
    points = np.concatenate([INSIDE, X, OUTSIDE])
    for order in range(5):
        found = interpolant(line(kind, "extrapolate"))((order,), points)
        assert found == pytest.approx(expected(points, order), rel=1e-14, abs=1e-13)


def test_linear_is_that_of_numpy() -> None:
    table = interpolant(line("linear"))
    points = np.concatenate([INSIDE, X, OUTSIDE])
    assert table((0,), points) == pytest.approx(np.interp(points, X, LINE), rel=1e-14, abs=1e-14)
    slopes = np.diff(LINE) / np.diff(X)
    assert table((1,), INSIDE) == pytest.approx(slopes[np.searchsorted(X, INSIDE) - 1], rel=1e-14)
    assert not table((1,), OUTSIDE).any()


@pytest.mark.parametrize(("kind", "degree"), [("linear", 1), ("cubic", 3)])
def test_two_arguments_are_those_of_scipy(kind: str, degree: int) -> None:
    table = interpolant(Table("f", columns=[X, Y, GRID], interpolation=kind))
    expected = RectBivariateSpline(X, Y, GRID, kx=degree, ky=degree)
    for orders in product(range(degree), repeat=2):
        found, wanted = table(orders, INSIDE, BESIDE), expected.ev(INSIDE, BESIDE, *orders)
        assert found == pytest.approx(wanted, rel=1e-12, abs=1e-14 * np.abs(wanted).max())


@pytest.mark.parametrize("kind", ["linear", "pchip", "cubic"])
def test_beyond_the_data(kind: str) -> None:
    assert interpolant(line(kind, "hold"))((0,), OUTSIDE) == pytest.approx(LINE[[0, -1]], rel=1e-14)
    assert not interpolant(line(kind, "hold"))((1,), OUTSIDE).any()
    assert np.isnan(interpolant(line(kind, "error"))((0,), OUTSIDE)).all()
    assert not np.isnan(interpolant(line(kind, "error"))((0,), X)).any()


@pytest.mark.parametrize("points", [2, 3])
def test_few_points_give_the_polynomial_through_them(points: int) -> None:
    table = interpolant(Table("f", columns=[X[:points], LINE[:points]], interpolation="cubic", outside="extrapolate"))
    polynomial = np.polynomial.Polynomial.fit(X[:points], LINE[:points], points - 1)
    assert table((0,), INSIDE) == pytest.approx(polynomial(INSIDE), rel=1e-11)


def test_a_table_of_two_arguments_is_not_pchip() -> None:
    with pytest.raises(MechanismError, match="pchip is for one argument"):
        Table("f", columns=[X, Y, GRID], interpolation="pchip")


# -------------------------------------------------------------------------------------------------------- on the graph


def swing() -> Mechanism:
    """A bead in a measured potential with measured drag: V(theta), Q = g(theta_dot, sin theta)."""
    theta = coordinate("theta", "rad", start=0.4)
    well = Table("well", columns=[X, LINE], interpolation="cubic", outside="extrapolate")
    drag = Table("drag", columns=[X, Y, GRID], interpolation="linear", outside="hold")
    return Mechanism(
        "swing",
        coordinates=[theta],
        tables=[well, drag],
        energy=Energy(kinetic=theta.dot**2 * (2 + cos(theta)) / 2, potential=well(2 * theta)),
        forces={theta: drag(theta.dot, 2 + sin(theta))},
    )


def test_forces_are_derivatives_of_tables() -> None:
    equations = derive(swing())
    values = {"t": 0.0, "theta": 0.35, "theta_dot": 0.8, "Q_theta": 0.0}
    (force,) = equations.graph.evaluate(equations.forcing, values)
    drag = RectBivariateSpline(X, Y, GRID, kx=1, ky=1)(0.8, 2 + np.sin(0.35))[0, 0]
    slope = 2 * CubicSpline(X, LINE)(0.7, 1)
    inertial = -np.sin(0.35) * 0.8**2 / 2
    assert force == pytest.approx(drag - slope - inertial, rel=1e-13)


def test_nested_derivatives_are_exact() -> None:
    equations = derive(swing()).apart()
    g, v = equations.graph, equations.variables
    node = equations.energies["potential_energy"]
    values = {"t": 0.0, "theta": np.array([0.1, 0.35, 0.9]), "theta_dot": 0.0}
    for order in range(1, 5):
        (node,) = forward(g, [node], {v.q[0]: g.one})
        expected = 2.0**order * CubicSpline(X, LINE)(2 * values["theta"], order)
        assert evaluate(g, [node], values)[0] == pytest.approx(expected, rel=1e-13)


def test_the_formulas_call_the_tables() -> None:
    assert "well(2*theta)" in str(derive(swing()).sympy.lagrangian)


@pytest.mark.parametrize("forceful", [False, True])
@pytest.mark.parametrize("kind", ["linear", "pchip", "cubic"])
def test_pieces_are_the_table(kind: str, forceful: bool) -> None:
    """Choices at the kinks have the values and derivatives that the lookup has, inside, at and beyond the knots."""
    theta = coordinate("theta", "rad")
    m = Mechanism(
        "m",
        coordinates=[theta],
        tables=[line(kind)],
        energy=Energy(kinetic=theta.dot**2 / 2),
        forces={theta: line(kind)(theta)},
    )
    equations = derive(m).apart()
    g, v = equations.graph, equations.variables
    slopes = forward(g, equations.forcing, {v.q[0]: g.one})
    rows = [*equations.forcing, *slopes, *forward(g, slopes, {v.q[0]: g.one})]
    results = tuple(("f", i, node) for i, node in enumerate(rows))
    whole = Function("f", "", (Array("x", v.states),), ("f",), results)
    (pieces,) = in_pieces(g, [whole], rows, {v.q[0]}, forceful=forceful)
    new = [node for *_, node in pieces.results]
    assert new != rows
    values = {"t": 0.0, "Q_theta": 0.0, "theta_dot": 0.0, "theta": np.concatenate([INSIDE, OUTSIDE])}
    assert evaluate(g, new, values) == pytest.approx(evaluate(g, rows, values), rel=1e-13, abs=1e-13)
