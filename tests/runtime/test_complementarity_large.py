"""Hundreds of contacts at once: closed forms, the laws themselves, the solution for few contacts."""

from __future__ import annotations

import ctypes
import math

import modes
import numpy as np
import pytest
import scipy.sparse
from laws import Laws, Row, bilateral, bounded, normal, tangential
from numpy.typing import NDArray

Array = NDArray[np.float64]
IMPULSE = 9.81 * 0.01
"""Of the weight of mass 1 in a time step."""


def tower(count: int) -> tuple[Array, list[Row]]:
    """jacobian[3 * count, 3 * count] of blocks that stand on each other, and their laws; two slips each."""
    steps = np.eye(count) - np.eye(count, k=-1)
    rows = [row for k in range(count) for row in (normal(), tangential(3 * k, 0.3), tangential(3 * k, 0.3))]
    return np.kron(steps, np.eye(3)), rows


def pile(layers: int, friction: float) -> tuple[Array, list[Row]]:
    """jacobian[rows, 3 * discs] of discs of radius 1 that lie in a triangle on a floor, and their laws."""
    places = {(i, j): k for k, (i, j) in enumerate((i, j) for j in range(layers) for i in range(layers - j))}
    parts, laws = [], []
    for (i, j), disc in places.items():
        angles = {(-1, 0): 0.0, (0, -1): math.pi / 3, (1, -1): 2 * math.pi / 3}
        pairs = [(places[i + di, j + dj], angle) for (di, dj), angle in angles.items() if (i + di, j + dj) in places]
        for other, angle in pairs + ([(None, math.pi / 2)] if j == 0 else []):
            c, s = math.cos(angle), math.sin(angle)
            part = np.zeros((2, 3 * len(places)))
            part[:, 3 * disc : 3 * disc + 3] = [[c, s, 0], [-s, c, -1]]
            if other is not None:
                part[:, 3 * other : 3 * other + 3] = [[-c, -s, 0], [s, -c, -1]]
            parts.append(part)
            laws += [normal(), tangential(len(laws), friction)]
    return np.concatenate(parts), laws


def violation(delassus: Array, free: Array, rows: list[Row], forces: Array) -> float:
    """How far lambda is from the laws of contacts (friction is in its cone and takes all the power it can)."""
    w = free + delassus @ forces
    worst = 0.0
    normals = [k for k, row in enumerate(rows) if row.law == normal().law]
    for n, end in zip(normals, [*normals[1:], len(rows)], strict=True):
        load, drag, slip = forces[n], forces[n + 1 : end], w[n + 1 : end]
        excess = max(float(np.linalg.norm(drag)) - rows[n + 1].friction * load, 0.0)
        power = float(drag @ slip + rows[n + 1].friction * load * np.linalg.norm(slip))
        worst = max(worst, -load, -w[n], load * w[n], excess, abs(power))
    return worst / float(np.abs(forces).max())


def test_a_tower_bears_what_is_above(laws: Laws) -> None:
    jacobian, rows = tower(400)
    free = jacobian @ np.tile([-IMPULSE, 0, 0], 400)
    solved, forces, w = laws.solve_large(scipy.sparse.csr_matrix(jacobian @ jacobian.T), free, rows)
    assert solved
    np.testing.assert_allclose(forces[0::3], IMPULSE * np.arange(400, 0, -1), rtol=1e-10)
    assert np.abs(w).max() < 1e-10 * IMPULSE


@pytest.mark.parametrize("shove", [0.0, 0.1])
def test_a_pile_obeys_the_laws(laws: Laws, shove: float) -> None:
    jacobian, rows = pile(10, 0.4)
    motion = np.tile([0, -IMPULSE, 0], 55) + shove * np.random.default_rng(1).normal(size=165)
    delassus, free = jacobian @ jacobian.T, jacobian @ motion
    solved, forces, _ = laws.solve_large(scipy.sparse.csr_matrix(delassus), free, rows)
    assert solved
    assert len(forces) > 250
    assert violation(delassus, free, rows, forces) < 1e-11
    again = laws.solve_large(scipy.sparse.csr_matrix(delassus), free, rows)[1]
    assert np.array_equal(forces, again)
    warm = laws.solve_large(scipy.sparse.csr_matrix(delassus), free, rows, forces)
    np.testing.assert_allclose(warm[1], forces, atol=1e-12 * np.abs(forces).max())


def test_few_contacts_have_the_same_solution(laws: Laws) -> None:
    """Cones, constraints and dry friction; light friction, so that there is one solution."""
    rng = np.random.default_rng(2)
    rows = [bilateral(), bounded(0.2)]
    for n in (2, 5, 8):
        rows += [normal(), tangential(n, 0.2), tangential(n, 0.2)]
    for _ in range(50):
        jacobian = rng.normal(size=(11, 14))
        delassus, free = jacobian @ jacobian.T, jacobian @ rng.normal(size=14)
        solved, forces, w = laws.solve_large(scipy.sparse.csr_matrix(delassus), free, rows)
        assert solved
        small = laws.solve(delassus, free, rows)
        np.testing.assert_allclose(forces, small[1], atol=1e-9 * np.abs(forces).max())
        np.testing.assert_allclose(w, small[2], atol=1e-9)


def test_few_rows_have_the_same_solution(laws: Laws) -> None:
    """Two contacts, a constraint and dry friction; light friction, so that there is one solution.

    The next problems have the same operator, other free motions, and at last other laws.
    """
    rng, kinds = np.random.default_rng(3), set()
    contacts = [normal(), tangential(2, 0.2), normal(), tangential(4, 0.3), tangential(4, 0.3)]
    for _ in range(100):
        size, few = int(rng.integers(4, 8)), ctypes.create_string_buffer(16384)
        rows = [bilateral(), bounded(0.5), *contacts][:size]
        jacobian = rng.normal(size=(size, 8))
        delassus = jacobian @ jacobian.T
        forces = rng.normal(size=size) if rng.random() < 0.5 else np.zeros(size)
        for friction in (0.5, 0.5, 0.4, math.inf):
            rows[1] = bounded(friction) if friction < math.inf else bilateral()
            free = jacobian @ rng.normal(size=8)
            solved, forces, w = laws.solve_large(scipy.sparse.csr_matrix(delassus), free, rows, forces, few=few)
            assert solved
            small = laws.solve(delassus, free, rows)
            np.testing.assert_allclose(forces, small[1], atol=1e-9 * np.abs(forces).max())
            np.testing.assert_allclose(w, small[2], atol=1e-9)
            kinds.add((size, *(np.abs(w) < 1e-12)))
    assert len(kinds) > 20


def test_lone_contacts_have_the_same_solution(laws: Laws) -> None:
    """Rows that act on no others, two without friction, contacts in the plane, under friction small and large."""
    rng = np.random.default_rng(4)
    kinds = set()
    for k in range(300):
        friction = 10 ** rng.uniform(-1, 0.5)
        lone = [normal(), tangential(0, friction)], [normal()], [bounded(friction)], [bilateral()]
        rows = (*lone, [normal(), normal()], [bilateral(), normal()], [normal(), bilateral()])[k % 7]
        jacobian = rng.normal(size=(len(rows), 3))
        delassus, free = jacobian @ jacobian.T, jacobian @ rng.normal(size=3)
        wedges = k % 7 == 0 and friction * abs(delassus[0, 1]) >= delassus[0, 0]
        solved, forces, w = laws.solve_large(scipy.sparse.csr_matrix(delassus), free, rows)
        assert solved
        if wedges:
            assert violation(delassus, free, rows, forces) < 1e-9 if forces.any() else free[0] >= 0.0
            continue
        small = laws.solve(delassus, free, rows)
        np.testing.assert_allclose(forces, small[1], atol=1e-9 * np.abs(forces).max())
        np.testing.assert_allclose(w, small[2], atol=1e-9)
        kinds.add((len(rows), *(np.abs(w) < 1e-12), *np.sign(forces)))
    assert len(kinds) > 8


@pytest.mark.parametrize(
    ("slips", "contacts", "coordinates", "friction"),
    [(1, 6, 4, 0.6), (2, 3, 5, 1.5), (1, 2, 3, 0.8), (1, 1, 2, 0.8), (2, 2, 5, 1.5), (2, 1, 3, 0.8)],
)
def test_what_held_rests_if_there_is_any_way(
    laws: Laws, slips: int, contacts: int, coordinates: int, friction: float
) -> None:
    """As many rows as coordinates, or more; a linear program tells where forces without any motion exist."""
    rng, size = np.random.default_rng(12), contacts * (1 + slips)
    rows = [
        row for n in range(0, size, 1 + slips) for row in (normal(), *[tangential(n, friction, holds=True)] * slips)
    ]
    seen = []
    for _ in range(80):
        jacobian = rng.normal(size=(size, coordinates)) / np.sqrt(10 ** rng.uniform(-1, 1, size=coordinates))
        delassus, free = jacobian @ jacobian.T, jacobian @ rng.normal(size=coordinates)
        solved, forces, w = laws.solve_large(scipy.sparse.csr_matrix(delassus), free, rows)
        assert solved
        if (free[:: 1 + slips] < 0).any():  # else they part
            assert violation(delassus, free, rows, forces) < 1e-9
            rests = bool(np.abs(w).max() < 1e-9 * np.abs(forces).max())
            assert modes.ways_to_rest(delassus, free, friction, slips, outside=rests) == rests
            seen.append(rests)
    assert 2 < sum(seen) < len(seen) - 2


def test_what_has_no_solution_is_said(laws: Laws) -> None:
    """A gap between prescribed motions closes."""
    nothing = scipy.sparse.csr_matrix(([0.0], [0], [0, 1]), shape=(1, 1))
    assert not laws.solve_large(nothing, np.array([-1.0]), [normal()])[0]
    assert laws.solve_large(nothing, np.array([1.0]), [normal()])[0]
