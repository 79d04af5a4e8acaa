"""Checks of hybrid mechanisms: the laws of contact along the whole run, which need no second run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.hybrid.measures import gap_sizes
from lag2fmu.reference.hybrid.modes import Event, Mode
from lag2fmu.reference.hybrid.records import MotionPoint
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.agreement import (
    SAFETY,
    SHARPER,
    comparable,
    has_rows,
    horizon_of,
    lowest,
    most_left_out,
    out_of_time,
    width_at,
    widths_of,
)
from lag2fmu.verify.balances import resting_energy
from lag2fmu.verify.comparison import Windows
from lag2fmu.verify.laws.along import STILL
from lag2fmu.verify.laws.kink_sides import by_sides, part_of, sides_along
from lag2fmu.verify.report import Check
from lag2fmu.verify.task import Floats, Task

EXACT = 1e-8
"""Relative to the greatest force: how well the laws of forces are met. Some digits are lost where dry friction couples
them."""


def row_outputs(mechanism: Mechanism) -> list[str]:
    """The names of the results of contacts, stops and frictions: gaps, forces, modes, impulses, counts."""
    found: list[str] = []
    for c in mechanism.unilaterals:
        of = (names.gap, names.force, names.impulse, names.mode, names.impacts)
        found += [name(c.name) for name in of]
        found += names.frictions(c.name, len(c.slips))
    for f in mechanism.frictions:
        found += [names.force(f.name), names.mode(f.name)]
    return found


# ------------------------------------------------------------------------------------------------------ what compares


def extent(task: Task, reference: Reference, horizon: float, windows: Windows | None = None) -> Iterator[Check]:
    """Which part of the run is compared, and why the rest is not; ``windows`` are those beyond the ``horizon`` (s)."""
    windows = windows or Windows()
    if reference.comparable is None:
        return
    seen = comparable(task, reference) & (reference.trajectory.time <= horizon)
    end = float(reference.trajectory.time[-1])
    left_out = max(0.0, 1.0 - (float(np.mean(seen)) * end + windows.covered) / task.stop_time)
    why = out_of_time(task, reference) if horizon == end else ""
    most = most_left_out(task)
    remedy = f"; {why or SHARPER}" if left_out > most else ""
    whole = task.stop_time * (1 - 1e-9)
    until = f"until t = {horizon:.4g} s" if horizon < whole else "to the end"
    if windows.count:
        until += f" and {windows.told(horizon)}"
    ends = max(horizon, windows.until) < min(end, whole) - task.steps[1]
    if ends and (windows.tolerance is not None or not windows.count):
        until += ", where impacts and motion have amplified differences beyond the bar"
    impacts = _impacts(task, reference)
    detail = f"compared {until}, but for short times around {len(reference.events)} events ({impacts})"
    yield Check("events, share not compared", left_out, most, f"{detail}{remedy}", extent=True)


def _accumulates(task: Task, reference: Reference, event: Event) -> bool:
    """Whether an impact rebounds, or lifts another contact, by no more than runs may leave out."""
    return event.kind == "impact" and min(event.height, event.lift) <= lowest(task, reference, event.time)


def _impacts(task: Task, reference: Reference) -> str:
    """The number of impacts in words, with those that accumulate, of which runs may have more or fewer."""
    impacts = [event for event in reference.events if event.kind == "impact"]
    low = sum(_accumulates(task, reference, event) for event in impacts)
    return f"{len(impacts)} impacts" + (f", {low} of them accumulating" if low else "")


# --------------------------------------------------------------------------------------------------------- the laws


def row_checks(
    task: Task, runs: Mapping[str, Trajectory], reference: Reference, rows: Mapping[str, NDArray[np.intp]]
) -> Iterator[Check]:
    """Checks of the laws of contact along every run; ``rows`` (k,) are those of ``reference`` at the times of a run."""
    if not has_rows(task.mechanism):
        return
    seen = comparable(task, reference)
    if task.mechanism.unilaterals:
        system = HybridSystem(task.mechanism)
        starts = {label: _start(task, system, run) for label, run in runs.items()}
        yield _worst(_penetration(task, starts[label], label, run) for label, run in runs.items())
        yield _worst(_laws_of_contact(task, system, label, run) for label, run in runs.items())
    yield _worst(_energy(task, label, run, reference, rows[label], seen) for label, run in runs.items())
    finest = max(runs, key=lambda label: (label.startswith("co-simulation"), len(runs[label])))
    if task.mechanism.unilaterals:
        yield from _impact_checks(task, finest, runs[finest], reference, rows[finest])


def _worst(checks: Iterable[Check]) -> Check:
    """The check that is nearest to its bar, or farthest beyond it."""
    return max(checks, key=lambda check: check.value / max(check.bar, 1e-300))


def _start(task: Task, system: HybridSystem, run: Trajectory) -> MotionPoint:
    """What the start of a run tells of contacts: nominal sizes of gaps."""
    q, qd = np.split(run.columns(task.states[: 2 * system.n])[0], 2)
    return system.point(system.energies.state(0.0, q, qd))


def _penetration(task: Task, start: MotionPoint, label: str, run: Trajectory) -> Check:
    """The check of the deepest penetration of any gap, relative to the nominal size of the gap.

    An FMU that steps over impacts may be in by what a gap closes in a step. By more it is where another contact has
    thrown a body back that was at rest on this one; the next step corrects that.
    """
    gaps = run.columns([names.gap(c.name) for c in task.mechanism.unilaterals]) / gap_sizes(start)
    if label.startswith("co-simulation") and task.solver_step:
        gaps = gaps + task.solver_step * _greatest_rates(run.time, gaps)
        gaps[:-1] = np.maximum(gaps[:-1], gaps[1:])
    row, column = np.unravel_index(np.argmin(gaps), gaps.shape)
    where = f"least gap: {task.mechanism.unilaterals[column].name} at t = {run.time[row]:.3g} s, {label}"
    bar = task.tolerance if label.startswith("co-simulation") else SAFETY * task.tolerance
    return Check("no penetration", max(0.0, -float(gaps[row, column])), bar, where)


def _greatest_rates(time: Floats, values: Floats) -> Floats:
    """The greatest speeds of ``values`` (m, k) between each of the times (m,) in s and its two neighbours on a side."""
    rates = np.abs(np.diff(values, axis=0)) / np.diff(time)[:, None]
    padded = np.pad(rates, ((2, 2), (0, 0)))
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, 4, axis=0).max(axis=-1))


def _coefficients(task: Task, system: HybridSystem, run: Trajectory) -> tuple[Floats, Floats]:
    """The coefficients of sliding and sticking friction along a run, (u, m); infinite where they are about to jump."""
    q, qd = np.split(run.columns(task.states[: 2 * system.n]), 2, axis=1)
    signals = task.driving(task.steps[1])
    others = {} if signals is None else signals.sampled(run.time)
    others |= {z.name: run[z.name] for z in task.mechanism.states}
    state = system.energies.state(run.time, q, qd, others)
    sides, told = sides_along(system.elements, state)

    def evaluated(at: NDArray[np.intp]) -> list[Floats]:
        rows = system.elements.rows(part_of(state, at))
        return [rows.friction, rows.static]

    friction, static = by_sides(system.elements, sides, evaluated)
    about = ~told.all(axis=0)
    return np.where(about, np.inf, friction), np.where(about, np.inf, static)


def _laws_of_contact(task: Task, system: HybridSystem, label: str, run: Trajectory) -> Check:
    """The check of the worst violation of a law: forces only push, open contacts bear none, friction is in its cone.

    While the rest of accumulating impacts lasts, a contact counts as open, with a gap of 0 and the mean force.
    Violations are relative to the greatest force, or to the mean of the impulses over the run if this is more. Those of
    an FMU that steps over events have to last, see ``Along.lasting``.
    """
    contacts = task.mechanism.unilaterals
    friction, static = _coefficients(task, system, run)
    normal = run.columns([names.force(c.name) for c in contacts])
    impulses = run.columns([names.impulse(c.name) for c in contacts])
    mean = float(impulses.max()) / max(float(np.ptp(run.time)), 1e-300)
    size = max(float(np.abs(normal).max()), mean, 1e-300)
    worst, where = 0.0, "no force at all" if size == 1e-300 else "forces push, friction stays in its cone"
    for i, c in enumerate(contacts):
        gap = run[names.gap(c.name)]
        open_ = (run[names.mode(c.name)] == Mode.OPEN) & (gap > task.tolerance * np.abs(gap).max())
        slip = [run[name] for name in names.frictions(c.name, len(c.slips))]
        tangential = np.hypot.reduce(slip) if slip else np.zeros(len(run))
        sticks = run[names.mode(c.name)] == Mode.STICKS
        limit = np.where(sticks, static[i], friction[i]) * np.maximum(normal[:, i], 1e-300)
        off = np.maximum(-normal[:, i], np.where(open_, np.abs(normal[:, i]) + tangential, tangential - limit))
        if task.solver_step and label.startswith("co-simulation"):
            off = np.lib.stride_tricks.sliding_window_view(off, min(STILL, len(off))).min(axis=-1)
        at = int(np.argmax(off))
        if off[at] / size > worst:
            worst, where = float(off[at] / size), f"worst: {c.name} at t = {run.time[at]:.3g} s, {label}"
    return Check("laws of contact", worst, EXACT, where)


def _energy(
    task: Task, label: str, run: Trajectory, reference: Reference, rows: NDArray[np.intp], seen: NDArray[np.bool_]
) -> Check:
    """The check of the growth of energy minus work from outside; impacts and friction may only take energy.

    A dissipation function may bring some, as the drag of a stream does: what is dissipated then falls.
    """
    taken = np.maximum(np.diff(reference.trajectory[names.DISSIPATED_ENERGY], prepend=0.0), 0.0)
    external = (reference.work + np.cumsum(taken))[rows]
    compared = seen[rows] & (run.time <= horizon_of(task, reference))  # the work is that of the direct integration
    held, times = (run["generalized_energy"] - external)[compared], run.time[compared]
    sizes = np.abs(reference.trajectory["kinetic_energy"]), np.abs(external), np.abs(run["generalized_energy"])
    size = max(*(float(x.max()) for x in sizes), resting_energy(task, run), 1e-300)
    if len(held) < 2:
        return Check("energy never grows", 0.0, 0.0, f"no two times are compared, {label}")
    rise = np.diff(held) / size
    at = int(np.argmax(rise))
    bar = 4 * SAFETY * task.tolerance * float(reference.growth[rows][compared].max())
    where = f"greatest rise at t = {times[at]:.3g} s, {label}"
    return Check("energy never grows", max(0.0, float(rise[at])), bar, where)


def _expected_impacts(task: Task, contact: str, reference: Reference) -> Floats:
    """How many impacts of a ``contact`` there are until each time of ``reference``, (m,).

    Time stepping does not tell the impulse of another impact on a contact that is closed, or that touches, from its
    force.
    """
    counts = reference.trajectory[names.impacts(contact)]
    if not task.solver_step:
        return counts
    gap = reference.trajectory[names.gap(contact)]
    gap = np.maximum(gap, np.append(gap[0], gap[:-1]))  # one time may be right before the impact
    apart = (reference.trajectory[names.mode(contact)] == Mode.OPEN) & (gap > task.tolerance * np.abs(gap).max())
    return np.asarray(np.cumsum(np.diff(counts, prepend=0.0) * np.append(True, apart[:-1])))


def _counted_until(task: Task, contact: str, reference: Reference) -> float:
    """The time (s) until which the impacts of a ``contact`` have one count; inf if they always have.

    From where others may balance its impulse each way of sharing them is right. From where impacts accumulate, as they
    rebound or lift another contact by no more than the tolerance, each path ends them in its own way. A closed contact
    takes part in those of others that it bears, such as a taut rope. Impacts that follow within the errors of their
    times, because others strike the contact back, may be one.
    """
    time, counts = reference.trajectory.time, reference.trajectory[names.impacts(contact)]
    errors, last = widths_of(replace(task, tolerance=task.tolerance / SAFETY), reference), -np.inf
    for event in reference.events:
        if event.kind == "shares" and event.element == contact:
            return event.time
        if event.kind == "impact" and event.element == contact:
            if event.time - last <= width_at(reference, errors, event.time):
                return last
            last = event.time
        if not _accumulates(task, reference, event):
            continue
        at = int(np.searchsorted(time, event.time))
        if event.element == contact or counts[max(at - 1, 0)] < counts[min(at + 1, len(time) - 1)]:
            return event.time
    return float(np.inf)


def _impact_checks(
    task: Task, label: str, run: Trajectory, reference: Reference, rows: NDArray[np.intp]
) -> Iterator[Check]:
    """Checks of the counts of impacts, and of their times, which the gaps behind them tell.

    A contact is watched as long as its count is one. Counts are not checked if there are more contacts than
    coordinates. How an impact is shared among them is then not unique, and one of them may bear nothing.
    """
    seen = comparable(task, reference)[rows] & np.isfinite(reference.growth[rows])
    missed, worst, where, count = 0, 0.0, "no impact", 0
    widths = widths_of(task, reference)
    for c in task.mechanism.unilaterals:
        watched = seen & (run.time < _counted_until(task, c.name, reference))
        expected = _expected_impacts(task, c.name, reference)[rows]
        missed += int(np.sum(expected[watched] != run[names.impacts(c.name)][watched]))
        gap = reference.trajectory[names.gap(c.name)]
        slope = np.diff(gap) / np.diff(reference.trajectory.time)
        rate = np.append(slope, slope[-1])[rows]  # forward difference: the rate behind an impact
        quick, off = np.abs(slope).max(), np.abs(run[names.gap(c.name)] - gap[rows])
        flies = (reference.trajectory[names.mode(c.name)][rows] == Mode.OPEN) & (rate > task.tolerance * quick)
        for event in reference.events:
            behind = np.flatnonzero(watched & (run.time > event.time))
            if event.element != c.name or event.kind != "impact" or not len(behind):
                continue
            at, count = int(behind[0]), count + 1
            if not flies[at]:  # the contact closes at once, or both sides stay where they touch
                continue
            since = gap[rows][at] / (run.time[at] - event.time)  # at the top of the rebound ``rate`` is 0
            pace = quick if task.solver_step else max(rate[at], since)  # all impacts have errors of first order
            late = float(off[at] / pace) / width_at(reference, widths, event.time)
            if late >= worst:
                worst, where = late, f"{c.name} at t = {event.time:.4g} s"
    if where == "no impact" and count:
        where = "no contact opens at once after an impact"
    if len(task.mechanism.unilaterals) <= len(task.mechanism.coordinates):
        told = f"{count} compared one by one of {_impacts(task, reference)}; points with another count, {label}"
        yield Check("impacts counted", float(missed), 0.0, told)
    yield Check("times of impacts", worst, 1.0, f"greatest difference, relative to what the bar allows: {where}")
