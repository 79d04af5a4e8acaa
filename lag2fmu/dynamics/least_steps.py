"""Steps of least norm onto constraints, and how far from them a state is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RANK = 1e-12
"""Singular values below this part of the greatest one count as zero."""


def row_scales(jacobian: Floats) -> Floats:
    """Factors (m,) that make the rows of unit length."""
    length = np.linalg.norm(jacobian, axis=1)
    scales: Floats = 1.0 / np.where(length > 0, length, 1.0)
    return scales


def least_step(rows: Floats, residual: Floats) -> Floats:
    """The step (n,) of least norm that takes the ``residual`` (m,) away to first order, damped by its size squared.

    ``rows`` (m, n) are the slopes of the residual.
    The damping keeps the convergence quadratic where constraints are redundant, so that solutions are not isolated.
    Source: N. Yamashita, M. Fukushima, On the rate of convergence of the Levenberg-Marquardt method, Computing 15,
    2001.
    """
    matrix = rows @ rows.T + min(1.0, float(np.max(np.abs(residual))) ** 2) * np.eye(len(residual))
    step: Floats = rows.T @ np.linalg.lstsq(matrix, -residual, rcond=RANK)[0]
    return step


def relative_size(residual: Floats, jacobian: Floats) -> float:
    """The greatest of ``residual`` (m,) in units of its change with a coordinate by its nominal value; NaN stays NaN.

    ``jacobian`` (m, n) has columns times nominal values.
    """
    if residual.size == 0:
        return 0.0
    scale = np.abs(jacobian).max(axis=1)
    return float(np.max(np.abs(residual) / np.where(scale > 0, scale, 1.0)))
