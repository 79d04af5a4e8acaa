"""Subspaces by orthogonal decompositions: what rows map to zero, and which rows of a basis are independent."""

from __future__ import annotations

import numpy as np

from lag2fmu.graph.batches import Floats

RANK = 1e-9
SHARE = 1e-9
"""A state has a share in a direction of unit length if its entry is more than this; less is rounding."""


def null_space(rows: Floats) -> Floats:
    """An orthonormal basis (n, k) of the vectors that ``rows`` (m, n) of unit length map to zero: singular vectors.

    Source: Golub, Van Loan, Matrix Computations, 4th edition, section 2.4.
    """
    _, singular, right = np.linalg.svd(rows, full_matrices=True)
    basis: Floats = right[int(np.sum(singular > RANK)) :].T
    return basis


def independent_rows(basis: Floats) -> list[int]:
    """The indices, ascending, of the k rows of ``basis`` (n, k) that are most independent; of equals the earlier one.

    Each next row is the one with the longest remainder: Q R of the transpose with column pivoting. Source: Golub, Van
    Loan, Matrix Computations, 4th edition, section 5.4.
    """
    rest, chosen = basis.copy(), []
    for _ in range(basis.shape[1]):
        size = np.linalg.norm(rest, axis=1)
        best = int(np.argmax(size > 0.999999 * size.max()))
        chosen.append(best)
        direction = rest[best] / size[best]
        rest = rest - np.outer(rest @ direction, direction)
    return sorted(chosen)


def reached(A: Floats, B: Floats) -> Floats:
    """An orthonormal basis (k, j) of the states x that dx/dt = A x + B u reaches from 0, for A (k, k) and B (k, r).

    New directions A^i B are orthogonal to those that there are, and are counted by singular values. So no high power of
    A has to be resolved. Units are balanced first. Source: P. Van Dooren, The generalized eigenstructure problem in
    linear system theory, IEEE Transactions on Automatic Control 26 (1981), section II (staircase algorithm).
    """
    from scipy.linalg import matrix_balance

    k = len(A)
    if not k:
        return np.zeros((0, 0))
    balanced, similarity = matrix_balance(A, permute=False)
    scale = np.diagonal(similarity)
    pushed = B / scale[:, None]
    length = np.linalg.norm(pushed, axis=0)
    fresh, basis = pushed[:, length > 0] / length[length > 0], np.zeros((k, 0))
    turned = balanced / max(float(np.linalg.norm(balanced, 2)), 1e-300)
    while fresh.shape[1]:
        fresh = fresh - basis @ (basis.T @ fresh)
        left, singular, _ = np.linalg.svd(fresh, full_matrices=False)
        fresh = left[:, singular > RANK]
        basis = np.concatenate([basis, fresh], axis=1)
        fresh = turned @ fresh
    found: Floats = np.linalg.qr(scale[:, None] * basis)[0]
    return found


def complement(basis: Floats) -> Floats:
    """An orthonormal basis (k, k - j) of what is orthogonal to the orthonormal ``basis`` (k, j)."""
    found: Floats = (
        np.linalg.svd(basis, full_matrices=True)[0][:, basis.shape[1] :] if basis.size else np.eye(len(basis))
    )
    return found
