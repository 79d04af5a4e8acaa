"""Tables of a description joined with the entries that its joints, contacts and ports bring."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Constraint, Damper, Definition, Load
from lag2fmu.description.places import Frame, Point
from lag2fmu.errors import MechanismError

Named = TypeVar("Named", Frame, Definition, Damper, Constraint, Output, Point, Load)


def joined(own: Iterable[Named], brought: Iterable[Named], table: str, by: str = "joint") -> tuple[Named, ...]:
    """``own`` entries of ``table``, and behind them those that joints bring, or other things, called ``by``.

    Raises MechanismError if a name stands for two different entries.
    """
    parts = list(own)
    for part in brought:
        same = [other for other in parts if other.name == part.name]
        if any(other != part for other in same):
            raise MechanismError(f"{table}.{part.name}: a {by} brings one of this name too; rename one of them")
        parts += [] if same else [part]
    return tuple(parts)
