"""Laws at single times: equations of motion, gaps, normal forces, Coulomb's law, latches.

None of them needs to know the mode of a contact. A force tells that the contact is closed, a slip that it slides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.verify.laws.along import Along
from lag2fmu.verify.laws.residual import Accuracy, Floats, Residual, worst

STICKS = 2
"""The mode of what sticks, as FMUs show it."""
CLEAR = 1e-3
"""A friction that is this part below its limit is clearly below it."""


def at_points(a: Along, accuracy: Accuracy) -> Iterator[Residual]:
    """The worst residual of each law that holds at every time."""
    yield from _motion(a, accuracy)
    if a.mechanism.unilaterals:
        yield from _contacts(a, accuracy)
    yield from _frictions(a, accuracy)
    if a.mechanism.latches:
        yield from _latches(a, accuracy)


def _motion(a: Along, accuracy: Accuracy) -> Iterator[Residual]:
    """Mass times acceleration is the sum of the forces that the run shows."""
    borne = (a.G, a.multipliers), (a.slopes, a.forces)
    rest = np.einsum("ijm,jm->im", a.mass, a.qdd) - a.forcing
    size = np.einsum("ijm,jm->im", np.abs(a.mass), np.abs(a.qdd)) + np.abs(a.forcing)
    for rows, forces in borne:
        rest = rest - np.einsum("kim,km->im", rows, forces)
        size = size + np.einsum("kim,km->im", np.abs(rows), np.abs(forces))  # frictions may cancel each other
    coordinates = [c.name for c in a.mechanism.coordinates]
    units = [a.units.get(names.generalized_force(c)) or "N" for c in coordinates]
    off, bars = np.where(a.told, np.abs(_unexplained(a, rest)), np.nan), accuracy.exact * a.balanced(size.max(axis=1))
    yield from worst("mass x acceleration = forces", coordinates, units, a.time, off, bars)


def _unexplained(a: Along, rest: Floats) -> Floats:
    """The ``rest`` of the equations (n, m), without what multipliers of constraints add where quaternions turn bodies.

    The length of a quaternion moves no body, so each formulation has forces of its own along it.
    """
    if not any(frame.quaternion for frame in a.mechanism.frames):
        return rest
    G = np.moveaxis(a.G, -1, 0)
    return np.asarray(rest - np.einsum("mki,mk->im", G, np.einsum("mik,im->mk", np.linalg.pinv(G), rest)))


def _contacts(a: Along, accuracy: Accuracy) -> Iterator[Residual]:
    """Gaps, normal forces, and that only one of the two is not 0."""
    u, elements = a.e.u, [c.name for c in a.mechanism.unilaterals]
    units, forces = [a.unit(c) for c in elements], [a.force_unit(c) for c in elements]
    speeds, pushes = [f"{unit}/s" for unit in units], a.forces[:u]
    gap_bar = accuracy.states * a.gap_sizes + accuracy.step * a.speeds[:u]
    force_bar = accuracy.exact * a.force_sizes[:u]
    yield from worst("gap >= 0", elements, units, a.time, -a.gaps, gap_bar)
    shown = np.abs(a.run.columns([names.gap(c) for c in elements]).T - a.gaps)
    sizes = np.maximum(a.gap_sizes, np.abs(a.gaps).max(axis=1, keepdims=True))  # a gap that nothing moves rounds, too
    yield from worst("gap as shown", elements, units, a.time, shown, accuracy.exact * sizes)
    yield from worst("normal force >= 0", elements, forces, a.time, a.lasting(-pushes, accuracy.step), force_bar)
    over = a.lasting(np.where(a.gaps > gap_bar, np.abs(pushes), np.nan), accuracy.step)
    yield from worst("no force over a gap", elements, forces, a.time, over, force_bar)
    bears = (pushes > force_bar) & a.behind
    off = np.where(bears, np.abs(a.velocities[:u]), np.nan)
    bars = accuracy.states * a.speed_sizes[:u] + accuracy.step * a.turning[:u]
    yield from worst("closed stays closed", elements, speeds, a.time, off, bars)
    off = np.where(bears, np.abs(a.accelerations[:u]), np.nan)
    bars = accuracy.exact * a.acceleration_sizes[:u]
    yield from worst("closed does not accelerate", elements, [f"{x}/s2" for x in units], a.time, off, bars)


@dataclass(frozen=True)
class Rubbing:
    """An ``element`` with friction along its ``rows``: sliding and holding limits (m,), speed and direction of slip.

    ``slow`` (m,): the slips up to which it may be at rest, by the errors of a run.
    """

    element: str
    rows: NDArray[np.intp]
    sliding: Floats
    holding: Floats
    speed: Floats
    slow: Floats

    @property
    def moves(self) -> NDArray[np.bool_]:
        """Whether its slip is beyond the errors of a run: (m,)."""
        moves: NDArray[np.bool_] = self.speed > self.slow
        return moves


def rubbing(a: Along, accuracy: Accuracy) -> Iterator[Rubbing]:
    """All elements of ``a`` with friction."""
    found = []
    for i, c in enumerate(a.mechanism.unilaterals):
        push = np.maximum(a.forces[i], 0.0)
        found += [(c.name, a.e.slip_rows[i], a.friction[i] * push, a.static[i] * push)] if c.slips else []
    for j, f in enumerate(a.mechanism.frictions):
        found.append((f.name, a.e.friction_rows[j : j + 1], a.sliding[j], a.holding[j]))
    for element, rows, sliding, holding in found:
        speed = np.hypot.reduce(a.velocities[rows])
        slow = accuracy.states * a.speed_sizes[rows].max() + accuracy.step * np.hypot.reduce(a.turning[rows])
        yield Rubbing(element, rows, sliding, np.maximum(sliding, holding), speed, slow)


def _frictions(a: Along, accuracy: Accuracy) -> Iterator[Residual]:
    """Coulomb's law: friction within its limit, at the limit and against the slip where there is slip, else no slip."""
    items = list(rubbing(a, accuracy))
    if not items:
        return
    elements = [item.element for item in items]
    forces = [a.force_unit(e) for e in elements]
    bars = accuracy.exact * np.array([a.force_sizes[item.rows].max() for item in items])[:, None]
    size = np.stack([np.hypot.reduce(a.forces[item.rows]) for item in items])
    holding = np.stack([item.holding for item in items])
    beyond = a.lasting(np.where(a.told, size - holding, np.nan), accuracy.step)
    yield from worst("friction within its limit", elements, forces, a.time, beyond, bars)
    off, turned = np.transpose([_against(a, item, accuracy) for item in items], (1, 0, 2))
    off = a.lasting(off, accuracy.step, bars + turned)
    yield from worst("friction against the slip", elements, forces, a.time, off, bars + turned)
    yield from _sticking(a, items, size, accuracy)


def _sticking(a: Along, items: list[Rubbing], size: Floats, accuracy: Accuracy) -> Iterator[Residual]:
    """What sticks does not creep, and frictions of a ``size`` (k, m) that is clearly below the limit let nothing go."""
    elements = [item.element for item in items]
    units = [a.unit(e) for e in elements]
    sticks = np.stack([a.mode(e) == STICKS for e in elements])
    speeds = np.stack([item.speed for item in items])
    slow = [item.slow for item in items]
    speed_units = [f"{unit}/s" for unit in units]
    yield from worst(
        "what sticks does not creep", elements, speed_units, a.time, np.where(sticks, speeds, np.nan), slow
    )
    still = (size < (1 - CLEAR) * np.stack([item.sliding for item in items])) & a.behind
    pulled = np.stack([np.hypot.reduce(a.accelerations[item.rows]) for item in items])
    bars = accuracy.exact * np.array([a.acceleration_sizes[item.rows].max() for item in items])[:, None]
    off = a.lasting(np.where(still, pulled, np.nan), accuracy.step)
    for j, at in zip(*np.nonzero(off > bars), strict=True):  # near a dead centre no force can hold
        limit = items[j].holding[at] + size[j, at]
        off[j, at] = min(off[j, at], limit * np.linalg.norm(a.mobility(items[j].rows, at), 2))
    yield from worst("below the limit nothing slips", elements, [f"{x}/s2" for x in units], a.time, off, bars)


def _against(a: Along, item: Rubbing, accuracy: Accuracy) -> tuple[Floats, Floats]:
    """How far the friction is from its limit against the slip, (m,), and what an error of the slip's direction makes.

    A friction at rest that is at its limit must not push the way the slip begins to go.
    """
    v, f = a.velocities[item.rows], a.forces[item.rows]
    aimed = item.sliding * v / np.maximum(item.speed, 1e-300)
    off = np.where(item.moves & a.behind, np.hypot.reduce(f + aimed), np.nan)
    aside = accuracy.motion * a.speed_sizes[item.rows].max()
    aside = aside + accuracy.step * np.hypot.reduce(a.turning[item.rows])
    error = aside / np.maximum(item.speed, 1e-300)
    return off, item.sliding * np.minimum(2.0, error) * (len(item.rows) > 1)


def _latches(a: Along, accuracy: Accuracy) -> Iterator[Residual]:
    """A latch holds while its condition is positive, and bears nothing while it is negative."""
    rows, elements = np.array(a.e.latch_rows), list(a.e.latches)
    clear = np.abs(a.conditions) > 1e-9 * np.abs(a.conditions).max(axis=1, keepdims=True)
    off = np.where((a.conditions > 0) & clear & a.behind, np.abs(a.velocities[rows]), np.nan)
    speeds, off = ["1/s"] * len(rows), a.lasting(off, accuracy.step)
    bars = accuracy.states * a.speed_sizes[rows] + accuracy.step * a.turning[rows]
    yield from worst("latches hold", elements, speeds, a.time, off, bars)
    off = np.where((a.conditions < 0) & clear & a.behind, np.abs(a.forces[rows]), np.nan)
    off = a.lasting(off, accuracy.step)
    yield from worst(
        "open latches bear nothing", elements, ["N"] * len(rows), a.time, off, accuracy.exact * a.force_sizes[rows]
    )
