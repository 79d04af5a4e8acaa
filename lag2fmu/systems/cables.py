"""What lies between the components of a system: cables from outputs to inputs, and the inputs that hear by them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lag2fmu.systems.member import Member
from lag2fmu.systems.wires import SAME, Transformation, ValueTable
from lag2fmu.verify.channels import Channel
from lag2fmu.verify.run import Floats


@dataclass(frozen=True)
class Cable:
    """The wires from one component to another: the source's ``outputs``, and which of the target's inputs hear them.

    ``maps`` make of each output what its input hears. ``at_once``: whether one of the outputs follows inputs of its own
    component without delay; ``smooth``: 1 for what changes continuously, else 0.
    """

    source: Member
    outputs: Channel
    target: str
    places: Sequence[int]
    maps: Sequence[Transformation]
    at_once: bool
    smooth: Floats

    @cached_property
    def factor(self) -> Floats:
        """The derivatives of the ``maps``, (places,)."""
        return np.array([map_.factor for map_ in self.maps])

    @cached_property
    def _offset(self) -> Floats:
        return np.array([map_.offset for map_ in self.maps])

    @cached_property
    def _tables(self) -> dict[int, ValueTable]:
        return {row: map_ for row, map_ in enumerate(self.maps) if isinstance(map_, ValueTable)}

    @cached_property
    def _plain(self) -> bool:
        return all(map_ == SAME for map_ in self.maps)

    def heard(self) -> Floats:
        """What the inputs hear now, (places,)."""
        values = self.outputs.read()
        if self._plain:
            return values
        heard = self.factor * values + self._offset
        for row, table in self._tables.items():
            heard[row] = table(float(values[row]))
        return heard


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
