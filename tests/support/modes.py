"""All combinations of modes of contacts tried one by one: slow, simple, and nothing of the C runtime."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mode:
    """Of some rows: lambda[row] = factor * lambda[other] + constant where ``ties`` has the row, else w[row] = 0.

    ``bounds``: (factors of lambda, factors of w, constant) of sums that are not negative.
    """

    rows: tuple[int, ...]
    ties: dict[int, tuple[float, int, float]]
    bounds: tuple[tuple[dict[int, float], dict[int, float], float], ...]


def bilateral(k: int) -> list[Mode]:
    return [Mode((k,), {}, ())]


def normal(k: int) -> list[Mode]:
    return [Mode((k,), {k: (0.0, k, 0.0)}, (({}, {k: 1.0}, 0.0),)), Mode((k,), {}, (({k: 1.0}, {}, 0.0),))]


def planar(n: int, t: int, friction: float, holding: float) -> list[Mode]:
    """A contact in the plane at rest."""
    stays = tuple(({n: holding, t: sign}, {}, 0.0) for sign in (1.0, -1.0))
    modes = [Mode((n, t), {n: (0.0, n, 0.0), t: (0.0, n, 0.0)}, (({}, {n: 1.0}, 0.0),)), Mode((n, t), {}, stays)]
    for way in (1.0, -1.0):
        modes.append(Mode((n, t), {t: (-way * friction, n, 0.0)}, (({n: 1.0}, {}, 0.0), ({}, {t: way}, 0.0))))
    return modes


def sliding(n: int, t: int, friction: float, way: float) -> list[Mode]:
    """A contact in the plane that slides."""
    tie = {t: (-way * friction, n, 0.0)}
    opened = {n: (0.0, n, 0.0), t: (0.0, n, 0.0)}
    return [Mode((n, t), opened, (({}, {n: 1.0}, 0.0),)), Mode((n, t), tie, (({n: 1.0}, {}, 0.0),))]


def bounded(k: int, force: float, holding: float) -> list[Mode]:
    stays = tuple(({k: sign}, {}, holding) for sign in (1.0, -1.0))
    slips = [Mode((k,), {k: (0.0, k, -way * force)}, (({}, {k: way}, 0.0),)) for way in (1.0, -1.0)]
    return [Mode((k,), {}, stays), *slips]


def _equations(modes: Sequence[Mode], delassus: Array, free: Array) -> tuple[Array, Array]:
    matrix, right = np.array(delassus), -np.array(free)
    for mode in modes:
        for row, (factor, other, constant) in mode.ties.items():
            matrix[:, row, :] = 0.0
            matrix[:, row, row] = 1.0
            matrix[:, row, other] -= factor
            right[:, row] = constant
    return matrix, right


def solutions(elements: Sequence[Sequence[Mode]], delassus: Array, free: Array) -> Iterator[tuple[Array, Array]]:
    """lambda[count, rows] of each combination and the least of what must not be negative [count]."""
    for modes in itertools.product(*elements):
        matrix, right = _equations(modes, delassus, free)
        forces = np.linalg.solve(matrix, right[..., None])[..., 0]
        motions = free + np.einsum("bij,bj->bi", delassus, forces)
        least = np.full(len(free), np.inf)
        for bound in itertools.chain.from_iterable(mode.bounds for mode in modes):
            value = np.full(len(free), bound[2])
            value += sum(factor * forces[:, row] for row, factor in bound[0].items())
            value += sum(factor * motions[:, row] for row, factor in bound[1].items())
            least = np.minimum(least, value)
        yield forces, least


def ways_to_rest(delassus: Array, free: Array, friction: float, slips: int, outside: bool) -> bool:
    """Are there forces of contacts (normal, slips) without any motion? Round cones are pyramids out- or inside."""
    angles = np.pi * np.arange(64) / 32
    sides = np.array([[1.0], [-1.0]]) if slips == 1 else np.column_stack([np.cos(angles), np.sin(angles)])
    sides *= 1.0 if outside or slips == 1 else 1.0 / math.cos(math.pi / 64)
    contacts = len(free) // (1 + slips)
    limits = np.kron(np.eye(contacts), np.column_stack([np.full(len(sides), -friction), sides]))
    bounds = ([(0, None)] + [(None, None)] * slips) * contacts
    return bool(linprog(np.zeros(len(free)), limits, np.zeros(len(limits)), delassus, -free, bounds).status == 0)
