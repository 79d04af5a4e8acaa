"""The energy that the coupling makes in each bond, from what components heard within a step and what they gave.

An effort F goes from A to B, and a motion x or v comes back. Within a step B works with F~ and A with x~, both
extrapolated; at its end A gives f and B gives x. The power that enters B less the one that leaves A is the residual of
the bond. The errors F~ - f and x~ - x grow within a step as s^(p + 1), where p is the order of the extrapolation.

Source: A. Rodriguez and others, Energy-leak monitoring and correction to enhance stability in the co-simulation of
mechanical systems, Multibody System Dynamics 55 (2022).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lag2fmu.systems.bonds import Pair
from lag2fmu.systems.cables import ConnectedInputs
from lag2fmu.systems.coupling import BondEnergy
from lag2fmu.systems.member import Member
from lag2fmu.systems.wires import Transformation, Wire
from lag2fmu.verify.channels import Channel


@dataclass
class _BondSide:
    """An output of a wire and the input that hears it; ``start``, ``ahead`` and ``given`` are in units of the input.

    These are its value at the beginning of a step, what it was taken to be at the end, and what is given there. Over a
    step the error is on the average ``mean`` of what it is at the end.
    """

    output: Channel
    inputs: ConnectedInputs
    place: int
    map: Transformation
    mean: float
    start: float = 0.0
    ahead: float = 0.0
    given: float = 0.0
    size: float = 0.0

    @property
    def now(self) -> float:
        """The value of the input."""
        return float(self.inputs.values[self.place])

    def open(self) -> None:
        """A step begins."""
        self.start = self.now
        self.size = max(self.size, abs(self.start))

    def close(self, h: float) -> None:
        """The step ``h`` (s) is made; the inputs do not hear of it yet."""
        first, second = self.inputs.derivatives[:, self.place]
        self.ahead = float(self.now + h * first + h**2 / 2 * second)
        self.given = self.map(float(self.output.read()[0]))


class _Account:
    """The energy of one bond."""

    def __init__(self, pair: Pair, effort: _BondSide, motion: _BondSide) -> None:
        self.pair, self.effort, self.motion = pair, effort, motion
        self.made = self.exchanged = 0.0
        self._pending = 0.0, 0.0

    def settled(self, h: float) -> float:
        """The energy (J) that a step ``h`` (s) has made, relative to what the bond has exchanged in one of its swings.

        All inputs have heard the end of the step.
        """
        f, x, scale = self.effort, self.motion, self.pair.scale
        if self.pair.flows:
            made = h * (f.mean * (f.ahead - f.given) * x.given + x.mean * (x.given - x.ahead) * f.given)
            through, size = h * (f.start * x.start + f.given * x.given) / 2, h * f.size * x.size
        else:
            late = x.given - x.ahead
            made = late * (f.start + (f.ahead - f.start) * (1 - x.mean) - (f.given + f.now) / 2)
            made += f.mean * (f.ahead - f.given) * (x.ahead - x.start)
            through, size = (f.start + f.given) / 2 * (x.given - x.start), f.size * x.size
        self._pending = scale * made, abs(scale * through)
        return abs(made) / size if size > 0 else 0.0

    def accept(self) -> None:
        """The step counts."""
        self.made += self._pending[0]
        self.exchanged += self._pending[1]


class Ledger:
    """The accounts of all bonds of a system."""

    def __init__(
        self,
        members: Mapping[str, Member],
        inputs: Mapping[str, ConnectedInputs],
        pairs: Sequence[Pair],
        *,
        hold: bool,
    ) -> None:
        """``inputs`` are the connected ones of each of the ``members``; ``hold``: none goes on by derivatives."""
        self._accounts = [
            _Account(pair, *(_side(members, inputs, wire, hold=hold) for wire in (pair.effort, pair.motion)))
            for pair in pairs
        ]

    def open(self) -> None:
        """A step begins."""
        for account in self._accounts:
            account.effort.open()
            account.motion.open()

    def close(self, h: float) -> None:
        """The step ``h`` (s) is made, with inputs that went on as they were driven; they do not hear of it yet."""
        for account in self._accounts:
            account.effort.close(h)
            account.motion.close(h)

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


def _side(members: Mapping[str, Member], inputs: Mapping[str, ConnectedInputs], wire: Wire, *, hold: bool) -> _BondSide:
    source, hearing = members[wire.source.component], inputs[wire.target.component]
    output = source.channel([wire.source.connector])
    orders = 0 if hold else members[wire.target.component].takes_orders
    mean = _mean(source, output, inputs[source.name].channel, orders) if orders else 0.5
    return _BondSide(output, hearing, hearing.names.index(wire.target.connector), wire.map, mean)


def _mean(source: Member, output: Channel, own: Channel, orders: int) -> float:
    """The average error of an input that hears ``source``, by the one at the end of a step: 1/(p + 2) for the order p.

    The input takes derivatives up to ``orders``. By FMI 3.0 nobody tells an FMU how its ``own`` inputs go on, so that
    the derivatives of an output that follows them at once are right to an order less. By the last change the error is
    x'' (s h + s^2)/2.
    """
    if not source.gives_orders:
        return 5 / 12
    blind = source.third and source.depends(output, own)
    return 1.0 / (min(max(source.gives_orders - blind, 0), orders) + 2)


def _told(wire: Wire) -> str:
    return f"{wire.source}:{wire.target}"
