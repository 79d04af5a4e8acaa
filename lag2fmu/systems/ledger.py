"""The energy that the coupling makes in each bond, from what components heard within a step and what they gave.

An effort F goes from A to B, and a motion x or v comes back. Within a step B works with F~ and A with x~, both
extrapolated; at its end A gives f and B gives x. The power that enters B less the one that leaves A is the residual of
the bond. It grows within a step as s^(p + 1), where p is the order of the extrapolation.

Source: A. Rodriguez and others, Energy-leak monitoring and correction to enhance stability in the co-simulation of
mechanical systems, Multibody System Dynamics 55 (2022).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lag2fmu.systems.bonds import Pair
from lag2fmu.systems.channels import Channel
from lag2fmu.systems.circuit import Circuit, ConnectedInputs
from lag2fmu.systems.coupling import BondEnergy
from lag2fmu.systems.wires import Affine, Wire


@dataclass
class _BondSide:
    """An output of a wire and the input that hears it; ``start``, ``ahead`` and ``given`` are in units of the input.

    These are its value at the beginning of a step, what it was taken to be at the end, and what is given there.
    """

    output: Channel
    inputs: ConnectedInputs
    place: int
    map: Affine
    start: float = 0.0
    ahead: float = 0.0
    given: float = 0.0
    size: float = 0.0

    @property
    def now(self) -> float:
        """The value of the input."""
        return float(self.inputs.values[self.place])

    def open(self, h: float) -> None:
        """A step ``h`` (s) begins."""
        first, second = self.inputs.derivatives[:, self.place]
        self.start = self.now
        self.ahead = float(self.start + h * first + h**2 / 2 * second)
        self.size = max(self.size, abs(self.start))

    def close(self) -> None:
        """The step is made; the inputs do not hear of it yet."""
        self.given = self.map(float(self.output.read()[0]))


class _Account:
    """The energy of one bond."""

    def __init__(self, pair: Pair, effort: _BondSide, motion: _BondSide, order: int) -> None:
        self.pair, self.effort, self.motion, self.order = pair, effort, motion, order
        self.made = self.exchanged = 0.0
        self._pending = 0.0, 0.0

    def settled(self, h: float) -> float:
        """The energy (J) that a step ``h`` (s) has made, relative to what the bond has exchanged in one of its swings.

        All inputs have heard the end of the step.
        """
        f, x, p, scale = self.effort, self.motion, self.order, self.pair.scale
        if self.pair.flows:
            made = h * (f.ahead * x.given - f.given * x.ahead) / (p + 2)
            through, size = h * (f.start * x.start + f.given * x.given) / 2, h * f.size * x.size
        else:
            late = x.given - x.ahead
            made = late * (f.start + (f.ahead - f.start) * (p + 1) / (p + 2) - (f.given + f.now) / 2)
            made += (f.ahead - f.given) * (x.ahead - x.start) / (p + 2)
            through, size = (f.start + f.given) / 2 * (x.given - x.start), f.size * x.size
        self._pending = scale * made, abs(scale * through)
        return abs(made) / size if size > 0 else 0.0

    def accept(self) -> None:
        """The step counts."""
        self.made += self._pending[0]
        self.exchanged += self._pending[1]


class Ledger:
    """The accounts of all bonds of a ``circuit``."""

    def __init__(self, circuit: Circuit, pairs: Sequence[Pair], *, hold: bool) -> None:
        """``hold``: no input goes on by derivatives."""
        self._accounts = [
            _Account(
                pair, _side(circuit, pair.effort), _side(circuit, pair.motion), 0 if hold else _order(circuit, pair)
            )
            for pair in pairs
        ]

    def open(self, h: float) -> None:
        """A step ``h`` (s) begins; how inputs go on is known."""
        for account in self._accounts:
            account.effort.open(h)
            account.motion.open(h)

    def close(self) -> None:
        """The step is made; the inputs do not hear of it yet."""
        for account in self._accounts:
            account.effort.close()
            account.motion.close()

    def settled(self, h: float) -> float:
        """The greatest energy that the step ``h`` (s) has made in a bond, relative to the bond's largest energy."""
        return max((account.settled(h) for account in self._accounts), default=0.0)

    def accept(self) -> None:
        """The step counts."""
        for account in self._accounts:
            account.accept()

    def bonds(self) -> tuple[BondEnergy, ...]:
        """What they have come to."""
        return tuple(
            BondEnergy(_told(a.pair.effort), _told(a.pair.motion), a.made, a.exchanged) for a in self._accounts
        )


def _side(circuit: Circuit, wire: Wire) -> _BondSide:
    inputs = circuit.inputs_of(wire.target.component)
    output = circuit.members[wire.source.component].channel([wire.source.connector])
    return _BondSide(output, inputs, inputs.names.index(wire.target.connector), wire.map)


def _order(circuit: Circuit, pair: Pair) -> int:
    """The order of the derivatives by which both inputs of a bond go on.

    By FMI 3.0 nobody tells an FMU how its inputs go on, so that the derivatives of an output that follows them at once
    are right to an order less.
    """
    found = []
    for wire in (pair.effort, pair.motion):
        source, target = (circuit.members[end.component] for end in (wire.source, wire.target))
        own = circuit.inputs_of(source.name).channel
        blind = source.third and source.depends(source.channel([wire.source.connector]), own)
        found.append(max(source.gives_orders - blind, 0) if target.takes_derivatives else 0)
    return min(found)


def _told(wire: Wire) -> str:
    return f"{wire.source}:{wire.target}"
