"""How fast the coordinates of a motion swing: what their errors and the differences of two runs may be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lag2fmu.reference.equations import Equations
from lag2fmu.reference.state import Floats

POINTS = 20
"""Points of the motion at which the pace of each coordinate is measured."""


def velocity_units(scales: Floats, rates: Floats) -> Floats:
    """The units of the distance of two runs in their velocities, (n,), in SI units.

    A coordinate that is moved by its scale gets velocities of scale times rate, the greatest of the ``rates`` (m, n),
    and at least the scale of the velocity; ``scales`` (s,) are those of all states. With smaller units of velocities a
    fast vibration would look like a growing one.
    """
    n = rates.shape[1]
    found: Floats = np.maximum(scales[n : 2 * n], scales[:n] * rates.max(axis=0))
    return found


def swing_rates(
    equations: Equations, times: Floats, z: Floats, inputs: Mapping[str, ArrayLike], scales: Floats
) -> Floats:
    """The rates sqrt(|d qdd/dq|), in 1/s, at which each coordinate that is moved by little swings, (m, n).

    They are those along z (m, s) at the ``times`` (m,), in s, with ``inputs`` {name: (m,)}; they are 0 without
    accelerations. ``scales`` (s,) are those of all states.
    """
    n, changes = equations.n, []
    q, qd = z[:, :n], z[:, n : 2 * n]
    for i, change in enumerate(1e-6 * scales[:n]):
        sides = []
        for sign in (1, -1):
            moved = q.copy()
            moved[:, i] += sign * change
            sides.append(equations.rates(equations.energies.state(times, moved, qd, inputs))[0][i])
        changes.append(np.nan_to_num(np.abs(sides[0] - sides[1]), posinf=0.0) / (2 * change))
    found: Floats = np.sqrt(np.reshape(changes, (n, len(times)))).T
    return found


def paths_of(turns: Sequence[tuple[float, Floats]], times: Floats) -> Floats:
    """How far velocities have gone to and fro until each of the ``times`` (m,), in s: (m, n), in SI units.

    ``turns`` are the times at which steps end, with the changes of the velocities (n,) in each.
    """
    at, changes = zip(*turns, strict=True)
    gone = np.cumsum(changes, axis=0)
    paths: Floats = np.array([np.interp(times, at, path) for path in gone.T]).reshape(-1, len(times)).T
    return paths


def some_of(rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """POINTS of the ``rows`` (k,), or all if there are fewer."""
    chosen: NDArray[np.intp] = rows[np.unique(np.linspace(0, len(rows) - 1, POINTS).astype(int))]
    return chosen
