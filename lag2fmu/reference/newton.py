"""Newton's method onto constraints, for one state or for many at once, with steps of least norm.

Source: N. Yamashita, M. Fukushima, Computing Suppl. 15 (2001), pp. 239-249.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lag2fmu.reference.state import Floats

TIGHT = 1e-12
"""The relative residual with which equations are met; iterations go on to a thousandth of it, which is rounding."""
_ITERATIONS, _HALVINGS = 60, 12
"""The most steps, and the most halvings of a step along which the residual has to fall."""


def newton(function: Callable[[Floats], tuple[Floats, Floats]], x: Floats, free: np.ndarray, nominal: Floats) -> Floats:
    """x (n,) moved in its ``free`` entries until the residuals vanish, or fall no further.

    ``function`` maps x to residuals (m,) and their Jacobian (m, n); ``nominal`` values (n,) measure the steps. Source:
    N. Yamashita, M. Fukushima, Computing Suppl. 15 (2001), pp. 239-249.
    """
    residual, jacobian = function(x)
    for _ in range(_ITERATIONS):
        met = relative(residual, jacobian, x / nominal) <= 1e-3 * TIGHT
        if met or not free.any() or not np.isfinite(jacobian).all():
            break
        step = np.zeros_like(x)
        # with redundant constraints solutions are not isolated; damping by the square of the residual keeps the
        # convergence quadratic (N. Yamashita, M. Fukushima, Computing 15, 2001)
        length = np.linalg.norm(jacobian[:, free], axis=1)
        unit = 1.0 / np.where(length > 0, length, 1.0)
        rows, r = unit[:, None] * jacobian[:, free], unit * residual
        damped = rows @ rows.T + min(1.0, float(np.max(np.abs(r))) ** 2) * np.eye(len(r))
        step[free] = rows.T @ np.linalg.lstsq(damped, -r, rcond=1e-12)[0]
        for halving in range(_HALVINGS):
            trial = x + 0.5**halving * step * nominal
            found = function(trial)
            if np.linalg.norm(unit * found[0]) < np.linalg.norm(r):  # the norm that falls along a damped step
                break
        else:
            break
        x, (residual, jacobian) = trial, found
    return x


@np.errstate(all="ignore")  # rows that come to values that are not finite are not met
def newton_together(
    function: Callable[[Floats], tuple[Floats, Floats]], x: Floats, nominal: Floats, mobility: Floats | None = None
) -> tuple[Floats, NDArray[np.bool_]]:
    """x (b, n) moved by the full steps of ``newton``, each row as long as its residuals fall; which rows meet TIGHT.

    ``function`` maps x to residuals (b, m) and their Jacobians (b, m, n). Steps are of least norm in units of the
    ``nominal`` values (n,), or in the metric whose inverse is ``mobility`` (b, n, n), in SI units.
    """
    x = x.copy()
    ease = np.eye(x.shape[1])[None] if mobility is None else mobility / np.outer(nominal, nominal)
    ease = np.broadcast_to(ease, (len(x), *ease.shape[1:]))
    residual, jacobian = function(x)
    goes = np.isfinite(jacobian).all(axis=(1, 2))
    for _ in range(_ITERATIONS):
        goes = goes & (relative(residual, jacobian, x / nominal) > 1e-3 * TIGHT)
        if not goes.any():
            break
        moved = jacobian[goes] @ ease[goes]
        length = np.sqrt(np.abs((jacobian[goes] * moved).sum(axis=2)))
        unit = 1.0 / np.where(length > 0, length, 1.0)
        rows, r, moved = unit[..., None] * jacobian[goes], unit * residual[goes], unit[..., None] * moved
        damping = np.minimum(1.0, np.abs(r).max(axis=1) ** 2)
        damped = rows @ moved.swapaxes(1, 2) + damping[:, None, None] * np.eye(r.shape[1])
        trial = x.copy()
        trial[goes] -= (r[:, None] @ np.linalg.pinv(damped, rcond=1e-12, hermitian=True) @ moved)[:, 0] * nominal
        found = function(trial)
        goes[goes] = np.linalg.norm(unit * found[0][goes], axis=1) < np.linalg.norm(r, axis=1)
        x = np.where(goes[:, None], trial, x)
        residual = np.where(goes[:, None], found[0], residual)
        jacobian = np.where(goes[:, None, None], found[1], jacobian)
    return x, relative(residual, jacobian, x / nominal) <= TIGHT


def relative(residual: Floats, jacobian: Floats, x: Floats) -> Floats:
    """The greatest of residuals (*batch, m), relative to its change with the unknowns ``x`` (*batch, n).

    Each of them changes by its nominal value, or by its own size where that is greater: rounding grows with it.
    ``x`` and ``jacobian`` (*batch, m, n) are in units of the nominal values.
    """
    size = (np.abs(jacobian) * np.maximum(1.0, np.abs(x))[..., None, :]).max(axis=-1)
    greatest: Floats = np.max(np.abs(residual) / np.where(size > 0, size, 1.0), axis=-1, initial=0.0)
    return greatest
