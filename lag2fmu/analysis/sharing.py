"""How redundant drives share the forces that a motion needs: by the least norm, within limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.analysis.evaluation import operating_inputs
from lag2fmu.analysis.subspaces import null_space
from lag2fmu.description import names
from lag2fmu.dynamics.derivation import derive
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError, LoadError
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.graph.batches import Floats, matrix
from lag2fmu.language.expressions import TIME
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.record import Mechanism

_MET = 1e-9
"""What is left of a force, as part of the greatest one, that counts as met."""


def shared_forces(
    model: Mechanism | str | Path,
    run: Mapping[str, Any],
    *,
    drives: Sequence[str],
    limits: Mapping[str, tuple[float, float]] | None = None,
) -> dict[str, Floats]:
    """The forces {Q_x: (m,)} of ``drives`` on coordinates x that together do the work of the F_x in ``run``.

    ``run`` {name: (m,)} is a run of ``inverse(model)``, SI units: time, all coordinates, and F_x of what is prescribed.
    Constraints carry forces from one coordinate to another one. Where there are more drives than the motion needs, the
    sum of squares of their forces is least; ``limits`` {coordinate: (least, greatest)} are met. Each sample is a
    quadratic program of least distance.

    Raises LoadError for names that are unknown and limits that leave no room, DerivationError for a sample at which the
    drives cannot do it. Source: C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, SIAM 1995, chapter 23.
    """
    mechanism = as_mechanism(model)
    coordinates = [q.name for q in mechanism.coordinates]
    chosen = [_place(x, coordinates, f"a coordinate of '{mechanism.name}'") for x in drives]
    for name in ("time", *coordinates):
        _place(name, [*run], "a column of the run")
    low, high = _limits(drives, limits or {})
    time = np.asarray(run["time"], dtype=float)
    forces = np.array([np.asarray(run.get(names.drive(x), 0.0 * time), dtype=float) for x in coordinates])
    equations, found = derive(mechanism), np.empty((len(time), len(drives)))
    for i, t in enumerate(time.tolist()):
        free = _free_motions(equations, {TIME.name: t, **{x: float(run[x][i]) for x in coordinates}})
        least = _least(free[chosen].T, free.T @ forces[:, i], low, high)
        if least is None:
            raise DerivationError(
                f"mechanism '{mechanism.name}' at time {t:g} s: {', '.join(drives)} cannot do what the motion needs; "
                "give more drives, wider limits, or a slower motion"
            )
        found[i] = least
    return dict(zip(map(names.generalized_force, drives), found.T, strict=True))


def _place(name: str, known: Sequence[str], what: str) -> int:
    if name not in known:
        raise LoadError(f"'{name}' is not {what}; {suggestion(name, known)}")
    return known.index(name)


def _limits(drives: Sequence[str], limits: Mapping[str, tuple[float, float]]) -> tuple[Floats, Floats]:
    for name, (least, greatest) in limits.items():
        _place(name, drives, "one of the drives")
        if not least < greatest:
            raise LoadError(f"the limits of '{name}', {least:g} to {greatest:g}, leave no room")
    pairs = np.array([limits.get(x, (-np.inf, np.inf)) for x in drives], dtype=float).reshape(len(drives), 2)
    return pairs[:, 0], pairs[:, 1]


def _free_motions(equations: EquationsOfMotion, moved: Mapping[str, float]) -> Floats:
    """An orthonormal basis (n, r) of the velocities that the constraints leave free."""
    n = len(equations.forcing)
    pairs = zip(equations.mechanism.constraints, equations.constraints.jacobian, strict=True)
    rows = [row for c, row in pairs if not c.massless]
    G = matrix(equations.graph, rows, {**operating_inputs(equations), **moved}, n)
    length = np.linalg.norm(G, axis=1, keepdims=True)
    return null_space(G / np.where(length > 0, length, 1.0)) if rows else np.eye(n)


def _least(A: Floats, b: Floats, low: Floats, high: Floats) -> Floats | None:
    """The x (d,) of least norm with A x = b (r,) between ``low`` and ``high`` (d,); None if there is none."""
    from scipy.optimize import nnls

    x = np.asarray(np.linalg.lstsq(A, b, rcond=None)[0])
    if np.abs(A @ x - b).max(initial=0.0) > _MET * np.abs(b).max(initial=0.0):
        return None
    if ((low <= x) & (x <= high)).all():
        return x
    length = np.linalg.norm(A, axis=1, keepdims=True)
    Z = null_space(A / np.where(length > 0, length, 1.0))
    G, h = np.concatenate([Z, -Z]), np.concatenate([low - x, x - high])
    G, h = G[np.isfinite(h)], h[np.isfinite(h)]
    size = np.abs(h).max()
    dual = np.concatenate([G.T, h[None] / size])
    aim = np.eye(len(dual))[-1]
    left = dual @ nnls(dual, aim)[0] - aim
    if abs(left[-1]) <= _MET:
        return None
    return np.asarray(x - size * Z @ left[:-1] / left[-1])
