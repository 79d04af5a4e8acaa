"""Coloured seeds: groups of columns, and the Jacobian that the compiled code makes of them."""

from __future__ import annotations

import ctypes
import random
import re
from collections.abc import Collection
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from compiling import UNOPTIMISED, compiled
from stepping import _callbacks

from lag2fmu.codegen.colours import NO_COLUMN, coloured
from lag2fmu.dynamics import derive, lower
from lag2fmu.fmu.backends.native import describe
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter


def check(rows: list[Collection[int]]) -> int:
    """Every entry of the matrix stands in exactly one colour, and nothing else does; returns the number of colours."""
    groups = coloured(rows)
    shown = [(row, column) for group in groups for row, column in enumerate(group) if column != NO_COLUMN]
    assert sorted(shown) == sorted((row, column) for row, columns in enumerate(rows) for column in columns)
    return len(groups)


def test_colours_of_known_patterns() -> None:
    """A dense matrix has a colour a column, a tridiagonal one three, an arrow pointing up one beside its full row."""
    assert check([range(7)] * 5) == 7
    assert check([[c for c in (r - 1, r, r + 1) if 0 <= c < 9] for r in range(9)]) == 3
    assert check([[r] for r in range(6)]) == 1
    assert check([[0, 1, 2], [0, 1, 2], [3, 4, 5], [3, 4, 5]]) == 3
    assert check([[], []]) == 0


@pytest.mark.parametrize("seed", range(10))
def test_colours_of_random_patterns(seed: int) -> None:
    """As many as the fullest row at least, as there are columns at most."""
    generator = random.Random(seed)
    rows = [generator.sample(range(12), generator.randint(0, 4)) for _ in range(8)]
    assert max(map(len, rows)) <= check(rows) <= 12


def oscillators(n: int, coupled: bool) -> Mechanism:
    """Duffing oscillators with friction, each for itself or in a row with springs to the neighbours."""
    k, c = parameter("k", 40.0), parameter("c", 0.3)
    q = [coordinate(f"q{i}", start=0.1 * i) for i in range(n)]
    potential = sum((k * x**2 / 2 + k * x**4 / 7 for x in q), start=0)
    if coupled:
        potential += sum(k * (a - b) ** 4 for a, b in pairwise(q))
    kinetic = sum((i + 1) * x.dot**2 for i, x in enumerate(q)) / 2
    energy = Energy(kinetic, potential, c * sum(x.dot**2 for x in q) / 2)
    return Mechanism("oscillators", coordinates=q, parameters=[k, c], energy=energy)


def one_by_one(tables: str, n: int) -> str:
    """The generated tables with a colour of its own for each of the 2n states."""
    rows = "".join("{" + ", ".join([str(column)] * n) + "}," for column in range(2 * n))
    return re.sub(r"(const int COLOURS\[\]\[N_COORDINATES\] = \{).*?\};", rf"\g<1>{rows}}};", tables, flags=re.DOTALL)


class Library:
    """The functions of an FMU and, for it is compiled with everything visible, those of its runtime."""

    def __init__(self, sources: dict[str, str], guid: str, folder: Path) -> None:
        folder.mkdir()
        self.c = compiled(folder, sources, options=UNOPTIMISED["zig"])
        self.callbacks = _callbacks()
        self.c.fmi2Instantiate.restype = ctypes.c_void_p
        arguments = (b"it", 0, guid.encode(), b"", ctypes.byref(self.callbacks), 0, 0)
        self.instance = ctypes.c_void_p(self.c.fmi2Instantiate(*arguments))
        zero = ctypes.c_double(0.0)
        assert self.c.fmi2SetupExperiment(self.instance, 0, zero, zero, 0, zero) == 0
        assert self.c.fmi2EnterInitializationMode(self.instance) == 0
        assert self.c.fmi2ExitInitializationMode(self.instance) == 0

    def jacobian(self, states: np.ndarray) -> np.ndarray:
        """d(qdd)/d(q, qd), (2n, n): a row for each state."""
        made = np.full((len(states), len(states) // 2), np.nan)
        given, result = (a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (states, made))
        self.c.equations_jacobian.restype = ctypes.c_bool
        assert self.c.equations_jacobian(self.instance, ctypes.c_double(0.0), given, result)
        return made


CASES = {
    "apart": (lambda: oscillators(5, coupled=False), 2),  # place and velocity of one are those of all
    "row": (lambda: oscillators(6, coupled=True), 4),  # three for places, and velocities share a fourth
    "double_pendulum": (lambda: load("double_pendulum"), 4),
    "four_bar_linkage": (lambda: load("four_bar_linkage"), None),
}


@pytest.mark.fmu
@pytest.mark.parametrize("name", CASES)
def test_jacobian_by_colours_is_that_by_single_seeds(name: str, tmp_path: Path) -> None:
    """To the last bit; the columns of those that are apart share seeds, a dense Jacobian takes one a column."""
    make, expected = CASES[name]
    equations = derive(make())
    description, sources = describe(equations.mechanism, equations, lower(equations), "ros2")
    n = len(equations.mechanism.coordinates)
    colours = int(re.search(r"#define N_COLOURS (\d+)", sources["mechanism.h"])[1])
    assert colours == (expected if expected is not None else 2 * n)
    single = dict(sources)
    single["tables.c"] = one_by_one(sources["tables.c"], n)
    single["mechanism.h"] = re.sub(r"N_COLOURS \d+", f"N_COLOURS {2 * n}", sources["mechanism.h"])
    single["mechanism.h"] = re.sub(r"COLOURS\[\d+\]", f"COLOURS[{2 * n}]", single["mechanism.h"])
    assert single != sources or colours == 2 * n
    both = [
        Library(files, description.guid, tmp_path / label)
        for label, files in {"colours": sources, "single": single}.items()
    ]
    q = equations.mechanism.coordinates
    starts = [*(c.start for c in q), *(c.velocity for c in q)]
    generator = np.random.default_rng(3)
    for _ in range(3):
        states = np.array(starts) + generator.uniform(-0.3, 0.3, 2 * n)
        made = [library.jacobian(states) for library in both]
        assert np.all(np.isfinite(made[1]))
        assert np.abs(made[1]).max() > 0.1
        assert np.array_equal(*made)
