"""All joints of a system as one problem: k equations between the places of the FMUs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.systems.components import ComponentTerminal
from lag2fmu.systems.joint_places import Places
from lag2fmu.systems.joint_shapes import JointLaw, skew
from lag2fmu.systems.joints import NUMBERS, Ends
from lag2fmu.systems.member import Member
from lag2fmu.verify.run import Floats

_REDUNDANT = 1e-7
"""Relative to the greatest eigenvalue: equations with smaller ones are redundant. Differences make 5e-10 of 0, for the
loop of Bricard; and two hinges of a door may be a thousandth of its width apart. A force is idle where it moves less
than this beside what it moved elsewhere: near a dead centre the mechanism is free as long, and loses energy when it is
caught again."""
_STIFF = 1e-6
"""Relative to the wrench that moves places most: one that moves them less moves none."""
_SMALLEST = 1e-3
"""The size (m) of a system that lies about the origin. Otherwise it is that of its places' positions, or of their radii
of gyration."""
_MEASURED = 3
"""The measurements, with a quadratic polynomial, that tell how the effects of wrenches go on while links turn."""
_SOON = 0.01
"""The part of a step in which the effect of forces is measured, so that it is that at the begin of the step."""
_CHANGE = 1e-3
"""The change of speed (m/s, rad/s) by which the effect of forces is measured: more than the solvers' errors in a step,
and too little to turn anything in it."""


@dataclass(frozen=True)
class JointState:
    """The joints at one time, by the forces (k,) of the joints and the wrenches (n,) on all places of all FMUs.

    - ``directions`` (n, k): the wrenches of unit forces; ``rates``: their derivatives.
    - ``gap`` (k,), in m and rad, and ``speed`` (k,), its rate. Where a force is the joint's own, and holds nothing, the
      gap is the joint's coordinate.
    - ``turned`` (n, n): from the axes of the places to those of the world; ``turning``: its derivative.
    """

    directions: Floats
    rates: Floats
    gap: Floats
    speed: Floats
    turned: Floats
    turning: Floats


class JointSystem:
    """The ``joints`` of the ``members``.

    - ``held`` (k,): which of the forces hold something; the others are the joints' own, with ``damping`` (k,) and
      ``stiffness`` (k,).
    - ``basis`` (k, r): forces that are independent; if joints are ``redundant``, r is less than k.
    - ``shared`` (k, k): from forces to those that do the same and are least, relative to what they move. A force that
      moves nothing in this pose, as at a dead centre, is 0 until it moves something.
    """

    def __init__(self, members: Mapping[str, Member], joints: Sequence[Ends]) -> None:
        """Look up the places. Raises LoadError for an FMU that cannot go back or takes no derivatives of inputs."""
        for member in members.values():
            _check(member)
        self._places = _places_of(members, joints)
        names = [(places.member.name, name) for places in self._places for name in places.names]
        self._ends = [[6 * names.index(end) for end in (e.joint.first, e.joint.second)] for e in joints]
        self._names, self._joints, self._laws = names, joints, [JointLaw(ends) for ends in joints]
        first = np.cumsum([0, *(6 * len(places.names) for places in self._places)]).tolist()
        self._parts = [slice(a, b) for a, b in pairwise(first)]
        self.held = np.concatenate([law.held for law in self._laws])
        own = np.zeros((len(NUMBERS), len(self.held)))
        own[:, ~self.held] = np.array([law.own for law in self._laws if law.acts]).reshape(-1, len(NUMBERS)).T
        self.damping, self.stiffness, self._rest = own
        self._lengths = np.concatenate([law.lengths for law in self._laws])
        self.redundant, self.basis, self.shared = False, np.eye(len(self.held)), np.eye(len(self.held))
        self._greatest = np.zeros(len(self.held))
        self._size, self._mobility = _SMALLEST, np.zeros((first[-1], first[-1]))
        self._measured: list[tuple[float, Floats]] = []

    @property
    def driven(self) -> int:
        """How many forces and torques on places are measured, each by a short step."""
        return sum(len(places.driven) for places in self._places)

    def state(self) -> JointState:
        """The joints at present."""
        motions = {(x.member.name, name): motion for x in self._places for name, motion in x.motions().items()}
        self._size = max(self._size, *(float(np.abs(motion.p).max()) for motion in motions.values()))
        shapes = [
            law.shape(motions[e.joint.first], motions[e.joint.second])
            for e, law in zip(self._joints, self._laws, strict=True)
        ]
        n, k = 6 * len(self._names), len(self.held)
        directions, rates, column = np.zeros((n, k)), np.zeros((n, k)), 0
        for at, shape in zip(self._ends, shapes, strict=True):
            columns = slice(column, column + len(shape.gap))
            for row, own, change in zip(at, shape.directions, shape.rates, strict=True):
                directions[row : row + 6, columns] += own
                rates[row : row + 6, columns] += change
            column = columns.stop
        gap, speed = (np.concatenate([getattr(shape, name) for shape in shapes]) for name in ("gap", "speed"))
        rotations = np.array([motions[name].R for name in self._names])
        turning = np.array([skew(motions[name].omega) for name in self._names]) @ rotations
        return JointState(directions, rates, gap, speed, _blocks(rotations), _blocks(turning))

    def open_by(self, gap: Floats, speed: Floats, h: float) -> float:
        """How far joints are open at most, with what opens in a time ``h`` (s), as a part of the system's size.

        ``gap`` (k,) and its rate ``speed`` (k,) are 0 where nothing is held.
        """
        scales = np.where(self._lengths, self._size, 1.0)
        return float((np.maximum(np.abs(gap), h * np.abs(speed)) / scales).max(initial=0.0))

    def own_forces(self, places: Floats, rates: Floats) -> Floats:
        """The forces (k,) that the joints have of their own where their gaps (k,) are ``places``, with ``rates``."""
        found: Floats = -self.damping * rates - self.stiffness * (places - self._rest)
        return found

    def worst(self, state: JointState) -> str:
        """The joint that is open most, and how far."""
        joints = np.repeat(np.arange(len(self._laws)), [len(law.held) for law in self._laws])
        row = max(np.flatnonzero(self.held), key=lambda row: max(abs(state.gap[row]), abs(state.speed[row])))
        return (
            f"the joint {self._joints[joints[row]].joint} is open by {abs(state.gap[row]):.3g}, "
            f"at {abs(state.speed[row]):.3g} a second"
        )

    def set(self, wrenches: Floats) -> None:
        """Set the ``wrenches`` (n,)."""
        for places, part in zip(self._places, self._parts, strict=True):
            places.set(wrenches[part])

    def drive(self, terms: Floats) -> None:
        """Let the wrenches in the next step go on from terms[0] (n,) by their derivatives, ``terms`` (3, n)."""
        for places, part in zip(self._places, self._parts, strict=True):
            places.drive(terms[:, part])

    def measure(self, t: float, h: float, *, anew: bool = False) -> None:
        """Measure the twists of all places by unit wrenches on them, in a step ``h`` (s) from ``t`` that is taken back.

        They are kept in the axes of the places, in which they change little while an FMU turns. ``anew``: what was
        measured before tells nothing any more. Raises SimulationError for motions that are no numbers.
        """
        self._mobility = np.zeros_like(self._mobility)
        for places, part in zip(self._places, self._parts, strict=True):
            self._mobility[part, part] = _mobility(places, t, _SOON * h)
        before = [] if anew else [known for known in self._measured if known[0] < t]
        self._measured = [*before[1 - _MEASURED :], (t, self._mobility)]
        moved = np.diag(self._mobility).reshape(-1, 2, 3).max(axis=2)
        inert = moved[:, 1] > 0
        self._size = max(self._size, float(np.sqrt(moved[inert, 0] / moved[inert, 1]).max(initial=0.0)))
        state = self.state()
        matrix = self.effect(state, state.turned, state.directions)
        if not np.isfinite(matrix).all():
            raise SimulationError(f"at t = {t:g} s the motion of a joined place is no number; {self.worst(state)}")
        effects = np.diag(matrix)
        self._greatest = np.maximum(self._greatest, effects)
        idle = self.held & (effects < _REDUNDANT * self._greatest)
        scale = 1.0 / np.sqrt(np.maximum(effects, np.finfo(float).tiny))
        acting = np.where(idle, 0.0, scale)
        symmetric = acting[:, None] * (matrix + matrix.T) / 2 * acting
        sizes, vectors = np.linalg.eigh(symmetric[np.ix_(self.held, self.held)])
        kept = sizes > _REDUNDANT * sizes[-1]
        self.redundant = not kept.all()
        own = len(self.held) - len(kept)
        self.basis = np.zeros((len(self.held), int(kept.sum()) + own))
        self.basis[self.held, : int(kept.sum())] = vectors[:, kept]
        self.basis[~self.held, int(kept.sum()) :] = np.eye(own)
        self.basis *= acting[:, None]
        self.shared = self.basis @ (self.basis / scale[:, None] ** 2).T

    def foresee(self, t: float) -> None:
        """Let what wrenches do go on until ``t`` (s) as the polynomial through the last measurements.

        It goes no further beyond the last one than that is from the one before.
        """
        times = [time for time, _ in self._measured]
        until = min(t, 2 * times[-1] - times[-2]) if len(times) > 1 else t
        weights = [math.prod((until - b) / (a - b) for b in times if b != a) for a in times]
        self._mobility = np.tensordot(weights, [known for _, known in self._measured], 1)

    def effect(self, end: JointState, turned: Floats, directions: Floats) -> Floats:
        """The change (k, k) of the speeds of the joints at the ``end``, by unit impulses at a time before.

        ``directions`` (n, k) are those of the impulses, ``turned`` (n, n) the axes of the places then. A place goes on
        turning in its own axes as the impulse lets it.
        """
        found: Floats = end.directions.T @ end.turned @ self._mobility @ turned.T @ directions
        return found


def _places_of(members: Mapping[str, Member], joints: Sequence[Ends]) -> list[Places]:
    """The joined places of each FMU; raises LoadError for one that cannot be joined."""
    terminals: dict[str, dict[str, ComponentTerminal]] = {}
    for ends in joints:
        for end, terminal in ((ends.joint.first, ends.first), (ends.joint.second, ends.second)):
            _check_driven(members[end.component], ends)
            terminals.setdefault(end.component, {})[end.connector] = terminal
    return [Places(members[name], found) for name, found in terminals.items()]


def _blocks(matrices: Floats) -> Floats:
    """A matrix (6 p, 6 p) with each of the ``matrices`` (p, 3, 3) twice on its diagonal."""
    found = np.zeros((6 * len(matrices), 6 * len(matrices)))
    for i, matrix in enumerate(matrices):
        for row in (6 * i, 6 * i + 3):
            found[row : row + 3, row : row + 3] = matrix
    return found


def _mobility(places: Places, t: float, h: float) -> Floats:
    """The twists of all ``places`` of an FMU by unit impulses on them, in the axes of the places, (6 p, 6 p).

    They are differences of the twists after a step ``h`` (s) from ``t``, under a wrench and without one.
    """
    before, state, size = _rotations(places), places.member.save(), 6 * len(places.names)
    still = np.zeros(size)

    def moved(wrenches: Floats) -> tuple[Floats, Floats]:
        places.drive(np.array([wrenches, still, still]))
        places.member.step(t, h)
        result = places.twists(), _rotations(places)
        places.member.restore(state)
        return result

    free, after = moved(still)
    units = np.eye(size)[places.driven]
    found = np.array([moved(unit)[0] - free for unit in units])
    changes = np.abs(found).max(axis=1)
    for i, change in enumerate(np.maximum(changes, _STIFF * changes.max())):
        if change > 0.0 and not _CHANGE / 100 < change < _CHANGE * 100:
            found[i] = (moved(units[i] * _CHANGE / change)[0] - free) * change / _CHANGE
    places.member.forget(state)
    mobility: Floats = after.T @ (found.T @ units / h) @ (before + after) / 2
    return mobility


def _rotations(places: Places) -> Floats:
    return _blocks(np.array([motion.R for motion in places.motions().values()]))


def _check(member: Member) -> None:
    """Raise LoadError if a component cannot go back, as it has to where others are joined."""
    if not member.repeats:
        raise LoadError(
            f"the FMU of '{member.name}' cannot save and restore its state (canGetAndSetFMUstate); joints need that "
            "steps are repeated"
        )


def _check_driven(member: Member, ends: Ends) -> None:
    """Raise LoadError if an FMU cannot be joined."""
    if not member.takes_orders:
        raise LoadError(
            f"the joint {ends.joint}: the FMU of '{member.name}' cannot take inputs that change within a step "
            "(canInterpolateInputs; of FMI 3.0 intermediate updates), which joints need"
        )


def check_closed(system: JointSystem, t: float, most: float) -> None:
    """Raise SimulationError if a joint is open at ``t`` (s) by more than ``most``, as a part of the system's size."""
    state = system.state()
    if system.open_by(state.gap * system.held, state.speed * system.held, 1.0) > most:
        raise SimulationError(
            f"at t = {t:g} s {system.worst(state)}; give start values with which the places and their speeds agree"
        )
