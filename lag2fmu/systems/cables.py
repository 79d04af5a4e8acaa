"""What lies between the components of a system: cables from outputs to inputs, and the inputs that hear by them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lag2fmu.systems.member import Member
from lag2fmu.verify.channels import Channel
from lag2fmu.verify.run import Floats


@dataclass(frozen=True)
class Cable:
    """The wires from one component to another: the source's ``outputs``, and which of the target's inputs hear them.

    ``at_once``: whether one of the outputs follows inputs of its own component without delay; ``smooth``: 1 for outputs
    that change continuously, else 0.
    """

    source: Member
    outputs: Channel
    target: str
    places: Sequence[int]
    factor: Floats
    offset: Floats
    at_once: bool
    plain: bool
    smooth: Floats

    def heard(self) -> Floats:
        """What the inputs hear now, (places,)."""
        values = self.outputs.read()
        return values if self.plain else self.factor * values + self.offset


@dataclass
class ConnectedInputs:
    """The connected inputs of an FMU: their ``channel``, and their ``values`` and ``derivatives`` at present.

    ``sizes`` are their greatest magnitudes so far, ``slopes`` their changes in the last step, by its length.
    """

    channel: Channel
    names: tuple[str, ...]
    values: Floats
    derivatives: Floats
    sizes: Floats
    slopes: Floats


def order_of(source: Member) -> int:
    """The order of the derivatives by which an input goes on that hears ``source``; past values give the first one."""
    return max(source.gives_orders, 1)
