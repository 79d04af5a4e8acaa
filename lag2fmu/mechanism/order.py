"""The order of definitions and of dependent parameters: each stands after those that it uses."""

from __future__ import annotations

from collections.abc import Iterable
from graphlib import CycleError, TopologicalSorter
from typing import TypeVar

from lag2fmu.description.parts import Definition
from lag2fmu.description.symbols import Parameter
from lag2fmu.errors import MechanismError
from lag2fmu.language.parts_of import free_names

Part = TypeVar("Part", Definition, Parameter)


def in_order(parts: Iterable[Part], table: str) -> list[Part]:
    """``parts`` (definitions, dependent parameters), each after those that it uses.

    Raises MechanismError for a circle.
    """
    by_name = {part.name: part for part in parts}
    uses = {name: sorted(free_names([part.expression]) & by_name.keys()) for name, part in by_name.items()}
    try:
        return [by_name[name] for name in TopologicalSorter(uses).static_order()]
    except CycleError as error:
        chain: list[str] = error.args[1]
        shown = chain if len(chain) <= 8 else [*chain[:4], "...", *chain[-3:]]
        raise MechanismError(
            f"{table}.{chain[0]}: is defined by itself: {' <- '.join(shown)}; break the circle"
        ) from None
