"""Forces that appear where nonholonomic constraints are eliminated before energies are formed.

Kane's equations hold for velocities v = A(t, q) q' + b in which rolling contacts are eliminated. Lagrange's equations
hold only if A is the Jacobian of a position. Otherwise forces without power have to be added. The velocity of a mass m
has

    D_i = m v . (d/dt dv/dq'_i - dv/dq_i).

An angular velocity w has I w . (d/dt dw/dq'_i - dw/dq_i) - (I (u x w) + w x I w) . dw/dq'_i, in the axes in which the
tensor I is given, which turn with u.
Source: Neimark, Fufaev, Dynamics of Nonholonomic Systems, chapter III (equations of Chaplygin and Voronets).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.core.function import AppliedUndef
from sympy.physics.mechanics import ReferenceFrame, RigidBody, dynamicsymbols

Floats = NDArray[np.float64]

_T = dynamicsymbols._t
_STEP, _NOTHING = 1e-5, 1e-6
"""The step of the differences that tell whether D is 0, and the size below which it is 0; terms are of order 1."""


class Moving(NamedTuple):
    """A velocity (3,) whose square, weighted by the matrix ``inertia`` (3, 3), is 2 T.

    For an angular velocity, ``turning`` (3,) is that of its axes; None stands for the velocity of a point.
    """

    velocity: sp.Matrix
    inertia: sp.Matrix
    turning: sp.Matrix | None = None


def moving(body: Any, frame: ReferenceFrame, put: Mapping[sp.Expr, sp.Expr]) -> tuple[Moving, ...]:
    """The velocities of a ``body``, where ``put`` {speed: expression} replaces its speeds."""
    put = dict(put)
    center = body.masscenter if isinstance(body, RigidBody) else body.point
    found = [Moving(center.vel(frame).to_matrix(frame).xreplace(put), body.mass * sp.eye(3))]
    tensor = body.central_inertia if isinstance(body, RigidBody) else None
    if tensor:
        axes = tensor.args[0][1].args[0][1]  # a wheel may have no axes of its own
        turn, own = (f.ang_vel_in(frame).to_matrix(axes).xreplace(put) for f in (body.frame, axes))
        found.append(Moving(turn, tensor.to_matrix(axes), own))
    return tuple(found)


def gyroscopic_forces(bodies: Sequence[Sequence[Moving]], q: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """D (n,), 0 for velocities that are derivatives of positions; numbers tell first whether they are.

    Source: Neimark, Fufaev, Dynamics of Nonholonomic Systems, chapter III.
    """
    total = [sp.S.Zero for _ in q]
    for part in (part for body in bodies for part in body):
        if _is_eliminated(part, q):
            for i, x in enumerate(q):
                total[i] += _force(part, x)
    return tuple(total)


def _force(part: Moving, x: sp.Expr) -> sp.Expr:
    """D of one velocity along the coordinate ``x``."""
    v, momentum = part.velocity, part.inertia * part.velocity
    along = v.diff(x.diff(_T))
    force = momentum.dot(along.diff(_T) - v.diff(x))
    if part.turning is None:
        return force
    return force - (part.inertia * part.turning.cross(v) + v.cross(momentum)).dot(along)


def _is_eliminated(part: Moving, q: Sequence[sp.Expr]) -> bool:
    """Whether D of a velocity is different from 0 at a random state, by differences."""
    n, rng = len(q), np.random.default_rng(0)
    velocity, inertia, turning = _numerical(part, q, rng)
    place, rate = rng.uniform(-0.6, 0.6, n), rng.uniform(-1, 1, n)

    def along(place: Floats) -> Floats:
        return np.array([velocity(place, unit) - velocity(place, 0 * unit) for unit in np.eye(n)])

    changing = (along(place + _STEP * rate) - along(place - _STEP * rate)) / (2 * _STEP)
    steps = _STEP * np.eye(n)
    slopes = np.array([velocity(place + e, rate) - velocity(place - e, rate) for e in steps]) / (2 * _STEP)
    v, matrix, own = velocity(place, rate), inertia(place, rate).reshape(3, 3), turning(place, rate)
    force = (changing - slopes) @ matrix @ v
    if part.turning is not None:
        force -= along(place) @ (matrix @ np.cross(own, v) + np.cross(v, matrix @ v))
    return bool(np.abs(force).max() > _NOTHING * max(1.0, float(np.abs(matrix).max())))


def _numerical(
    part: Moving, q: Sequence[sp.Expr], rng: np.random.Generator
) -> list[Callable[[Floats, Floats], Floats]]:
    """Velocity, inertia and turning of ``part`` as functions of q and q' (n,), all else being random numbers."""
    matrices = [part.velocity, part.inertia, part.velocity * 0 if part.turning is None else part.turning]
    places, rates = sp.symbols(f"_q:{len(q)}"), sp.symbols(f"_v:{len(q)}")
    put = dict(zip([x.diff(_T) for x in q], rates, strict=True))
    matrices = [m.xreplace(put).xreplace(dict(zip(q, places, strict=True))) for m in matrices]
    free = {s for m in matrices for s in m.free_symbols | m.atoms(sp.Derivative, AppliedUndef)} - {*places, *rates}
    numbers = {item: sp.Float(rng.uniform(0.5, 1.5)) for item in sorted(free, key=str)}
    functions = [sp.lambdify([places, rates], list(m.xreplace(numbers)), "numpy") for m in matrices]
    return [lambda place, rate, f=f: np.array(f(place, rate), float) for f in functions]  # type: ignore[misc]
