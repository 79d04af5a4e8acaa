"""The records of time stepping: linear dampers; the rows of all constraints, and the tables of them in C."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate

from lag2fmu.graph.nodes import Node


@dataclass(frozen=True)
class ImplicitDampers:
    """The linear dampers of a mechanism, see ``implicit_dampers``.

    - ``half``: half the length of a step (s), as a symbol.
    - ``entries``: those of M + half D over the velocity graph.
    - ``drag``: {index of a coordinate: what they pull along it}, where that is not 0.
    - ``rest``: the forcing without them, (n,).
    """

    half: Node
    entries: Mapping[tuple[Node, Node], Node]
    drag: Mapping[int, Node]
    rest: tuple[Node, ...]


@dataclass(frozen=True)
class SparseRows:
    """The K rows in this order: permanent constraints; each contact with its slips; dry frictions; latches.

    - ``places``: those of the rows among all constraints, (K,).
    - ``positions``: {row: its position}; that of a latch is measured from 0, not from what it holds.
    - ``velocities``: (K,).
    - ``entries``: those of the Jacobian as (row, coordinate, node), in order.
    - ``contacts``: the first row of each contact, and behind them the end of the last contact.
    - ``blocks``: the block to which each coordinate belongs, (n,).
    - ``touched``: the blocks that each row touches, (K,).
    - ``colours``: lists of rows, one for each colour.
    - ``dampers``: those that are linear.
    - ``velocity_forces``, ``velocity_friction``: whether the other forces, or a law of friction, contain velocities.
    """

    places: tuple[int, ...]
    positions: dict[int, Node]
    velocities: tuple[Node, ...]
    entries: tuple[tuple[int, int, Node], ...]
    contacts: tuple[int, ...]
    blocks: tuple[int, ...]
    touched: tuple[tuple[int, ...], ...]
    colours: tuple[tuple[int, ...], ...]
    dampers: ImplicitDampers
    velocity_forces: bool
    velocity_friction: bool

    @property
    def touches(self) -> list[int]:
        """The blocks that the rows touch, in order."""
        return [block for blocks in self.touched for block in blocks]

    @property
    def meetings(self) -> int:
        """How many pairs of rows touch the same block, each row with itself included."""
        at: dict[int, set[int]] = {}
        for row, blocks in enumerate(self.touched):
            for block in blocks:
                at.setdefault(block, set()).add(row)
        return sum(len({row}.union(*(at[block] for block in blocks))) for row, blocks in enumerate(self.touched))

    @property
    def tables(self) -> list[tuple[str, Sequence[int]]]:
        """(name, values) of the tables in row_tables.h."""
        counts = [0] * len(self.places)
        for row, *_ in self.entries:
            counts[row] += 1
        return [
            ("PLACES", self.places),
            ("CONTACT_ROWS", self.contacts),
            ("ENTRY_STARTS", _starts(counts)),
            ("ENTRY_COLUMNS", [column for _, column, _ in self.entries]),
            ("BLOCKS", self.blocks),
            ("TOUCH_STARTS", _starts(map(len, self.touched))),
            ("TOUCHED_BLOCKS", self.touches),
            ("COLOUR_STARTS", _starts(map(len, self.colours))),
            ("COLOUR_ROWS", [row for colour in self.colours for row in colour]),
        ]


def _starts(counts: Iterable[int]) -> tuple[int, ...]:
    return tuple(accumulate(counts, initial=0))
