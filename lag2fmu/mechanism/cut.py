"""A cut of a mechanism: a piece, and the joint by which it moves on what carries it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import sympy as sp

from lag2fmu.description.places import Frame, Place, Point
from lag2fmu.description.symbols import Coordinate

Axis = tuple[float, float, float]
Part = TypeVar("Part", bound=Frame | Place)


@dataclass(frozen=True)
class Cut(ABC):
    """A piece that is cut off, called by its ``root``, and the joint by which it moves on what carries it.

    - ``kind`` of the joint, ``axis``: 3 numbers in the axes of both ends.
    - ``coordinates``: those of the joint, which go with it; a single one is 1/``scale`` times the joint's angle (rad)
      or way (m) where the ``kind`` has one.
    - ``seat``: a new place on what carries it, and ``pin``: one on the piece; both coincide but for the joint's motion.
    - ``carried``: the names of the frames, or in the plane of the bodies and points, that the joint moves.
    """

    root: str
    kind: str
    axis: Axis
    coordinates: tuple[str, ...]
    scale: float
    seat: Frame | Point
    pin: Frame | Point
    carried: frozenset[str]

    @property
    def measured(self) -> str:
        """The name of the ``probe``."""
        return f"{self.root}_cut"

    @property
    def stands(self) -> Mapping[sp.Symbol, sp.Expr]:
        """What stands for the joint's coordinate and its rates in the piece; nothing if no expression does."""
        return {}

    @property
    def gaps(self) -> Sequence[sp.Expr]:
        """What is 0 as long as the joint holds: coordinates of the piece less what carries them."""
        return ()

    @property
    @abstractmethod
    def probe(self) -> Frame | Point:
        """A place of the whole whose motion at the start is that of the piece."""

    @abstractmethod
    def freed(self, part: Part) -> Part:
        """A frame, body or point of the piece, as it is when the piece is cut off."""

    @abstractmethod
    def free_coordinates(self, start: Mapping[str, float]) -> Iterator[Coordinate]:
        """The coordinates by which the piece moves freely; ``start`` has the outputs of the ``probe``."""
