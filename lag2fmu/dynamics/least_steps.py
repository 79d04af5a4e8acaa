"""Steps of least norm onto constraints, and how far from them a state is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RANK = 1e-12
"""Relative to the greatest one: smaller singular values count as 0."""


def row_scales(jacobian: Floats) -> Floats:
    """Factors (m,) that scale the rows of ``jacobian`` (m, n) to unit length."""
    length = np.linalg.norm(jacobian, axis=1)
    scales: Floats = 1.0 / np.where(length > 0, length, 1.0)
    return scales


def least_step(rows: Floats, residual: Floats) -> Floats:
    """The step (n,) of least norm that removes the ``residual`` (m,) to first order.

    ``rows`` (m, n) are the slopes of the residual. The step is damped by the square of the residual's size. Thus the
    convergence stays quadratic where constraints are redundant and solutions are not isolated.
    Source: N. Yamashita, M. Fukushima, On the rate of convergence of the Levenberg-Marquardt method, Computing 15,
    2001.
    """
    matrix = rows @ rows.T + min(1.0, float(np.max(np.abs(residual))) ** 2) * np.eye(len(residual))
    step: Floats = rows.T @ np.linalg.lstsq(matrix, -residual, rcond=RANK)[0]
    return step


def relative_size(residual: Floats, jacobian: Floats) -> float:
    """The greatest entry of ``residual`` (m,), relative to its change if coordinates change by their nominal values.

    The columns of ``jacobian`` (m, n) are slopes times nominal values. A NaN among the residuals gives NaN.
    """
    if residual.size == 0:
        return 0.0
    scale = np.abs(jacobian).max(axis=1)
    return float(np.max(np.abs(residual) / np.where(scale > 0, scale, 1.0)))
