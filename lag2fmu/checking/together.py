"""A trial of several variables in one call: each is what it is when it is read or set alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from lag2fmu.checking.binding import bits
from lag2fmu.checking.description import Variable
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.session import Model, Session

_MOST = 40
"""Variables in one call."""
_MOVED = 1.01
"""The factor by which values are changed."""


def together(model: Model) -> Iterator[Finding]:
    """Several floating point numbers, read or set by one call, are what they are one by one.

    Source: FMI 2.0.5 specification, section 2.1.7; FMI 3.0.2 specification, section 2.2.6 (getting and setting values).
    """
    numbers = [v for v in model.description.variables if v.readable and v.type in model.floats]
    groups = [[v for v in numbers if v.type == type_][:_MOST] for type_ in sorted(model.floats)]
    for group in (group for group in groups if len(group) > 1):
        given = [v for v in group if v.causality in ("parameter", "input")]
        for order in (given, given[::-1]):
            yield from _set(model, order)
        with model.session() as session:
            session.start().steps(2)
            for order in (group, group[::-1]):
                yield from _compared(session, order, "read", session.numbers(order))


def _set(model: Model, group: Sequence[Variable]) -> Iterator[Finding]:
    """Parameters and inputs are set one by one, and by one call in another instance."""
    with model.session() as alone:
        alone.enter()
        values = [[_MOVED * x for x in alone.get(v)] for v in group]
        taken = [v for v, moved in zip(group, values, strict=True) if alone.set(v, moved)]
        expected = [x for v in taken for x in alone.get(v)]
    with model.session() as session:
        if len(taken) > 1 and session.enter().set_together(taken, expected):
            yield from _compared(session, taken, "set", expected, alone=True)


def _compared(
    session: Session, group: Sequence[Variable], verb: str, expected: Sequence[Any], *, alone: bool = False
) -> Iterator[Finding]:
    """A finding if the values of a ``group``, read by one call or ``alone``, are not the ``expected`` ones."""
    found = session.numbers(group) if alone else session.get_together(group)
    if bits(found) != bits(expected):
        names = ", ".join(f"'{v.name}'" for v in group[:3]) + (" ..." if len(group) > 3 else "")
        problem = f"{names} differ if they are {verb} by one call"
        yield Finding("together", session.model.kind, problem, "go through all value references of a call")
