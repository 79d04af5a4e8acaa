"""The bonds of a network: pairs of connections that go opposite ways, a force and a motion whose product is a power."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lag2fmu.language.units import BASE_UNITS
from lag2fmu.systems.components import Connector, LinearUnit
from lag2fmu.systems.network import Network
from lag2fmu.systems.wires import Wire


def _dimension(**exponents: int) -> tuple[int, ...]:
    return tuple(exponents.get(symbol, 0) for symbol in BASE_UNITS[:-1])


_POWER, _ENERGY = _dimension(kg=1, m=2, s=-3), _dimension(kg=1, m=2, s=-2)
_FLOWS = {_dimension(m=1, s=-1), _dimension(s=-1), _dimension(A=1)}
"""Velocities, angular velocities, currents."""
_PLACES = {_dimension(m=1), _dimension()}
"""Positions and angles, whose change is a flow."""
_SHOWN = 3
"""The most connections that a sentence names."""
_MOTIONS = _FLOWS | _PLACES | {_dimension(m=1, s=-2), _dimension(s=-2)}


@dataclass(frozen=True)
class Pair:
    """An ``effort`` and a ``motion`` that comes back from where it goes.

    - ``flows``: whether the motion is a flow, such as a velocity; else a position or an angle.
    - ``scale``: the energy or power in SI units, of the product of both in the units of the inputs.
    """

    effort: Wire
    motion: Wire
    flows: bool
    scale: float


def bonds_of(network: Network) -> tuple[list[Pair], list[str]]:
    """(the bonds, a sentence for each reason why connections of two FMUs belong to none).

    A force fits a motion by units, and by a terminal that holds both where several do; a velocity is better than a
    position.
    """
    wires = [w for w in network.wires if w.source.component and not _sampled(network, w)]
    found = [pair for effort in wires for pair in _bond(network, effort, wires)]
    used = {w for pair in found for w in (pair.effort, pair.motion)}
    return found, _unpaired(network, [w for w in wires if w not in used and not _goes_along(w, found, network)])


def _bond(network: Network, effort: Wire, wires: Sequence[Wire]) -> list[Pair]:
    """The bond of an ``effort``; empty if there is none, or no one that fits best."""
    back = [pair for motion in wires if (pair := _pair(network, effort, motion)) is not None]
    together = [p for p in back if _share_a_terminal(network, p)] or back
    best = [p for p in together if p.flows] or together
    return best if len(best) == 1 else []


def _sampled(network: Network, wire: Wire) -> bool:
    return any(network.components[end.component].controller is not None for end in (wire.source, wire.target))


def _unit(network: Network, wire: Wire) -> LinearUnit | None:
    unit = _heard(network, wire).unit
    return unit if unit is not None and unit.exponents else None


def _heard(network: Network, wire: Wire) -> Connector:
    return network.components[wire.target.component].connectors[wire.target.connector]


def _pair(network: Network, effort: Wire, motion: Wire) -> Pair | None:
    """The bond of two connections; None if they are none."""
    opposite = (effort.source.component, effort.target.component) == (motion.target.component, motion.source.component)
    units = _unit(network, effort), _unit(network, motion)
    if not opposite or units[0] is None or units[1] is None or _heard(network, effort).sizes:
        return None
    dimension = units[1].dimension
    product = tuple(a + b for a, b in zip(units[0].dimension, dimension, strict=True))
    flows = product == _POWER and dimension in _FLOWS
    angle = dimension != _dimension() or units[1].exponents[-1] != 0
    if not flows and not (product == _ENERGY and dimension in _PLACES and angle):
        return None
    given = network.components[motion.source.component].connectors[motion.source.connector].unit or units[1]
    factor = motion.map.factor  # the input hears this times the output, whose product with the effort is the power
    return Pair(effort, motion, flows, units[0].factor * given.factor / factor) if factor else None


def _share_a_terminal(network: Network, pair: Pair) -> bool:
    """Whether the effort and the motion belong to one terminal at one of their ends."""
    ends = [(pair.effort.source, pair.motion.target), (pair.effort.target, pair.motion.source)]
    return any(
        {a.connector, b.connector} <= {*terminal.members.values()}
        for a, b in ends
        for terminal in network.components[a.component].terminals.values()
    )


def _goes_along(wire: Wire, found: Sequence[Pair], network: Network) -> bool:
    """Whether a connection is a position, velocity or acceleration that goes along with the motion of a bond."""
    unit = _unit(network, wire)
    return any(
        (wire.source.component, wire.target.component) == (p.motion.source.component, p.motion.target.component)
        for p in found
        if unit is not None and unit.dimension in _MOTIONS
    )


def _unpaired(network: Network, wires: Sequence[Wire]) -> list[str]:
    """Why the ``wires`` belong to no bond: a sentence for those without a unit, and one for the others."""
    without = [w for w in wires if _unit(network, w) is None]
    alone = [w for w in wires if w not in without]
    reasons = "the input has no unit", "no one motion comes back whose product with it is a power"
    return [f"the energy of {_listed(ws)}: {why}" for ws, why in zip((without, alone), reasons, strict=True) if ws]


def _listed(wires: Sequence[Wire]) -> str:
    """Up to three of the ``wires`` by name, and how many there are besides."""
    told = ", ".join(f"{w.source} to {w.target}" for w in wires[:_SHOWN])
    return told if len(wires) <= _SHOWN else f"{told} and {len(wires) - _SHOWN} more"
