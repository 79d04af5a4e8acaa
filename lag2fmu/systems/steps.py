"""Communication steps of a system: of one length, or as long as the error of the coupling allows.

That error is known for nothing: what an input was taken to be at the end of a step, by the derivatives at its
beginning, less what it then hears. Where it is too large, all FMUs go back to the beginning and a shorter step is made.
Source: M. Arnold, C. Clauss, T. Schierz, Error analysis and error estimates for co-simulation in FMI for Model Exchange
and Co-Simulation v2.0, Archive of Mechanical Engineering 60 (2013), section 5.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from lag2fmu.systems.circuit import Circuit
from lag2fmu.systems.member import Member

_SAFETY, _LEAST, _MOST = 0.9, 0.2, 3.0
"""The next step is shorter than the error asks for by the first factor, and no less and no more times the last one."""
_SHORTEST = 1e-4
"""The shortest step as a part of the longest one. Where an input jumps, no step is short enough."""

Outer = Callable[[float], Mapping[str, float]]
"""A function of time (s) that gives the values of the system's inputs."""


class FixedSteps:
    """One step from each communication point to the next; with ``hold`` all inputs keep their values within it."""

    def __init__(self, members: Mapping[str, Member], circuit: Circuit, outer: Outer, *, hold: bool) -> None:
        """``outer`` gives the inputs of the system."""
        self._members, self._circuit, self._outer, self._hold = members, circuit, outer, hold

    def begin(self, t: float) -> None:
        """Bring all inputs to what they hear at ``t`` (s). Raises SimulationError where nothing agrees."""
        self._circuit.hear(self._outer(t))
        self._circuit.settle(t)

    def advance(self, t: float, end: float) -> None:
        """From ``t`` to the ``end`` (s), where all inputs are what they hear. Raises SimulationError."""
        if not self._hold:
            self._circuit.drive()
        for member in self._members.values():
            member.advance(t, end - t, last=True)
        self.begin(end)


class ControlledSteps(FixedSteps):
    """Steps whose errors of coupling are within the relative ``tolerance``."""

    def __init__(
        self, members: Mapping[str, Member], circuit: Circuit, outer: Outer, tolerance: float, longest: float
    ) -> None:
        """No step is longer than ``longest`` (s)."""
        super().__init__(members, circuit, outer, hold=False)
        self._tolerance, self._longest, self._length = tolerance, longest, longest
        self._exponent = 1.0 / (circuit.order + 1)

    def advance(self, t: float, end: float) -> None:
        """From ``t`` to the ``end`` (s) in as many steps as it takes. Raises SimulationError."""
        shortest = _SHORTEST * self._longest
        while t < end:
            parts = math.ceil((end - t) / self._length * (1 - 1e-9))
            h = (end - t) / parts
            error = self._try(t, h, shortest)
            factor = min(max(_SAFETY * error**-self._exponent if error > 0 else _MOST, _LEAST), _MOST)
            self._length = min(max(h * factor, shortest), self._longest)
            if error <= 1.0 or h <= shortest:
                t = end if parts == 1 else t + h

    def _try(self, t: float, h: float, shortest: float) -> float:
        """The error of a step, in units of the tolerance; where it is too large, all is as before the step."""
        before = self._circuit.saved()
        states = [(member, member.save()) for member in self._members.values()]
        self._circuit.drive()
        expected = self._circuit.expected(h)
        for member in self._members.values():
            member.advance(t, h)
        self.begin(t + h)
        error = self._circuit.missed(expected) / self._tolerance
        if error > 1.0 and h > shortest:
            for member, state in states:
                member.restore(state)
            self._circuit.restore(before)
        for member, state in states:
            member.forget(state)
        return error
