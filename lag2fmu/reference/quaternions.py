"""Quaternions of frames: products of the quaternions of their rotations, smooth wherever the rotations are.

A turn by a about u has (cos a/2, u sin a/2). Products follow Hamilton's rule. Angles that grow by a full turn change
the sign of the quaternion, which is the same rotation. Source: J. B. Kuipers, Quaternions and Rotation Sequences,
sections 5.3 and 5.15.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import sympy as sp

from lag2fmu.description.places import AXES, WORLD, Frame
from lag2fmu.reference.functions import Array, Slots, compiled, unit_vector


class Quaternions:
    """The quaternions of the frames ``wanted``, (4, *shape), scalar first, as functions of rows t, q, qd, y, y_dot.

    Source: J. B. Kuipers, Quaternions and Rotation Sequences, sections 5.3 and 5.15.
    """

    def __init__(
        self,
        frames: Iterable[Frame],
        wanted: Iterable[str],
        slots: Slots,
        arguments: Sequence[sp.Symbol],
        constants: Sequence[np.float64],
    ) -> None:
        """``arguments``: the symbols of rows, and behind them those of the ``constants``."""
        self._constants, known = constants, {frame.name: frame for frame in frames}
        self._factors = {name: _chain(known, slots, name) for name in wanted}
        self._local = compiled(arguments, slots.expressions)

    def __call__(self, rows: Array, frame: str) -> Array:
        """The quaternion (e0, e1, e2, e3) of ``frame``, (4, *shape)."""
        values = self._local(rows, self._constants)
        total = np.zeros((4, *rows.shape[1:]), rows.dtype)
        total[0] = 1.0
        for factor in self._factors[frame]:
            total = product(total, values[factor])
        return total


def _chain(frames: Mapping[str, Frame], slots: Slots, name: str) -> list[slice]:
    """The quaternions from the world to the frame ``name``, in turn."""
    factors: list[slice] = []
    while name != WORLD:
        frame = frames[name]
        turns = [slots.add(_of_turn(slots, axis, angle)) for axis, angle in frame.rotations]
        if frame.quaternion is not None:
            turns.append(slots.add([slots.written(x) for x in frame.quaternion]))
        factors, name = [*turns, *factors], str(frame.parent)
    return factors


def product(a: Array, b: Array) -> Array:
    """Hamilton's product of the quaternions ``a`` and ``b``, scalar first, (4, *shape) each: Kuipers, section 5.3."""
    return np.stack(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
            a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
        ]
    )


def _of_turn(slots: Slots, axis: str | Sequence[sp.Expr | int | float], angle: sp.Expr | int | float) -> list[sp.Expr]:
    half = slots.written(angle) / 2
    numbers = [int(letter == axis) for letter in AXES] if isinstance(axis, str) else axis
    u = unit_vector([slots.written(x) for x in numbers])
    return [sp.cos(half), *(sp.sin(half) * x for x in u)]
