"""Interval arithmetic: what an operation gives at points of its operands is in the interval that it returns."""

from __future__ import annotations

import ctypes
import math
import random
from collections.abc import Iterator

import numpy as np
import pytest
from compiling import compiled

from lag2fmu.codegen.c import c_table
from lag2fmu.description.tables import Table
from lag2fmu.dynamics.tables import interpolant
from lag2fmu.graph.interpolants import Interpolant
from lag2fmu.graph.operations import OPERATIONS
from lag2fmu.resources import resource_folder

POINTS, TRIALS = 20, 60
PLAIN = [row for row in OPERATIONS if row.arity and row.name not in ("passed", "lookup", "lookup_2")]
TABLES = [
    interpolant(Table("f", columns=[[0, 1, 2.5, 3], [1, -1, 4, 0]], interpolation=kind, outside=outside))
    for kind in ("linear", "cubic")
    for outside in ("hold", "extrapolate", "error")
]
MAP = interpolant(
    Table("g", columns=[[0, 1, 2, 4], [0, 1, 3, 4], np.arange(16).reshape(4, 4) % 7], interpolation="cubic")
)


class Interval(ctypes.Structure):
    """A pair of ends, as intervals.h has it."""

    _fields_ = (("low", ctypes.c_double), ("high", ctypes.c_double))


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The functions of intervals.h and interval_lookup.h with tables; about 0.5 s to compile."""
    core = resource_folder("templates") / "engine" / "base"
    names = ("intervals", "interval_lookup", "lookup")
    sources = {f"{name}.{end}": (core / f"{name}.{end}").read_text("utf-8") for name in names for end in "ch"}
    tables = "\n".join(c_table(table, number) for number, table in enumerate([*TABLES, MAP]))
    calls = "\n".join(
        f"Interval look_{n}(int order, Interval x) {{ return interval_lookup(&TABLE_{n}, order, x); }}"
        for n in range(len(TABLES))
    )
    last = f"interval_lookup_2(&TABLE_{len(TABLES)}, i, j, x, y)"
    calls += f"\nInterval map(int i, int j, Interval x, Interval y) {{ return {last}; }}\n"
    sources["looking.c"] = f'#include "interval_lookup.h"\n{tables}\n{calls}'
    found: ctypes.CDLL = compiled(tmp_path_factory.mktemp("intervals"), sources)
    return found


def call(function: object, *operands: object) -> Interval:
    function.restype = Interval  # type: ignore[attr-defined]
    return function(*operands)  # type: ignore[operator,no-any-return]


def intervals(rng: random.Random, count: int) -> Iterator[list[Interval]]:
    """Operands of all sizes and signs, points among them."""
    for _ in range(TRIALS):
        found = []
        for _ in range(count):
            middle = rng.choice([-1, 1]) * 10 ** rng.uniform(-3, 2)
            half = rng.choice([0.0, 1e-9, 0.1, 1.0, 5.0]) * rng.random()
            found.append(Interval(middle - half, middle + half))
        if count == 2 and rng.random() < 0.5:
            found[1] = Interval(*[float(rng.randint(-4, 4))] * 2)  # whole exponents
        yield found


@pytest.mark.parametrize("operation", PLAIN, ids=lambda row: row.name)
def test_values_are_in_the_interval(library: ctypes.CDLL, operation: object) -> None:
    rng, tried = random.Random(operation.name), 0  # type: ignore[attr-defined]
    for operands in intervals(rng, operation.arity):  # type: ignore[attr-defined]
        found = call(getattr(library, f"interval_{operation.name}"), *operands)  # type: ignore[attr-defined]
        assert found.low <= found.high
        for _ in range(POINTS):
            point = [rng.choice([x.low, x.high, rng.uniform(x.low, x.high)]) for x in operands]
            try:
                value = operation.value(*point)  # type: ignore[attr-defined]
            except (ValueError, ArithmeticError):
                continue
            if math.isfinite(value):
                assert found.low <= value <= found.high, (point, value, found.low, found.high)
                tried += 1
    assert tried > POINTS


@pytest.mark.parametrize("number", range(len(TABLES)))
def test_tables(library: ctypes.CDLL, number: int) -> None:
    table, rng = TABLES[number], random.Random(number)
    for _ in range(TRIALS):
        low, order = rng.uniform(-1, 4), rng.randrange(2)
        x = Interval(low, low + rng.choice([0.0, 1e-6, 0.3, 3.0]))
        places = np.array([x.low, x.high, *(rng.uniform(x.low, x.high) for _ in range(POINTS))])
        _contains(call(getattr(library, f"look_{number}"), order, x), table, [order], places)


def test_tables_of_two_arguments(library: ctypes.CDLL) -> None:
    rng = random.Random(1)
    for _ in range(TRIALS):
        x, y = (Interval(low, low + rng.choice([0.0, 0.2, 2.0])) for low in (rng.uniform(-1, 4), rng.uniform(-1, 4)))
        orders = [rng.randrange(2), rng.randrange(2)]
        places = [np.array([z.low, z.high, *(rng.uniform(z.low, z.high) for _ in range(POINTS))]) for z in (x, y)]
        _contains(call(library.map, *orders, x, y), MAP, orders, *places)


def _contains(found: Interval, table: Interpolant, orders: list[int], *places: np.ndarray) -> None:
    values = table(orders, *places)
    values = values[np.isfinite(values)]
    assert values.size == 0 or (found.low <= values.min() and values.max() <= found.high)


@pytest.mark.parametrize("name", ["sin", "cos", "tan", "exp", "sqrt", "sinh"])
def test_narrow_operands_give_narrow_results(library: ctypes.CDLL, name: str) -> None:
    """Else the search for roots would halve parts of the time without end."""
    rng = random.Random(name)
    for _ in range(TRIALS):
        x = rng.uniform(0.1, 1.4)
        found = call(getattr(library, f"interval_{name}"), Interval(x, x + 1e-9))
        assert found.high - found.low < 1e-7
