"""The results of a run of a hybrid mechanism at the times that were asked for, as named columns."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lag2fmu.description import names
from lag2fmu.reference.hybrid.records import Answer
from lag2fmu.reference.hybrid.run import HybridRun, Track
from lag2fmu.reference.state import Floats, StateBatch


def columns_of(run: HybridRun, track: Track) -> dict[str, Floats]:
    """{name: column (m,)} in SI units: q, qd, qdd, outputs, multipliers, residuals, energies, results of elements."""
    system, times = run.system, run.times
    q = [c.name for c in system.mechanism.coordinates]
    states, answers, missed, gaps = _answers(run, track)
    columns = dict(zip(run.states, track.values.T, strict=False))
    columns |= dict(zip(map(names.acceleration, q), np.array([a.qdd for a in answers]).T, strict=True))
    columns |= _by_sides(run, track, states, answers)
    multipliers = np.array([a.multipliers for a in answers]).reshape(len(times), -1)
    constraints = system.constraints.names
    columns |= dict(zip(map(names.multiplier, constraints), multipliers.T, strict=True))
    columns |= dict(zip(map(names.residual, constraints), np.array(missed).reshape(len(times), -1).T, strict=True))
    columns |= _elements(run, track, answers, np.array(gaps).reshape(len(times), -1))
    if system.elements.k:
        columns[names.DISSIPATED_ENERGY] = track.values[:, run.size + 1]
    return columns


def _answers(run: HybridRun, track: Track) -> tuple[list[StateBatch], list[Answer], list[Floats], list[Floats]]:
    """States, accelerations and forces, residuals of constraints that hold, and gaps, at every time."""
    system, states, answers, missed, gaps = run.system, [], [], [], []
    for t, y, modes in zip(run.times, track.values, track.modes, strict=True):
        system.elements.set_sides(modes.sides)
        run.end = np.inf
        point = system.point(run.state(float(t), y))
        states.append(point.state)
        answers.append(system.answer(point, modes))
        missed.append(point.constraints[0])
        gaps.append(point.rows.gaps)
    return states, answers, missed, gaps


def _by_sides(run: HybridRun, track: Track, states: list[StateBatch], answers: list[Answer]) -> dict[str, Floats]:
    """Outputs and energies, evaluated together for all times at which the kinks have equal sides."""
    system, m = run.system, len(states)
    found: dict[str, Floats] = {}
    for sides, rows in groups([modes.sides for modes in track.modes]):
        system.elements.set_sides(sides)
        batch = StateBatch(
            *(np.stack([getattr(states[r], x) for r in rows], axis=-1) for x in ("t", "q", "qd", "inputs"))
        )
        unknowns = [np.stack([getattr(answers[r], x) for r in rows], axis=-1) for x in ("qdd", "multipliers")]
        touching = np.stack([answers[r].forces[: len(system.elements.contacts)] for r in rows], axis=-1)
        values = system.energies.outputs(batch, unknowns, touching)
        inputs = dict(zip(system.energies.input_names, batch.inputs, strict=True))
        for energy in ("kinetic_energy", "potential_energy", "generalized_energy"):
            values[energy] = getattr(system.equations, energy)(batch.t, batch.q.T, batch.qd.T, inputs)
        for name, value in values.items():
            found.setdefault(name, np.empty(m))[rows] = value
    return found


def groups(keys: list[tuple[int, ...]]) -> Iterator[tuple[tuple[int, ...], list[int]]]:
    """(key, indices at which it stands in ``keys``) of each different key."""
    for key in dict.fromkeys(keys):
        yield key, [i for i, other in enumerate(keys) if other == key]


def _elements(run: HybridRun, track: Track, answers: list[Answer], gaps: Floats) -> dict[str, Floats]:
    """The results of contacts and frictions: ``gaps`` (m, u), forces, modes, impulses and counts of impacts."""
    e, columns = run.system.elements, dict[str, Floats]()
    forces = np.array([a.forces for a in answers]).reshape(len(answers), -1)
    columns |= dict(zip(e.force_names, forces.T, strict=True))
    for i, name in enumerate(e.contacts):
        columns[names.gap(name)], columns[names.impulse(name)] = gaps[:, i], track.impulses[:, i]
        columns[names.mode(name)] = np.array([float(modes.contacts[i]) for modes in track.modes])
        columns[names.impacts(name)] = track.impacts[:, i]
    for j, name in enumerate(e.frictions):
        columns[names.mode(name)] = np.array([float(modes.frictions[j]) for modes in track.modes])
    return columns
