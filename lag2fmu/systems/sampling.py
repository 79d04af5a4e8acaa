"""Sample times: communication steps end at each of them, and what is due runs there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from lag2fmu.systems.circuit import Circuit
from lag2fmu.systems.member import Member
from lag2fmu.systems.wires import Wire

_NEAR = 1e-9
"""Relative to the distance of two recorded points: times that are nearer to each other differ by rounding alone."""


class Sampling:
    """The ``members`` that sample, each behind those that it hears."""

    def __init__(self, members: Mapping[str, Member], wires: Sequence[Wire]) -> None:
        """Where functions hear each other in a circle, the one that was listed first is first, with outputs as before.

        As in a block diagram, what is due at one time runs along the connections.
        """
        heard = {name: {w.source.component for w in wires if w.target.component == name} for name in members}
        self._heard = heard
        left, self._members = [name for name, m in members.items() if m.ticks], list[Member]()
        while left:
            name = next((n for n in left if not heard[n] & ({*left} - {n})), left[0])
            left.remove(name)
            self._members.append(members[name])

    def initially(self, t: float, circuit: Circuit) -> None:
        """In initialization mode at ``t`` (s): run what is due and does not hear an FMU whose clocks tick only later.

        Raises SimulationError.
        """
        late = set[str]()
        for member in self._members:
            if self._heard[member.name] & late or not member.samples:
                late.add(member.name)
            else:
                self._run(member, t, circuit)

    def at(self, t: float, circuit: Circuit, near: float = 0.0) -> None:
        """Run what is due at ``t`` or within ``near`` of it (s); all hear what is new. Raises SimulationError."""
        for member in self._members:
            if member.due <= t + near:
                self._run(member, t, circuit)

    def _run(self, member: Member, t: float, circuit: Circuit) -> None:
        member.sample(t)
        circuit.settle(t, {member.name})

    def ends(self, t: float, end: float) -> Iterator[tuple[float, float, float]]:
        """(begin, end, tolerance of times) of the steps, in s, from ``t`` to the ``end`` that stop at sample times."""
        near = _NEAR * (end - t)
        while t < end:
            due = min((member.due for member in self._members), default=end)
            stop = due if due < end - near else end
            yield t, stop, near
            t = stop
