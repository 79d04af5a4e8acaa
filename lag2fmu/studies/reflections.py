"""Rows brought to triangular form by Householder's reflections, one after the other; the engine does the same.

Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th edition, section 5.1.
"""

from __future__ import annotations

import numpy as np

from lag2fmu.reference.trajectory import Floats

RANK = 1e-10
"""The square of a distance: rows of unit length that are nearer to the span of those before them are redundant."""


def reduced(rows: Floats) -> tuple[Floats, Floats, list[int]]:
    """Q (n, n) and L (k, k) with [L 0] Q^T the k independent ones of ``rows`` (m, n), and their indices.

    Rows have unit length. L is lower triangular.
    """
    a, n = rows.copy(), rows.shape[1]
    Q, kept = np.eye(n), list[int]()
    for j in range(len(a)):
        k = len(kept)
        square = float(a[j, k:] @ a[j, k:])
        if k == n or square <= RANK:
            continue
        length = np.sqrt(square)
        v = np.zeros(n)
        v[k:] = a[j, k:]
        v[k] += length if a[j, k] > 0 else -length
        v /= np.sqrt(length * (length + abs(a[j, k])))  # |v|^2 = 2
        a[j:] -= np.outer(a[j:] @ v, v)
        Q -= np.outer(Q @ v, v)
        kept.append(j)
    return Q, a[np.ix_(kept, range(len(kept)))], kept
