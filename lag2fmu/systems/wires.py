"""Wires between FMUs, and the affine map that each makes of a value: conversions of units among them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from lag2fmu.errors import LoadError
from lag2fmu.systems.components import LinearUnit
from lag2fmu.systems.connections import End


class Affine(NamedTuple):
    """The map from x to factor x + offset."""

    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, x: float) -> float:
        """The value for ``x``."""
        return self.factor * x + self.offset

    def after(self, first: Affine) -> Affine:
        """The map that applies ``first``, then this one."""
        return Affine(self.factor * first.factor, self.factor * first.offset + self.offset)


SAME = Affine()


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
    map: Affine
