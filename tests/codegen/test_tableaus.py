"""Runge-Kutta methods: derived orders, wrong coefficients, and the orders that show."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from lag2fmu.codegen.tableaus import DEFAULT_SOLVER, METHODS, Tableau, order_of

EULER = (((Fraction(0),),), (Fraction(1),))
MIDPOINT = (((Fraction(0), Fraction(0)), (Fraction(1, 2), Fraction(0))), (Fraction(0), Fraction(1)))
HEUN_3 = (
    ((Fraction(0),) * 3, (Fraction(1, 3), Fraction(0), Fraction(0)), (Fraction(0), Fraction(2, 3), Fraction(0))),
    (Fraction(1, 4), Fraction(0), Fraction(3, 4)),
)
FIRST_TRIES = {"euler": (EULER, 1), "midpoint": (MIDPOINT, 2), "heun": (HEUN_3, 3)}


@pytest.mark.parametrize(("method", "order"), FIRST_TRIES.values(), ids=FIRST_TRIES)
def test_known_methods_have_their_orders(method, order: int) -> None:
    assert order_of(*method) == order


def test_weights_that_do_not_sum_to_one_have_no_order() -> None:
    assert order_of(MIDPOINT[0], (Fraction(0), Fraction(1, 2))) == 0


def test_orders_of_the_methods() -> None:
    assert {name: (m.order, m.error_order) for name, m in METHODS.items()} == {"dopri5": (5, 4), "rk4": (4, 0)}
    assert METHODS[DEFAULT_SOLVER].embedded is not None, "the default controls its error"


@pytest.mark.parametrize("name", METHODS)
def test_entries_are_complete(name: str) -> None:
    method = METHODS[name]
    assert method.solver == name
    assert method.title
    assert method.source
    assert len(method.a) == len(method.b) == len(method.c) == method.stages
    assert {len(row) for row in method.a} == {method.stages}
    assert method.c[0] == 0
    assert sum(method.b) == 1
    if method.error_weights is not None:
        assert sum(method.error_weights) == 0
        assert any(method.error_weights)


def test_first_same_as_last() -> None:
    assert METHODS["dopri5"].first_same_as_last
    assert not METHODS["rk4"].first_same_as_last


def positions() -> list[tuple[str, int, int]]:
    """(method, row, column) of every coefficient that is not zero."""
    return [(name, i, j) for name, m in METHODS.items() for i, row in enumerate(m.a) for j, x in enumerate(row) if x]


@pytest.mark.parametrize(("name", "row", "column"), positions())
def test_a_wrong_coefficient_cannot_be_built(name: str, row: int, column: int) -> None:
    method = METHODS[name]
    wrong = [list(entries) for entries in method.a]
    wrong[row][column] += Fraction(1, 10**9)
    with pytest.raises(ValueError, match=f"tableau '{name}': .* has order"):
        replace(method, a=tuple(map(tuple, wrong)))


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("change", [1, -1])
def test_a_wrong_claim_cannot_be_built(name: str, change: int) -> None:
    with pytest.raises(ValueError, match="has order"):
        replace(METHODS[name], order=METHODS[name].order + change)


def test_wrong_weights_cannot_be_built() -> None:
    method = METHODS["dopri5"]
    with pytest.raises(ValueError, match="embedded has order 5, not 4"):
        replace(method, embedded=method.b)
    with pytest.raises(ValueError, match="b has order 0"):
        replace(method, b=(Fraction(1, 2), *method.b[1:]))


def test_an_implicit_method_cannot_be_built() -> None:
    with pytest.raises(ValueError, match="not strictly lower triangular"):
        Tableau("implicit", "", "", 1, ((Fraction(1),),), (Fraction(1),))


def steps(method: Tableau, weights: tuple[Fraction, ...], count: int) -> NDArray[np.float64]:
    """y(2) of the predators and prey y1' = y1 (1 - y2), y2' = y2 (y1 - 1) / (1 + t) from (2, 1), ``count`` steps."""
    a, b = np.array(method.a, dtype=float), np.array(weights, dtype=float)
    c = np.array(method.c, dtype=float)
    y, h = np.array([2.0, 1.0]), 2.0 / count
    for step in range(count):
        k = np.zeros((method.stages, 2))
        for i in range(method.stages):
            x = y + h * a[i] @ k
            k[i] = x[0] * (1 - x[1]), x[1] * (x[0] - 1) / (1 + (step + c[i]) * h)
        y = y + h * b @ k
    return y


@pytest.mark.parametrize(("name", "weights"), [("dopri5", "b"), ("dopri5", "embedded"), ("rk4", "b")])
def test_the_order_shows(name: str, weights: str) -> None:
    """Never less; a little more where the first term of the error is small, which the pair was made for."""
    method = METHODS[name]
    exact = steps(METHODS["dopri5"], METHODS["dopri5"].b, 2000)
    counts = np.array([40, 80, 160])
    errors = [np.abs(steps(method, getattr(method, weights), int(n)) - exact).max() for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    order = method.order if weights == "b" else method.error_order
    assert order - 0.1 <= slope <= order + 0.4
