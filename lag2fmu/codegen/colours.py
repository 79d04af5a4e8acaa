"""Coloured seeds: one directional derivative yields several columns of a sparse Jacobian if they share no row.

Source: A. R. Curtis, M. J. D. Powell, J. K. Reid, On the estimation of sparse Jacobian matrices, IMA Journal of Applied
Mathematics 13 (1974) 117-119; as a colouring: T. F. Coleman, J. J. More, SIAM J. Numer. Anal. 20 (1983) 187-209.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

NO_COLUMN = -1
"""What stands in a colour for a row that none of its columns has an entry in."""

Colouring = tuple[tuple[int, ...], ...]
"""For each colour (c, rows): the column of this colour that has an entry in each row, NO_COLUMN where none has."""


def coloured(rows: Sequence[Collection[int]]) -> Colouring:
    """The columns of a matrix in groups that share no row; ``rows`` has the columns with an entry in each row.

    Each column, in order, joins the first group with which it shares no row; columns without entries join none. One
    directional derivative then yields all columns of a group. Source: A. Curtis, M. Powell, J. Reid, On the estimation
    of sparse Jacobian matrices, J. Inst. Maths Applics 13 (1974), pp. 117-119.
    """
    below: dict[int, list[int]] = {column: [] for column in sorted(set().union(*rows))}
    for row, columns in enumerate(rows):
        for column in columns:
            below[column].append(row)
    groups: list[list[int]] = []
    for column, entries in below.items():
        group = next((g for g in groups if all(g[row] == NO_COLUMN for row in entries)), None)
        if group is None:
            group = [NO_COLUMN] * len(rows)
            groups.append(group)
        for row in entries:
            group[row] = column
    return tuple(tuple(group) for group in groups)
