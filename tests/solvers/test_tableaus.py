"""Runge-Kutta methods: derived orders, wrong coefficients, and the orders that show."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from lag2fmu.solvers.methods import DEFAULT_SOLVER
from lag2fmu.solvers.order_conditions import order_of, trees
from lag2fmu.solvers.tableaus import TABLEAUS, Tableau

EULER = (((Fraction(0),),), (Fraction(1),))
MIDPOINT = (((Fraction(0), Fraction(0)), (Fraction(1, 2), Fraction(0))), (Fraction(0), Fraction(1)))
HEUN_3 = (
    ((Fraction(0),) * 3, (Fraction(1, 3), Fraction(0), Fraction(0)), (Fraction(0), Fraction(2, 3), Fraction(0))),
    (Fraction(1, 4), Fraction(0), Fraction(3, 4)),
)
FIRST_TRIES = {"euler": (EULER, 1), "midpoint": (MIDPOINT, 2), "heun": (HEUN_3, 3)}


@pytest.mark.parametrize(("method", "order"), FIRST_TRIES.values(), ids=FIRST_TRIES)
def test_known_methods_have_their_orders(method, order: int) -> None:
    assert order_of(*method, limit=4) == order


def test_weights_that_do_not_sum_to_one_have_no_order() -> None:
    assert order_of(MIDPOINT[0], (Fraction(0), Fraction(1, 2)), limit=3) == 0


def test_the_trees_are_all_there() -> None:
    """Sequence A000081 of the OEIS."""
    assert [len(trees(order)) for order in range(1, 10)] == [1, 1, 2, 4, 9, 20, 48, 115, 286]


def test_orders_of_the_methods() -> None:
    orders = {name: (m.order, m.error_order, m.dense_order) for name, m in TABLEAUS.items()}
    assert orders == {"dopri5": (5, 4, 4), "dop853": (8, 7, 7), "rk4": (4, 0, 0)}
    assert TABLEAUS[DEFAULT_SOLVER].embedded is not None, "the default controls its error"


@pytest.mark.parametrize("name", TABLEAUS)
def test_entries_are_complete(name: str) -> None:
    method = TABLEAUS[name]
    assert method.solver == name
    assert method.title
    assert method.source
    assert len(method.a) == len(method.b) == len(method.c) == method.stages
    assert {len(row) for row in method.a} == {method.stages}
    assert method.c[0] == 0
    assert float(sum(method.b)) == 1.0
    if method.error_weights is not None:
        assert sum(method.error_weights) == pytest.approx(0, abs=1e-24)
        assert any(method.error_weights)


def test_first_same_as_last() -> None:
    assert TABLEAUS["dopri5"].first_same_as_last
    assert TABLEAUS["dop853"].first_same_as_last
    assert not TABLEAUS["rk4"].first_same_as_last


@pytest.mark.parametrize("name", TABLEAUS)
def test_the_orders_are_those_that_are_claimed(name: str) -> None:
    TABLEAUS[name].check()


TABLES = ("a", "extra", "dense")


@pytest.mark.parametrize(("name", "table"), [(n, t) for n, m in TABLEAUS.items() for t in TABLES if getattr(m, t)])
def test_a_wrong_coefficient_is_found(name: str, table: str) -> None:
    method = TABLEAUS[name]
    rows = getattr(method, table)
    for i, j in ((i, j) for i, row in enumerate(rows) for j, entry in enumerate(row) if entry):
        wrong = [list(entries) for entries in rows]
        wrong[i][j] += Fraction(1, 10**12)
        with pytest.raises(ValueError, match=f"tableau '{name}': (.* has order|dense output needs)"):
            method._replace(**{table: tuple(map(tuple, wrong))}).check()


@pytest.mark.parametrize("name", TABLEAUS)
@pytest.mark.parametrize("change", [1, -1])
def test_a_wrong_claim_is_found(name: str, change: int) -> None:
    with pytest.raises(ValueError, match="has order"):
        TABLEAUS[name]._replace(order=TABLEAUS[name].order + change).check()


def test_wrong_weights_are_found() -> None:
    method = TABLEAUS["dopri5"]
    with pytest.raises(ValueError, match="embedded has order 5, not 4"):
        method._replace(embedded=method.b).check()
    with pytest.raises(ValueError, match="b has order 0"):
        method._replace(b=(Fraction(1, 2), *method.b[1:])).check()


def test_an_implicit_method_is_found() -> None:
    with pytest.raises(ValueError, match="not strictly lower triangular"):
        Tableau("implicit", "", "", 1, ((Fraction(1),),), (Fraction(1),)).check()


Vector = NDArray[np.float64]


def slopes(t: float, y: Vector) -> Vector:
    """dy/dt of the predators and prey y1' = y1 (1 - y2), y2' = y2 (y1 - 1) / (1 + t)."""
    return np.array([y[0] * (1 - y[1]), y[1] * (y[0] - 1) / (1 + t)])


def stages(method: Tableau, t: float, y: Vector, h: float) -> Vector:
    """k of all rows of ``method``, (s + e, 2)."""
    a, c = np.array(method.all_rows, dtype=float), np.array(method.all_c, dtype=float)
    k = np.zeros((len(c), 2))
    for i in range(len(c)):
        k[i] = slopes(t + c[i] * h, y + h * a[i] @ k)
    return k


def steps(method: Tableau, weights: tuple[Fraction, ...], count: int, end: float = 2.0) -> Vector:
    """y(end) from (2, 1), ``count`` steps."""
    b = np.array(weights, dtype=float)
    y, h = np.array([2.0, 1.0]), end / count
    for step in range(count):
        y = y + h * b @ stages(method, step * h, y, h)[: method.stages]
    return y


SHOWN = [
    ("dopri5", "b", 5, 40),
    ("dopri5", "embedded", 4, 40),
    ("dop853", "b", 8, 6),
    ("dop853", "embedded", 5, 12),
    ("dop853", "second", 3, 40),
    ("rk4", "b", 4, 40),
]


@pytest.mark.parametrize(("name", "weights", "order", "count"), SHOWN)
def test_the_order_shows(name: str, weights: str, order: int, count: int) -> None:
    """Never less; a little more where the first term of the error is small, which the pairs were made for."""
    method = TABLEAUS[name]
    exact = steps(TABLEAUS["dopri5"], TABLEAUS["dopri5"].b, 2000)
    counts = count * np.array([1, 2, 4])
    errors = [np.abs(steps(method, getattr(method, weights), int(n)) - exact).max() for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert order - 0.15 <= slope <= order + 0.8, errors


def within(method: Tableau, h: float, theta: float) -> Vector:
    """y(theta h) after one step of length ``h`` from (2, 1), nested as templates/engine/dense_output.h has it."""
    y = np.array([2.0, 1.0])
    k = stages(method, 0.0, y, h)
    f0 = h * np.array(method.b, dtype=float) @ k[: method.stages]
    f1 = h * k[0] - f0
    terms = [f0, f1, f0 - h * k[method.stages - 1] - f1, *(h * np.array(method.dense, dtype=float) @ k)]
    value = np.zeros(2)
    for number, term in reversed(list(enumerate(terms))):
        value = (theta if number % 2 == 0 else 1 - theta) * (term + value)
    return y + value


@pytest.mark.parametrize("theta", [0.2, 0.37, 0.8])
@pytest.mark.parametrize("name", [name for name, method in TABLEAUS.items() if method.dense_order])
def test_the_order_of_dense_output_shows(name: str, theta: float) -> None:
    """The error of one step is of one order more."""
    method, exact = TABLEAUS[name], TABLEAUS["dop853"]
    lengths = (2.0 if name == "dop853" else 0.5) / np.array([4, 8, 16])
    errors = [np.abs(within(method, h, theta) - steps(exact, exact.b, 20, theta * h)).max() for h in lengths]
    slope = np.polyfit(np.log(lengths), np.log(errors), 1)[0]
    assert method.dense_order + 0.7 <= slope <= method.dense_order + 1.9, errors
    assert within(method, 0.5, 1.0) == pytest.approx(steps(method, method.b, 1, 0.5), rel=1e-14)
