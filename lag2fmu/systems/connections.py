"""Connections: the user's words become an output and an input that fit, or an error that names both."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from lag2fmu.description.ports import JOINED
from lag2fmu.errors import LoadError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.systems.components import Component, Connector, LinearUnit

Components = Mapping[str, Component]

GIVES = ("output", "local")
"""The causalities that may be connected to an input; SSP 2.0 treats the local variables of FMI as outputs."""


class End(NamedTuple):
    """A connector of a component: the names of both."""

    component: str
    connector: str

    def __str__(self) -> str:
        return f"{self.component}.{self.connector}"


class Connection(NamedTuple):
    """A connection: the input ``target`` gets the output ``source`` times ``factor``.

    Each of two connected terminals shows the force on its own mechanism. These forces are opposite, so that their
    connection has the factor -1.
    """

    source: End
    target: End
    factor: float = 1.0


def connected(words: Iterable[str], components: Components) -> tuple[Connection, ...]:
    """The connections in ``words`` such as 'a.x:b.y0', where both ends are variables or both are terminals.

    The output may be on either side. Raises LoadError for ends that do not exist or do not fit.
    """
    found: dict[End, tuple[Connection, str]] = {}
    for word in words:
        for connection in _of_word(word, components):
            before = found.get(connection.target)
            if before is not None:
                raise LoadError(
                    f"--connect {word}: the input {connection.target} is connected already, by {before[1]}; "
                    "an input hears one output"
                )
            found[connection.target] = connection, word
    return tuple(connection for connection, _ in found.values())


def _of_word(word: str, components: Components) -> Iterator[Connection]:
    left, colon, right = (part.strip() for part in word.partition(":"))
    if not colon:
        raise LoadError(f"--connect {word}: expected COMPONENT.OUTPUT:COMPONENT.INPUT")
    one, other = (_end(word, text, components) for text in (left, right))
    pairs = [(one, other, 1.0)]
    if _is_terminal(one, components) and _is_terminal(other, components):
        pairs = list(_members(word, one, other, components))
    for a, b, factor in pairs:
        for end in (a, b):
            _connector(word, end, components)
        yield _directed(word, a, b, components)._replace(factor=factor)


def _end(word: str, text: str, components: Components) -> End:
    name, point, connector = text.partition(".")
    if not (point and connector):
        raise LoadError(f"--connect {word}: '{text}' is no COMPONENT.VARIABLE")
    if name not in components:
        raise LoadError(f"--connect {word}: there is no component '{name}'; {suggestion(name, components)}")
    return End(name, connector)


def _is_terminal(end: End, components: Components) -> bool:
    component = components[end.component]
    return end.connector in component.terminals and (
        end.connector not in component.connectors or len(component.terminals[end.connector].members) > 1
    )


def _members(word: str, one: End, other: End, components: Components) -> Iterator[tuple[End, End, float]]:
    """(connector, connector, factor) of the members of two terminals that belong together.

    By the rule "plug" all members have the same names, by "bus" some have, and by "sequence" their order counts.
    Places, which match by JOINED, are a bus for what hears their motion and gives forces. Source: FMI 3.0.2, section
    2.4.9.1.
    """
    a, b = (components[end.component].terminals[end.connector] for end in (one, other))
    rule = _rule(word, (one, a.rule), (other, b.rule))
    if rule == "sequence":
        pairs = list(zip(a.members, b.members, strict=False))
    else:
        pairs = [(member, member) for member in a.members if member in b.members]
    whole = len(pairs) == len(a.members) == len(b.members)
    if not pairs or (rule != "bus" and not whole):
        has = ", ".join(a.members)
        raise LoadError(f"--connect {word}: {one} has the members {has}, and {other} has {', '.join(b.members)}")
    for x, y in pairs:
        factor = -1.0 if x in a.inflows and y in b.inflows else 1.0
        yield End(one.component, a.members[x]), End(other.component, b.members[y]), factor


def _rule(word: str, *ends: tuple[End, str]) -> str:
    """The rule by which the members of both ``ends`` match. Raises LoadError if there is none."""
    rules = {"bus" if rule == JOINED else rule for _, rule in ends}
    if all(rule == JOINED for _, rule in ends):
        places = ":".join(f"{end.component}.{end.connector.removesuffix('_port')}" for end, _ in ends)
        raise LoadError(f"--connect {word}: both are places, which a joint connects: --join {places}=KIND")
    if len(rules) > 1:
        (one, rule), (other, twin) = ends
        raise LoadError(f"--connect {word}: the terminal {one} matches by '{rule}', {other} by '{twin}'")
    return rules.pop()


def _connector(word: str, end: End, components: Components) -> Connector:
    component = components[end.component]
    if end.connector not in component.connectors:
        known = [name for name, c in component.connectors.items() if c.causality in ("input", *GIVES)]
        if end.connector in component.terminals:
            raise LoadError(f"--connect {word}: {end} is a terminal; both ends have to be terminals, or none")
        raise LoadError(
            f"--connect {word}: '{component.path}' has no variable '{end.connector}'; "
            f"{suggestion(end.connector, dict.fromkeys([*known, *component.terminals]))}"
        )
    return component.connectors[end.connector]


def _directed(word: str, one: End, other: End, components: Components) -> Connection:
    a, b = (components[end.component].connectors[end.connector] for end in (one, other))
    if a.causality == "input" and b.causality in GIVES:
        one, other, a, b = other, one, b, a
    if a.causality not in GIVES or b.causality != "input":
        raise LoadError(
            f"--connect {word}: {one} is of causality {a.causality} and {other} of causality {b.causality}; "
            "connect an output with an input"
        )
    _check_fit(f"--connect {word}", (one, a), (other, b))
    return Connection(one, other)


def _check_fit(where: str, one: tuple[End, Connector], other: tuple[End, Connector]) -> None:
    """Raise LoadError unless type, sizes and dimension of both connectors agree."""
    (left, a), (right, b) = one, other
    if a.type != b.type and {a.type, b.type} != {"Real", "Float64"}:
        raise LoadError(f"{where}: {left} is of type {a.type} and {right} of type {b.type}; they must agree")
    if a.sizes != b.sizes:
        shown = [" x ".join(sizes) or "a scalar" for sizes in (a.sizes, b.sizes)]
        raise LoadError(f"{where}: {left} is {shown[0]} and {right} is {shown[1]}; the sizes must agree")
    if a.unit is not None and b.unit is not None and a.unit.dimension != b.unit.dimension:
        raise LoadError(
            f"{where}: {left} is in {_shown(a.unit)} and {right} in {_shown(b.unit)}; the dimensions must agree"
        )


def _shown(unit: LinearUnit) -> str:
    return unit.name or "no unit"
