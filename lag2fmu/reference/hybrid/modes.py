"""What a hybrid mechanism is doing between two events, and the record of an event."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from lag2fmu.reference.state import Floats


class Mode(IntEnum):
    """The mode of a contact or of dry friction, numbered as the FMU shows it."""

    OPEN = 1
    STICKS = 2
    SLIDES = 3
    FORWARD = 4
    BACKWARD = 5


SENSE = {Mode.FORWARD: 1.0, Mode.BACKWARD: -1.0}
"""The sign of the relative velocity along a line."""


@dataclass(frozen=True)
class Modes:
    """What is frozen between events.

    ``contacts`` (u,): open; closed they slide (without friction, or in space), or stick, or slide forward or backward.
    ``frictions`` (f,), ``held`` (l,): which latches hold, and the positions that they hold, ``offsets`` (l,); ``sides``
    of the kinks, +1 or -1.
    ``directions``: contact that slides in space -> unit vector of its slip at the start of a step.
    """

    contacts: tuple[Mode, ...]
    frictions: tuple[Mode, ...]
    held: tuple[bool, ...]
    sides: tuple[int, ...]
    directions: Mapping[int, tuple[float, ...]] = field(default_factory=dict, compare=False)
    offsets: tuple[float, ...] = field(default=(), compare=False)


def closed_contacts(modes: Modes) -> list[int]:
    """The contacts that are not open."""
    return [i for i, mode in enumerate(modes.contacts) if mode is not Mode.OPEN]


@dataclass(frozen=True)
class Event:
    """What happened at ``time`` (s) to ``element``: its ``kind``, and the ``impulse`` (N.s or N.m.s) of an impact.

    ``height``: how high an impact rebounds, in units of what nominal values make of the gap; ``lift``: likewise, how
    high the highest contact rises that the impact opens.
    Kinds: impact, closes, opens, sticks, slides, holds, releases, switches, painleve, poisson, plastic.
    """

    time: float
    element: str
    kind: str
    impulse: float = 0.0
    height: float = np.inf
    lift: float = np.inf


Due = frozenset[tuple[str, int]]
"""Event functions that came to zero, (kind, index): side, condition, gap, force, cone, slip, friction, hold."""


@dataclass
class Memory:
    """What a run remembers of impacts: counts and last impulses (u,), and the log of events."""

    impacts: list[int]
    impulses: Floats
    events: list[Event] = field(default_factory=list)

    def log(self, time: float, element: str, kind: str, impulse: float = 0.0) -> None:
        """Add an event at ``time`` (s)."""
        self.events.append(Event(float(time), element, kind, impulse))
