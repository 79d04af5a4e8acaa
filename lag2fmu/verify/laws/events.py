"""Laws at events, which a run shows from both sides: impacts, and what begins to slip."""

from __future__ import annotations

from collections.abc import Iterator
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.verify.laws.along import Along
from lag2fmu.verify.laws.event_sides import EventSides
from lag2fmu.verify.laws.points import STICKS, Rubbing, rubbing
from lag2fmu.verify.laws.residual import Accuracy, Floats, Residual, worst

SHORT = 2.0
"""In steps of a run that steps over impacts: it may end rebounds that are slower than what gravity makes in them."""
SLIP_LEFT = 20.0
"""In tolerances of the fastest motion: what may be left of a slip in space where it ends, and its direction is lost."""
LOW = 10.0
"""In tolerances of the size of a gap: the height of rebounds up to which a run may end them."""


def at_events(a: Along, accuracy: Accuracy) -> Iterator[Residual]:
    """The worst residual of each law of events; ``a`` has them from both sides."""
    events = [EventSides(a, int(i), accuracy) for i in a.sided if a.told[i] and a.told[i + 1]]
    if not events:
        return
    yield from _jumps(a, events, accuracy)
    struck = [event for event in events if a.e.u and event.hits.any()]
    if struck:
        yield from _impacts(a, struck, accuracy)
        yield from _energies(a, struck, accuracy)
    yield from _break_away(a, events, accuracy)


def _times(a: Along, events: list[EventSides]) -> Floats:
    return a.time[[event.left for event in events]]


def _jumps(a: Along, events: list[EventSides], accuracy: Accuracy) -> Iterator[Residual]:
    """Positions do not jump, nor velocities without an impact or a latch that catches."""
    q = [c.name for c in a.mechanism.coordinates]
    units = ["rad" if a.units.get(c, "m") == "rad" else "m" for c in q]
    at = np.array([event.left for event in events])
    size = np.maximum(np.abs(a.q).max(axis=1), a.system.nominal)[:, None]
    off = np.abs(a.q[:, at + 1] - a.q[:, at] - a.qd[:, at] * (a.time[at + 1] - a.time[at]))
    late = np.transpose([a.system.nominal * event.moved + event.drawn for event in events])
    yield from worst("positions do not jump", q, units, a.time[at], off, accuracy.states * size + late)
    caught = (a.conditions[:, at + 1] > 0).any(axis=0)
    plain = np.array([not (a.e.u and event.hits.any()) for event in events]) & ~caught
    size = np.maximum(np.abs(a.qd).max(axis=1), a.system.nominal)[:, None]
    off = np.where(plain, np.abs(np.transpose([event.unforced for event in events])), np.nan)
    # a slip in space ends where its direction is lost, and rebounds that end are put to rest near their top: both are
    # slow beside the fastest motion, which may be that of another coordinate, as the spin of a ball that begins to roll
    fastest = a.system.nominal[:, None] * (size / a.system.nominal[:, None]).max()
    bears = a.forces[: a.e.u] > 0
    loose = (bears[:, at + 1] & ~bears[:, at]).any(axis=0) | any(len(rows) > 1 for rows in a.e.slip_rows)
    bars = np.where(loose, fastest * accuracy.motion, size * accuracy.states)
    # modes may change anywhere between the two sides
    between = accuracy.step + a.time[at + 1] - a.time[at]
    bars = bars + between * np.abs(a.qdd[:, at + 1] - a.qdd[:, at]) + _ended(a, at, accuracy)
    bars = bars + np.transpose(
        [_left_of_slips(a, event, SLIP_LEFT * accuracy.states * fastest[:, 0]) for event in events]
    )
    rates = [f"{unit}/s" for unit in units]
    yield from worst("velocities jump at impacts only", q, rates, a.time[at], off, bars)


def _ended(a: Along, at: NDArray[np.intp], accuracy: Accuracy) -> Floats:
    """The velocities (n, events) that are left of rebounds too low to be seen, which end where their contacts close."""
    u, nominal = a.e.u, a.system.nominal
    closes = (a.forces[:u, at + 1] > 0) & (a.forces[:u, at] <= 0)
    speed = np.sqrt(2 * LOW * accuracy.states * a.gap_sizes * np.abs(a.accelerations[:u, at]))
    lever = np.maximum(np.einsum("kim,i->km", np.abs(a.slopes[:u][..., at]), nominal), 1e-300)
    return np.asarray(nominal[:, None] * np.where(closes, speed / lever, 0.0).max(axis=0, initial=0.0))


def _impacts(a: Along, events: list[EventSides], accuracy: Accuracy) -> Iterator[Residual]:
    """Impacts happen where gaps close; nothing approaches behind them; impulses obey Newton's and Coulomb's laws."""
    u, elements = a.e.u, [c.name for c in a.mechanism.unilaterals]
    units, times = [a.unit(c) for c in elements], _times(a, events)
    at = np.array([event.left for event in events])
    hits = np.transpose([event.hits for event in events]) > 0
    off = np.where(hits, np.abs(a.gaps[:, at]), np.nan)
    bars = accuracy.states * a.gap_sizes + accuracy.step * a.speeds[:u, at]
    yield from worst("impacts where gaps close", elements, units, times, off, bars)
    speeds, speed_units = a.velocities[:u, at + 1], [f"{unit}/s" for unit in units]
    bars = accuracy.states * a.speed_sizes[:u] + accuracy.step * a.turning[:u, at + 1]
    involved = hits | (a.forces[:u, at] > 0)  # what is apart may approach
    off = np.where(involved, -speeds, np.nan)
    yield from worst("nothing approaches behind an impact", elements, speed_units, times, off, bars)
    alone = np.array([len(event.touching) == 1 and event.hits.sum() == 1 for event in events])
    off = np.full((u, len(events)), np.nan)
    for k in np.flatnonzero(alone).tolist():
        i = int(events[k].touching[0])
        off[i, k] = _newton(a, events[k], i, accuracy)
    yield from worst("Newton's law of impact", elements, speed_units, times, off, bars)
    yield from _coulomb(a, events, accuracy)


def _newton(a: Along, event: EventSides, i: int, accuracy: Accuracy) -> float:
    """How far the velocity (m/s) of gap ``i``, which alone closes, is from -e times the one before; NaN if not told.

    A contact may close for good where the rebound is low, and rebound less where Newton's law would bring energy.
    """
    before, behind = float(a.velocities[i, event.left]), float(a.velocities[i, event.left + 1])
    aimed = -float(a.restitution[i, event.left]) * before
    if behind >= aimed or before >= 0:
        return behind - aimed if before < 0 else np.nan
    pull = abs(float(a.accelerations[i, event.left]))
    height, short = LOW * accuracy.states * float(a.gap_sizes[i, 0]), SHORT * accuracy.step * pull
    if aimed**2 <= 2 * pull * height or aimed <= short or a.forces[i, event.left] > 0:
        return abs(min(behind, 0.0))  # it may close for good
    return np.nan if _brings_energy(a, event, i) else aimed - behind


def _brings_energy(a: Along, event: EventSides, i: int) -> bool:
    """Whether Newton's law with friction may bring energy: where an impulse of friction moves the gap too."""
    at, slips = event.left, a.e.slip_rows[i]
    if not len(slips) or max(a.friction[i, at], a.static[i, at]) == 0:
        return False
    coupling = a.mobility([i, *map(int, slips)], at)
    return bool(np.abs(coupling[0, 1:]).max() > 1e-9 * coupling[0, 0])


def _coulomb(a: Along, events: list[EventSides], accuracy: Accuracy) -> Iterator[Residual]:
    """Impulses push, stay in the cone, are those that the run shows, and stand at what touches."""
    u, elements, times = a.e.u, [c.name for c in a.mechanism.unilaterals], _times(a, events)
    off = np.full((3, u, len(events)), np.nan)
    size, rest = 1e-300, np.empty((a.system.n, len(events)))
    for k, event in enumerate(events):
        loads, unique, rest[:, k] = event.impulses
        pushes = dict(zip(event.rows, loads.tolist(), strict=False))
        size = max([size, *map(abs, loads.tolist())])
        for i in event.touching.tolist() if unique else ():
            tangential = float(np.hypot.reduce([pushes[int(row)] for row in a.e.slip_rows[i]], initial=0.0))
            limit = max(a.friction[i, event.left], a.static[i, event.left]) * max(pushes[i], 0.0)
            off[:2, i, k] = -pushes[i], tangential - limit
            if event.hits.sum() == 1 and event.hits[i] == 1 and len(event.touching) == 1:
                off[2, i, k] = abs(a.run[names.impulse(elements[i])][event.left + 1] - pushes[i])
    exact = accuracy.states + np.fromiter(map(attrgetter("moved"), events), float)
    units, bar = [f"{a.force_unit(c)}.s" for c in elements], exact * size
    yield from worst("impulse >= 0", elements, units, times, off[0], bar)
    yield from worst("impulse of friction within its limit", elements, units, times, off[1], bar)
    yield from worst("impulse as shown", elements, units, times, off[2], bar)
    coordinates = [c.name for c in a.mechanism.coordinates]
    momenta = [f"{a.units.get(names.generalized_force(c)) or 'N'}.s" for c in coordinates]
    sizes = a.balanced(np.abs(np.einsum("ijm,jm->im", a.mass, a.qd)).max(axis=1))
    yield from worst("impulses where it touches", coordinates, momenta, times, rest, exact * sizes)


def _energies(a: Along, events: list[EventSides], accuracy: Accuracy) -> Iterator[Residual]:
    """No impact brings energy, and what it takes is counted as dissipated."""
    at, times = np.array([event.left for event in events]), _times(a, events)
    work = np.array([event.work for event in events])
    bar = accuracy.states * a.energy_size
    yield from worst("no impact brings energy", ["energy"], ["J"], times, work[None], bar)
    lost = a.run[names.DISSIPATED_ENERGY]
    off = np.abs(lost[at + 1] - lost[at] + work)[None]
    jumps = np.abs(np.transpose([event.change for event in events]))
    bar = bar + accuracy.step * (np.abs(a.forcing[:, at]) * jumps).sum(axis=0)  # forces work where positions jump
    yield from worst("dissipated energy = loss of impacts", ["energy"], ["J"], times, off, bar)


def _left_of_slips(a: Along, event: EventSides, speeds: Floats) -> Floats:
    """By how much velocities change, (n,), if what is left of the slips in space that end there is put to rest.

    ``speeds`` (n,) of the coordinates make what is left. A small ball turns fast for a slow slip.
    """
    i, change = event.left, np.zeros(a.system.n)
    for contact, rows in zip(a.e.contacts, a.e.slip_rows, strict=True):
        if len(rows) > 1 and a.mode(contact)[i] > STICKS == a.mode(contact)[i + 1]:
            slip = np.abs(a.slopes[rows, :, i + 1]) @ speeds
            change += np.abs(a.answers(rows, i + 1) @ np.linalg.pinv(a.mobility(rows, i + 1))) @ slip
    return change


def _turns(a: Along, item: Rubbing, left: int) -> bool:
    """Whether the mode of ``item`` changes behind the time ``left``."""
    return bool(a.mode(item.element)[left] != a.mode(item.element)[left + 1])


def _loads_go_on(a: Along, event: EventSides) -> bool:
    """Whether the ``event`` is no impact, no latch catches or lets go, and no force jumps."""
    i = event.left
    forcing = np.abs(a.forcing[:, i + 1] - a.forcing[:, i])
    smooth = (forcing <= event.accuracy.states * np.abs(a.forcing).max(axis=1)).all()
    held = (a.latched[:, i] * a.latched[:, i + 1] > 0).all()
    return bool(smooth and held and not (a.e.u and event.hits.any()))


def _break_away(a: Along, events: list[EventSides], accuracy: Accuracy) -> Iterator[Residual]:
    """What sticks slips once its friction has come to the greatest holding force, unless loads jump, as by a latch.

    What is missing to that force is told as the acceleration that it makes. It makes none at a dead centre, where no
    force along the slip moves anything: the force that holds there is not determined. Runs that step over events do
    not tell it: a step that is shorter than the one before may slip for once.
    """
    items = list(rubbing(a, accuracy)) if accuracy.step == 0.0 else []
    if not items:
        return
    off = np.full((len(items), len(events)), np.nan)
    for k, event in enumerate(events):
        i = event.left
        alone = _loads_go_on(a, event) and sum(_turns(a, item, i) for item in items) == 1
        for j, item in enumerate(items):
            modes = a.mode(item.element)
            if alone and modes[i] == STICKS < modes[i + 1]:
                missing = item.holding[i] - np.hypot.reduce(a.forces[item.rows, i])
                off[j, k] = missing * np.linalg.norm(a.mobility(item.rows, i), 2)
    bars = accuracy.motion * np.array([a.acceleration_sizes[item.rows].max() for item in items])[:, None]
    elements = [item.element for item in items]
    units = [f"{a.unit(element)}/s2" for element in elements]
    yield from worst("slips from its limit on", elements, units, _times(a, events), off, bars)
