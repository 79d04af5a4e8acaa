"""Subspaces by orthogonal decompositions: what rows map to zero, and which rows of a basis are independent."""

from __future__ import annotations

import numpy as np

from lag2fmu.graph.batches import Floats

RANK = 1e-9


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
