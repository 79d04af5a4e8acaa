"""Typical sizes of the coordinates whose nominal value nobody gave; solvers measure errors relative to them.

Coordinates of one dimension share a size, because each of them may move as far as the others. The size is at most 1 in
the coordinate's unit, so that it can make a tolerance stricter and never looser. It is the first of the following that
exists, rounded up to a power of ten:

- Half the range between min and max.
- If the linear motion about the start is stable: how far this motion goes. It is the sum of the amplitudes of its modes
  about the place of rest K x = f; forces at several times move this place. Constraints that move with time carry the
  coordinates, too: the fastest of these velocities until the stop time. An angle has at least ``SMALL_ANGLE``, a length
  at least ``SMALL_PART`` of the greatest length among the parameters. Otherwise a pendulum that starts almost at rest
  would be solved for digits that nobody can see.
- Else the motion may grow. The size is the greatest of the start values, of the distances that the start velocities
  cover until the stop time of the experiment, and of the lengths among the parameters. Angles keep 1 rad.

Source: L. F. Shampine, M. W. Reichelt, The MATLAB ODE suite, SIAM J. Sci. Comput. 18 (1997), section 2, on thresholds
below which a solution is of no interest; L. Meirovitch, Fundamentals of Vibrations, section 4.8, for K x = f.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from lag2fmu.description import names
from lag2fmu.description.symbols import Coordinate
from lag2fmu.dynamics.parts import Constraints, Entries, Variables
from lag2fmu.dynamics.samples import mass_matrices
from lag2fmu.dynamics.starts import start_values
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.batches import Floats, evaluate, matrix
from lag2fmu.graph.graph import Graph, Node
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.mechanism.record import Mechanism

SMALL_ANGLE, SMALL_PART = 1e-4, 1e-6
"""The least nominal value of an angle (rad), and that of a length as a part of the greatest one."""

_LARGE = 0.1
"""In units of the coordinate: a greater start needs no estimate, because its size, rounded up, is 1."""

_TIMES, _STABLE = 9, 1e-9
"""The times of the experiment at which forces are looked at; and, relative to the greatest one, what counts as 0 of
squared frequencies, and of singular values of constraints."""
_LENGTH, _ANGLE = parse_unit("m").exponents, parse_unit("rad").exponents


class _Size(NamedTuple):
    """A typical size in SI units, and a text that says what it follows from."""

    value: float
    source: str


def with_nominals(
    mechanism: Mechanism,
    graph: Graph,
    v: Variables,
    entries: Entries,
    forcing: Sequence[Node],
    constraints: Constraints,
) -> Mechanism:
    """``mechanism`` with nominal values (SI units) of the coordinates for which none is given, see the module.

    ``entries`` and ``forcing`` (n,) are both sides of the equations on ``graph``, which stays as it is. Source: L.
    Meirovitch, Fundamentals of Vibrations, section 4.8.
    """
    reach: Floats | None = None
    coordinates = list(mechanism.coordinates)
    for kind, members in _by_unit(coordinates).items():
        group = [mechanism.coordinates[i] for i in members]
        if all(q.nominal_from == "given" for q in group) or any(_large(q) for q in group):
            continue
        if reach is None:
            reach = _reach(mechanism, graph, v, entries, forcing, constraints)
        size = _size(mechanism, kind, group, reach[members])
        if size is not None:
            for i in members:
                coordinates[i] = _sized(coordinates[i], size)
    if coordinates == list(mechanism.coordinates):
        return mechanism
    return mechanism.starting_at(coordinates)


def _by_unit(coordinates: Iterable[Coordinate]) -> dict[object, list[int]]:
    """{exponents of a unit: the indices of the coordinates that have it}; without a unit the key is None."""
    groups: dict[object, list[int]] = {}
    for i, q in enumerate(coordinates):
        groups.setdefault(None if q.unit is None else q.unit.exponents, []).append(i)
    return groups


def _large(q: Coordinate) -> bool:
    unit = 1.0 if q.unit is None else q.unit.difference_to_si(1.0)
    given = q.nominal if q.nominal_from == "given" else 0.0
    return q.minimum is q.maximum is None and max(abs(q.start), given) > _LARGE * unit


def _sized(q: Coordinate, size: _Size) -> Coordinate:
    """The coordinate with its size as nominal value, if none is given and the size is below 1 in its unit."""
    value = float(f"1e{math.ceil(math.log10(size.value) - 1e-9)}")
    return q if q.nominal_from == "given" or value >= q.nominal else replace(q, nominal=value, nominal_from=size.source)


def _size(mechanism: Mechanism, kind: object, group: Sequence[Coordinate], reach: Floats) -> _Size | None:
    """The size that the coordinates of a ``group`` share, None for 1.

    ``reach`` (k,) is how far the linear motion takes them in SI units, nan if it is not stable.
    """
    widest = max(map(_half_range, group))
    if widest > 0:
        return _Size(widest, "half of its range")
    length = max(_lengths(mechanism), default=0.0) if kind == _LENGTH else 0.0
    given = [q.nominal for q in group if q.nominal_from == "given"]
    start = max(abs(q.start) for q in group)
    if np.all(np.isfinite(reach)) and reach.max() > 0:
        least = SMALL_ANGLE if kind == _ANGLE else SMALL_PART * length
        return _Size(max([float(reach.max()), least, *given]), "the linear motion about its start")
    if kind == _ANGLE:
        return None
    drift = max(abs(q.velocity) for q in group) * mechanism.experiment.stop_time
    found = max([start, drift, length, *given])
    return _Size(found, "the lengths among the parameters" if found == length else "its start") if found else None


def _half_range(q: Coordinate) -> float:
    """Half of the range of ``q``, in SI units; 0 if it has none."""
    return 0.0 if q.minimum is None or q.maximum is None else (q.maximum - q.minimum) / 2


def _lengths(mechanism: Mechanism) -> Iterator[float]:
    for p in mechanism.parameters:
        if p.value is not None and p.unit is not None and p.unit.exponents == _LENGTH:
            yield abs(p.value)


def _reach(
    mechanism: Mechanism,
    graph: Graph,
    v: Variables,
    entries: Entries,
    forcing: Sequence[Node],
    constraints: Constraints,
) -> Floats:
    """How far the linear motion, begun at rest at the start, takes each coordinate from 0, (n,), in SI units.

    The motion is that of M (n, n) and K = -dforcing/dq in the directions that the constraints leave free. The
    directions are an orthonormal basis N of the null space of G. All entries are nan if the motion is not stable.
    """
    n, values = len(v.q), start_values(mechanism) | {names.velocity(q.name): 0.0 for q in mechanism.coordinates}
    work = graph.copy()
    seeds = {q: work.symbol(f"rate {i}") for i, q in enumerate(v.q)}
    directions = {f"rate {i}": row for i, row in enumerate(np.eye(n))}
    stiffness = -evaluate(work, forward(work, forcing, seeds), {**values, **directions})
    (mass,) = mass_matrices(graph, entries, v.qd, [values])
    jacobian = matrix(graph, constraints.jacobian, values, n)
    times = np.linspace(0.0, mechanism.experiment.stop_time, _TIMES)
    forces = evaluate(graph, forcing, {**values, "t": times})
    drives = evaluate(graph, constraints.velocities, {**values, "t": times})
    unknown = np.full(n, np.nan)
    if not all(np.isfinite(x).all() for x in (stiffness, mass, jacobian, forces, drives)):
        return unknown
    free = _free(jacobian)
    K, M = free.T @ (stiffness + stiffness.T) @ free / 2, free.T @ mass @ free
    try:
        inverse = np.linalg.inv(np.linalg.cholesky(M))
    except np.linalg.LinAlgError:  # M is singular
        return unknown
    squares, modes = np.linalg.eigh(inverse @ K @ inverse.T)
    modes = inverse.T @ modes  # K s = omega^2 M s
    if not len(squares) or squares[0] <= _STABLE * squares[-1]:
        return unknown
    start, velocity = np.array([(q.start, q.velocity) for q in mechanism.coordinates]).T
    moved = free @ np.linalg.solve(K, free.T @ forces)
    displaced, pushed = modes.T @ free.T @ mass @ -moved[:, 0], modes.T @ free.T @ mass @ velocity / np.sqrt(squares)
    swing = np.abs(free @ modes) @ np.hypot(displaced, pushed) + np.abs(moved - moved[:, :1]).max(axis=1)
    length = _lengths_of_rows(jacobian)
    driven = np.abs(np.linalg.pinv(jacobian / length, rcond=_STABLE) @ (drives / length)).max(axis=1) * times[-1]
    found: Floats = np.maximum(np.abs(start), np.abs(start + moved[:, 0]) + swing) + driven
    return found


def _lengths_of_rows(jacobian: Floats) -> Floats:
    """The lengths (m, 1) of the rows of ``jacobian`` (m, n), 1 for a row of zeros."""
    length: Floats = np.linalg.norm(jacobian, axis=1, keepdims=True)
    return np.where(length > 0, length, 1.0)


def _free(jacobian: Floats) -> Floats:
    """An orthonormal basis (n, k) of the motions that ``jacobian`` (m, n) leaves free"""
    _, singular, right = np.linalg.svd(jacobian / _lengths_of_rows(jacobian), full_matrices=True)
    basis: Floats = right[int(np.sum(singular > _STABLE)) :].T
    return basis
