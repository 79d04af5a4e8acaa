"""What the laws of contact and friction say about any run, without a second simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from machines import Family, Slip
from numpy.typing import NDArray

Floats = NDArray[np.float64]
STICKS = 2
CREEP = 1e-8
"""m/s or rad/s, beyond the errors of a host: what sticks moves by less."""


class Record:
    """The columns of a run by name, (m,) each."""

    def __init__(self, names: Sequence[str], values: Floats) -> None:
        self._columns = dict(zip(names, values.T, strict=True))

    def __getitem__(self, name: str) -> Floats:
        return self._columns[name]


@dataclass(frozen=True)
class Bar:
    """Errors that a way of running has: of ``forces`` and energies as a part of their size, of ``speeds`` in SI units.

    A host that locates no events passes a reversal by what its step changes a speed by, and a stop by as much.
    """

    forces: float
    speeds: float


def recorded(family: Family) -> list[str]:
    """The variables that the checks of ``family`` read."""
    names = [*family.compared, "total_energy", "dissipated_energy", *([family.work] if family.work else [])]
    for slip in family.slips:
        names += [*slip.slips, *slip.forces, slip.limit, slip.mode]
    for contact in family.contacts:
        names += [f"{contact}_gap", f"{contact}_force"]
    return list(dict.fromkeys(names))


def violations(family: Family, run: Record, bar: Bar) -> list[str]:
    """A sentence for each law that the ``run`` breaks by more than the ``bar``."""
    found = [line for slip in family.slips for line in _friction(slip, run, bar)]
    found += [line for name in family.contacts for line in _contact(name, run, bar)]
    return found + _energy(family, run, bar)


def _friction(slip: Slip, run: Record, bar: Bar) -> list[str]:
    w, forces = (np.stack([run[name] for name in names]) for names in (slip.slips, slip.forces))
    speed, size = np.linalg.norm(w, axis=0), np.linalg.norm(forces, axis=0)
    limit = run[slip.limit] * (run[slip.normal] if slip.normal else 1.0)
    greatest = max(1.0, float(np.abs(limit).max()))
    found = []
    if (size - limit).max() > bar.forces * greatest:
        found.append(f"{slip.mode}: a friction is {(size - limit).max():g} beyond its limit, {greatest:g} at most")
    drives = ((forces * w).sum(axis=0) > 0) & (speed > bar.speeds) & (size > bar.forces * greatest)
    if drives.any():
        found.append(f"{slip.mode}: friction drives at {drives.sum()} of {len(speed)} points")
    creeps = (run[slip.mode] == STICKS) & (speed > max(CREEP, bar.speeds))
    if creeps.any():
        found.append(f"{slip.mode}: what sticks slips by up to {speed[creeps].max():g}")
    return found


def _contact(name: str, run: Record, bar: Bar) -> list[str]:
    gap, force = run[f"{name}_gap"], run[f"{name}_force"]
    found = []
    if gap.min() < -bar.speeds:
        found.append(f"{name}: the gap is {gap.min():g}")
    if force.min() < -bar.forces * max(1.0, float(np.abs(force).max())):
        found.append(f"{name}: the force is {force.min():g}")
    if ((gap > bar.speeds) & (force > 0)).any():
        found.append(f"{name}: a force acts over a gap of {gap[force > 0].max():g}")
    return found


def _energy(family: Family, run: Record, bar: Bar) -> list[str]:
    energy, lost = run["total_energy"], run["dissipated_energy"]
    work = run[family.work] if family.work else np.zeros(len(lost))
    size = max(1.0, *(float(np.abs(column).max()) for column in (energy, lost, work)))
    found = []
    if np.ptp(energy + lost - work) > 10 * bar.forces * size:
        found.append(f"the balance of energy moves by {np.ptp(energy + lost - work):g} of {size:g}")
    given = float((np.maximum.accumulate(lost) - lost).max())
    if given > 10 * bar.forces * size:
        found.append(f"friction and impacts give {given:g} of {size:g}")
    return found
