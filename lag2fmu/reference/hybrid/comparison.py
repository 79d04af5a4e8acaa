"""Three runs of a hybrid mechanism side by side: its errors, and how starts are amplified.

Each run has its own events. The runs are compared at times at which all of them are in the same modes. Between the
times of one impact in two runs the velocities differ by the whole rebound, which says nothing about the errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lag2fmu.reference.hybrid.measures import rest_speeds
from lag2fmu.reference.hybrid.modes import Mode, Modes
from lag2fmu.reference.hybrid.run import HybridRun, Track
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.state import Floats
from lag2fmu.reference.trajectory import Trajectory

PERTURBATION = 1e-8
"""In scales of the states: how far a start is moved, to see how errors grow. Far above rounding, and below NEAR."""
NEAR = 1e-5
"""In units of their scales: two states that differ by less are near."""


def perturbed(run: HybridRun, start: Floats, scales: Floats, modes: Modes) -> Floats:
    """The ``start`` moved by 1e-8 of the ``scales`` (s,), along a direction without symmetry.

    Contacts that are closed at the start stay closed, and what rests begins to slip from rest: by its static friction.
    What an impact stops at the start goes on to need this impact.
    """
    n, system = run.n, run.system
    direction = np.cos(np.arange(1, run.size + 1))
    moved = start + PERTURBATION * scales * direction / np.abs(direction).max()
    t = float(run.times[0])
    system.elements.set_sides(modes.sides)
    point, slips = system.point(run.state(t, start)), system.elements.slip_rows
    touching = tuple(Mode.SLIDES if gap <= 1e-9 else Mode.OPEN for gap in point.rows.gaps)
    still = Modes(touching, tuple(Mode.FORWARD for _ in modes.frictions), modes.held, modes.sides, {}, modes.offsets)
    onto = system.projected(run.state(t, moved), still).q
    rests, e = np.abs(point.rows.velocities) <= rest_speeds(point), system.elements
    contacts = (_before(mode, bool(rests[i]), bool(rests[slips[i]].all())) for i, mode in enumerate(modes.contacts))
    resting = replace(
        modes,
        contacts=tuple(contacts),
        frictions=tuple(Mode.STICKS if rest else Mode.FORWARD for rest in rests[e.friction_rows]),
        held=tuple(h and bool(rest) for h, rest in zip(modes.held, rests[e.latch_rows], strict=True)),
    )
    both = system.projected(run.state(t, np.concatenate([onto, moved[n:]])), resting)
    return np.concatenate([onto, both.qd, moved[2 * n :]])


def _before(mode: Mode, touches: bool, rests: bool) -> Mode:
    """What holds a contact at the start before an impact there, if it ``touches`` at rest or its slip ``rests``."""
    if mode is Mode.OPEN or not touches:
        return Mode.OPEN
    return Mode.STICKS if rests else Mode.SLIDES


def compared(
    run: HybridRun,
    method: str,
    tracks: Sequence[Track],
    scales: Floats,
    units: Floats,
    columns: Mapping[str, Floats],
    low: float,
) -> Reference:
    """The record of the runs by ``method`` at rtol, 10 rtol, and 10 rtol from the perturbed start.

    ``scales`` (s,) are those of the states, which errors are relative to, and ``units`` (m, s) those of the distance of
    two runs. ``columns`` {name: (m,)} are the results of the first run. It follows rebounds lower than ``low``, in
    nominal gaps, and the others leave them out: what this makes of the motion is amplified as well. The others may have
    ended at an earlier time, where they have parted from it.
    """
    whole, coarse, moved = tracks
    k = len(coarse.modes)
    fine = whole.until(run.times[:k])
    same = alike(fine, coarse) & alike(coarse, moved)
    # a contact that touches without a force may count as open or closed: near states then tell that runs do the same
    near = [np.abs(a.values - b.values)[:, : run.size] / scales for a, b in ((fine, coarse), (coarse, moved))]
    same |= (near[0].max(axis=1) < NEAR) & (near[1].max(axis=1) < NEAR)
    same[0] = True
    same = np.concatenate([same, np.zeros(len(run.times) - k, dtype=bool)])
    last = int(np.flatnonzero(same)[-1])
    at = np.maximum.accumulate(np.where(same, np.arange(len(same)), 0))  # the last comparable time up to each
    errors = np.abs(fine.values - coarse.values)[at, : run.size]
    distance = (np.abs(moved.values - coarse.values)[at, : run.size] / units[at]).max(axis=1)
    begun = float(distance[0]) if distance[0] > 1e-3 * PERTURBATION else PERTURBATION  # nothing was free at the start
    amplification = np.maximum.accumulate(distance / begun)
    if low:
        amplification = np.maximum(amplification, np.maximum.accumulate((errors / units[at]).max(axis=1)) / low)
    amplification[last + 1 :] = np.inf
    return Reference(
        trajectory=Trajectory.of(run.times, columns),
        work=whole.values[:, run.size] - whole.values[:, run.size + 1],
        scales=dict(zip(run.states, scales.tolist(), strict=True)),
        error=Trajectory(run.times, tuple(run.states), errors),
        amplification=amplification,
        method=method,
        evaluations=sum(track.evaluations for track in tracks),
        events=whole.events,
        turns=whole.turns,
        comparable=same,
    )


def alike(a: Track, b: Track) -> NDArray[np.bool_]:
    """At which times two runs do the same, (m,): modes are equal, and so are the counts of impacts since closing."""
    found = [x == y for x, y in zip(a.modes, b.modes, strict=True)]
    closed = np.array([[mode is not Mode.OPEN for mode in modes.contacts] for modes in a.modes], dtype=bool)
    counts = (a.since == b.since) | closed.reshape(a.since.shape)
    same: NDArray[np.bool_] = np.array(found) & counts.all(axis=1)
    return same
