"""Wires between FMUs, and the map that each makes of a value: conversions of units, and tables of whole numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.systems.components import LinearUnit
from lag2fmu.systems.connections import End


class Affine(NamedTuple):
    """The map from x to factor x + offset."""

    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, x: float) -> float:
        """The value for ``x``."""
        return self.factor * x + self.offset

    def after(self, first: Transformation) -> Transformation:
        """The map that applies ``first``, then this one."""
        if isinstance(first, ValueTable):
            return replace(first, pairs=tuple((x, self(y)) for x, y in first.pairs))
        return Affine(self.factor * first.factor, self.factor * first.offset + self.offset)


SAME = Affine()


@dataclass(frozen=True)
class ValueTable:
    """The map from the whole number ``before``(x) to its ``pairs``; ``where`` it stands. Nothing follows x smoothly."""

    where: str
    pairs: tuple[tuple[int, float], ...]
    before: Affine = SAME
    factor: float = 0.0
    offset: float = 0.0

    def __call__(self, x: float) -> float:
        """The value for ``x``. Raises SimulationError for one that is not in the table."""
        key = self.before(x)
        for known, value in self.pairs:
            if known == key:
                return value
        listed = ", ".join(str(known) for known, _ in self.pairs)
        raise SimulationError(f"{self.where}: the value is {key:g}, which its table does not map; it maps {listed}")

    def after(self, first: Transformation) -> Transformation:
        """The map that applies ``first``, then this one. Raises SimulationError if this one lacks what it gives."""
        if isinstance(first, ValueTable):
            return replace(first, pairs=tuple((x, self(y)) for x, y in first.pairs))
        b = self.before
        return replace(self, before=Affine(b.factor * first.factor, b.factor * first.offset + b.offset))


Transformation = Affine | ValueTable


def conversion(where: str, given: LinearUnit | None, wanted: LinearUnit | None) -> Affine:
    """The map from numbers in the unit ``given`` to numbers in ``wanted``; the identity where one is not known.

    Raises LoadError, which begins with ``where``, for units of different dimensions.
    """
    if given is None or wanted is None or given == wanted or not (given.exponents and wanted.exponents):
        return SAME
    if given.dimension != wanted.dimension:
        raise LoadError(f"{where}: '{given.name}' does not convert to '{wanted.name}'; the dimensions must agree")
    return Affine(given.factor / wanted.factor, (given.offset - wanted.offset) / wanted.factor)


@dataclass(frozen=True)
class Wire:
    """The ``target``, a variable of a component, is ``map`` of the ``source``.

    The source is a variable of a component too, or an input of the system, whose component is "".
    """

    source: End
    target: End
    map: Transformation
