"""What the coupling of a system did in a run: its steps, its errors, and the energy that it made in each bond."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from lag2fmu.reference.trajectory import Trajectory

Coupling = Literal["jacobi", "gauss-seidel", "iterated"]
"""How components make a step: side by side, one after the other, or again until no input misses what it hears."""


@dataclass(frozen=True)
class BondEnergy:
    """An ``effort`` that goes one way and a ``motion`` that comes back, whose product is a power.

    - ``made``: the energy (J) that the coupling put into the system, negative where it took some out. It would be 0 if
      both components had heard each other at all times.
    - ``exchanged``: the energy (J) that went through the bond in either direction, for comparison.
    """

    effort: str
    motion: str
    made: float
    exchanged: float


@dataclass(frozen=True)
class ClosedJoints:
    """How the ideal joints of a system were closed at the ends of steps.

    - ``gap``: how far one was open at most, in m or rad.
    - ``astray``: how far places went within a step at most by what its forces miss, as a part of the system's
      size.
    - ``median``, ``most``: how often a step was run.
    """

    gap: float
    astray: float
    median: float
    most: int


@dataclass(frozen=True)
class CouplingReport:
    """The facts of a run.

    - ``steps``, ``repeated``: communication steps that were made, and those that were made anew, shorter.
    - ``jumps``: steps of the shortest length whose error was too large all the same, because an input jumps there.
    - ``shortest``, ``longest``: lengths (s) of steps.
    - ``error``: the greatest error of an input at the end of a step, relative to the largest value that it has had;
      None where no input changes within steps.
    - ``unjudged``: what could not be judged, a sentence each.
    - ``joints``: how ideal joints were closed, None where there are none.
    """

    steps: int
    repeated: int
    jumps: int
    shortest: float
    longest: float
    error: float | None
    bonds: tuple[BondEnergy, ...]
    unjudged: tuple[str, ...]
    joints: ClosedJoints | None = None


@dataclass(frozen=True, eq=False)
class SystemRun(Trajectory):
    """The trajectory of a system, with the facts of its ``coupling``."""

    coupling: CouplingReport
