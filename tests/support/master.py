"""A small master for co-simulation through fmpy: all FMUs step side by side, their inputs go on as polynomials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from stepping import Stepping


class Wire(NamedTuple):
    """The output ``source`` of the FMU ``giver``, times ``factor``, is the input ``target`` of the FMU ``taker``."""

    giver: str
    source: str
    taker: str
    target: str
    factor: float = 1.0


def run(
    units: Mapping[str, Stepping], wires: Sequence[Wire], step: float, count: int, degree: int, watched: Wire
) -> list[float]:
    """``count`` communication steps of ``step`` (s); what the source of ``watched`` is at the beginning and after each.

    Within a step inputs go on as Taylor polynomials of ``degree`` 0 (held), 1 or 2. ``wires`` are served in turn, so
    that one whose source depends on an input at once comes after the wire to that input.
    """
    found = units[watched.giver].get([watched.source])
    for _ in range(count):
        for wire in wires:
            _serve(units, wire, degree)
        for unit in units.values():
            unit.step(step)
        found += units[watched.giver].get([watched.source])
    return found


def _serve(units: Mapping[str, Stepping], wire: Wire, degree: int) -> None:
    """Set the target of ``wire``, and its derivatives up to ``degree``, as its source is."""
    giver, taker = units[wire.giver], units[wire.taker]
    taker.set({wire.target: wire.factor * giver.get([wire.source])[0]})
    orders = range(1, degree + 1)
    if degree:
        source, target = [giver.references[wire.source]] * degree, [taker.references[wire.target]] * degree
        values = [wire.factor * x for x in giver.unit.getRealOutputDerivatives(source, orders)]
        taker.unit.setRealInputDerivatives(target, orders, values)
