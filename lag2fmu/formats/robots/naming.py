"""Names of what an import makes beside what the file names: they give way to the names of the file's author."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import chain, count

from lag2fmu.description.names import DISSIPATED_ENERGY, of_coordinate
from lag2fmu.description.places import AXES
from lag2fmu.description.reserved import GLOBAL_NAMES
from lag2fmu.formats.robots.tree import RobotJoint

Brings = Callable[[str], Iterable[str]]
"""{name: all names that are taken as soon as something is called so}."""


def _itself(name: str) -> Iterable[str]:
    return (name,)


def _nothing(name: str) -> Iterable[str]:
    return ()


class Names:
    """The names that are taken: those of variables, and TABLE.NAME of the entries of tables."""

    def __init__(self) -> None:
        self._taken = {*GLOBAL_NAMES, DISSIPATED_ENERGY}

    def reserve(self, names: Iterable[str]) -> None:
        """Take ``names`` that cannot be chosen."""
        self._taken |= set(names)

    def variable(self, wanted: str, brings: Brings = _itself) -> str:
        """The name ``wanted``, or with a number behind where something that it ``brings`` is taken; it is taken now."""
        for name in chain([wanted], (f"{wanted}_{k}" for k in count(2))):
            brought = set(brings(name))
            if not brought & self._taken:
                self._taken |= brought
                return name
        raise AssertionError  # the numbers do not end

    def entry(self, table: str, wanted: str, brings: Brings = _nothing) -> str:
        """The name ``wanted`` of an entry of a ``table``, which ``brings`` variables, or with a number behind."""
        return self.variable(wanted, lambda name: (f"{table}.{name}", *brings(name)))


def coordinates_of(joint: RobotJoint, name: str) -> tuple[str, ...]:
    """The names of the coordinates of a ``joint`` that is called ``name``."""
    if joint.kind == "fixed" or joint.mimic is not None:
        return ()
    if joint.kind == "planar":
        return (f"{name}_x", f"{name}_y", f"{name}_angle")
    place = tuple(f"{name}_{axis}" for axis in AXES) if joint.kind == "floating" else ()
    return (*place, *(f"{name}_e{k}" for k in range(4))) if joint.kind in ("spherical", "floating") else (name,)


def variables_of(joint: RobotJoint, name: str) -> tuple[str, ...]:
    """All names of variables that a ``joint`` called ``name`` brings: its coordinates and what follows from them."""
    own = coordinates_of(joint, name)
    return (*own, *(follower for q in own for follower in of_coordinate(q)))
