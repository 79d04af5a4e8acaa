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

    - ``contacts``: the modes of contacts, (u,). A contact is open, slides (without friction, or in space), sticks, or
      slides forward or backward.
    - ``frictions``: the modes of dry frictions, (f,).
    - ``held``: which latches hold, (l,).
    - ``offsets``: the positions that latches hold, (l,), in SI units.
    - ``sides``: +1 or -1 for each kink.
    - ``directions``: {contact that slides in space: unit vector of its slip at the start of a step}.
    - ``steadied``: {contact that slides in space and is slow: speed (m/s)}. Its friction keeps the direction as long as
      the slip is slower than this.
    """

    contacts: tuple[Mode, ...]
    frictions: tuple[Mode, ...]
    held: tuple[bool, ...]
    sides: tuple[int, ...]
    directions: Mapping[int, tuple[float, ...]] = field(default_factory=dict, compare=False)
    offsets: tuple[float, ...] = field(default=(), compare=False)
    steadied: Mapping[int, float] = field(default_factory=dict, compare=False)


def closed_contacts(modes: Modes) -> list[int]:
    """The contacts that are not open."""
    return [i for i, mode in enumerate(modes.contacts) if mode is not Mode.OPEN]


@dataclass(frozen=True)
class Event:
    """What happened at ``time`` (s) to ``element``: its ``kind``, and the ``impulse`` (N.s or N.m.s) of an impact.

    ``height`` is how high an impact rebounds, and ``lift`` how high the highest contact rises that the impact opens;
    both are in units of the nominal size of the gap. ``flight`` is how long (s) the rebound lasts. Kinds: impact,
    closes, opens, sticks, slides, holds, releases, switches, painleve, poisson, plastic, shares (an impact with others
    that may balance its impulse).
    """

    time: float
    element: str
    kind: str
    impulse: float = 0.0
    height: float = np.inf
    lift: float = np.inf
    flight: float = 0.0


Due = frozenset[tuple[str, int]]
"""Event functions that came to zero, (kind, index): side, condition, gap, force, cone, slip, friction, hold."""


@dataclass
class Memory:
    """What a run remembers: counts and last impulses (N.s) of the impacts of contacts, (u,) each, and all events.

    ``turns`` are the times (s) at which kinks changed their sides.
    """

    impacts: list[int]
    impulses: Floats
    events: list[Event] = field(default_factory=list)
    turns: list[float] = field(default_factory=list)

    def log(self, time: float, element: str, kind: str, impulse: float = 0.0) -> None:
        """Add an event at ``time`` (s)."""
        self.events.append(Event(float(time), element, kind, impulse))
