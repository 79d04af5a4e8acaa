"""Quaternions of frames: the product of those of their rotations, which is smooth wherever the rotations are.

(cos a/2, u sin a/2) for a turn by a about u; products by Hamilton's rule. A sum of angles beyond a full turn changes
the sign, not the rotation. Source: J. B. Kuipers, Quaternions and Rotation Sequences, sections 5.3 and 5.15.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sympy as sp

from lag2fmu.description.places import AXES, WORLD
from lag2fmu.language.vocabulary import TIME
from lag2fmu.reference.composition import Composition
from lag2fmu.reference.functions import Array, Slots, compiled, unit_vector


class Quaternions:
    """The quaternions of the frames ``wanted`` as a function of rows t, q, qd, y, y_dot.

    The values are (4, *shape) each, scalar first.
    """

    def __init__(self, composition: Composition, wanted: Sequence[str], constants: Sequence[np.float64]) -> None:
        slots, s = Slots(), composition.symbols
        self._constants = constants
        self._factors = {name: self._chain(composition, slots, name) for name in wanted}
        arguments = (TIME, *s.q, *s.qd, *s.motion, *s.motion_dot, *s.parameters)
        self._local = compiled(arguments, slots.expressions)

    def __call__(self, rows: Array, frame: str) -> Array:
        """The quaternion (e0, e1, e2, e3) of ``frame``, (4, *shape)."""
        values = self._local(rows, self._constants)
        total = np.zeros((4, *rows.shape[1:]), rows.dtype)
        total[0] = 1.0
        for factor in self._factors[frame]:
            total = product(total, values[factor])
        return total

    def _chain(self, composition: Composition, slots: Slots, name: str) -> list[slice]:
        """The quaternions from the world to the frame ``name``, in turn."""
        factors: list[slice] = []
        while name != WORLD:
            frame = composition.mechanism.frame(name)
            turns = [slots.add(_of_turn(composition, axis, angle)) for axis, angle in frame.rotations]
            if frame.quaternion is not None:
                turns.append(slots.add([composition.written(x) for x in frame.quaternion]))
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


def _of_turn(
    composition: Composition, axis: str | Sequence[sp.Expr | int | float], angle: sp.Expr | int | float
) -> list[sp.Expr]:
    half = composition.written(angle) / 2
    numbers = [int(letter == axis) for letter in AXES] if isinstance(axis, str) else axis
    u = unit_vector([composition.written(x) for x in numbers])
    return [sp.cos(half), *(sp.sin(half) * x for x in u)]
