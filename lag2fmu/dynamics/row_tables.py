"""The record ``SparseRows``: the rows of all constraints for time stepping, and the tables of them in C."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import accumulate

from lag2fmu.graph.nodes import Node


@dataclass(frozen=True)
class SparseRows:
    """The K rows in this order: permanent constraints; each contact with its slips; dry frictions; latches.

    - ``places``: those of the rows among all constraints, (K,).
    - ``positions``: {row: its position}; that of a latch is measured from 0, not from what it holds.
    - ``velocities``: (K,).
    - ``entries``: those of the Jacobian as (row, coordinate, node), in order.
    - ``contacts``: the first row of each contact, and behind them the end of the last contact.
    - ``blocks``: the block to which each coordinate belongs, (n,).
    - ``neighbours``: for each row the rows that it meets, itself included, (K,).
    - ``colours``: lists of rows, one for each colour.
    - ``velocity_forces``: whether the forcing contains velocities.
    """

    places: tuple[int, ...]
    positions: dict[int, Node]
    velocities: tuple[Node, ...]
    entries: tuple[tuple[int, int, Node], ...]
    contacts: tuple[int, ...]
    blocks: tuple[int, ...]
    neighbours: tuple[tuple[int, ...], ...]
    colours: tuple[tuple[int, ...], ...]
    velocity_forces: bool

    @property
    def meetings(self) -> list[tuple[int, int]]:
        """All pairs (row, neighbour), in order."""
        return [(row, other) for row, others in enumerate(self.neighbours) for other in others]

    @property
    def tables(self) -> list[tuple[str, Sequence[int]]]:
        """(name, values) of the tables in row_tables.h."""
        counts = [0] * len(self.places)
        for row, *_ in self.entries:
            counts[row] += 1
        number = {pair: k for k, pair in enumerate(self.meetings)}
        return [
            ("PLACES", self.places),
            ("CONTACT_ROWS", self.contacts),
            ("ENTRY_STARTS", _starts(counts)),
            ("ENTRY_COLUMNS", [column for _, column, _ in self.entries]),
            ("BLOCKS", self.blocks),
            ("MEETING_STARTS", _starts(map(len, self.neighbours))),
            ("MEETING_ROWS", [other for _, other in self.meetings]),
            ("MEETING_MIRRORS", [number[other, row] for row, other in self.meetings]),
            ("COLOUR_STARTS", _starts(map(len, self.colours))),
            ("COLOUR_ROWS", [row for colour in self.colours for row in colour]),
        ]


def _starts(counts: Iterable[int]) -> tuple[int, ...]:
    return tuple(accumulate(counts, initial=0))
