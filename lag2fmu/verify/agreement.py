"""At which times two right runs have to agree, and how exactly.

Errors are relative to max(range, nominal) of each coordinate, velocity and further state. Two runs whose starts differ
by 1e-8 drift apart by the amplification A(t), in units of the motion. An error of the solver grows by the same factor,
and a long vibration adds an error for every radian: ``Reference.growth``, and ``growths`` of a coordinate whose
vibration is too small to show. The bar is 100 growth tolerance. The comparison ends where the bar exceeds 1e-2,
because from there on two right runs may have nothing in common. This happens in chaotic motions, and in motions that
nothing holds, such as that of an aircraft which tilts.

Around an event two runs of different accuracy are in different modes for a short while, and each run leaves out impacts
lower than its tolerance. Such times are not compared.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description import names
from lag2fmu.errors import SimulationError
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.integrated import Reference
from lag2fmu.verify.task import Floats, Task

SAFETY, CHAOS = 100.0, 1e-2
"""A run may be off by SAFETY tolerances times the growth of errors; where this is more than CHAOS of the scales, runs
are no longer compared."""
LEFT_OUT = 0.2
"""The most of a run that may be left uncompared; with more the run is not judged: ok would say more than is known."""
SHARPER = "take a sharper --tolerance or a shorter --stop-time"
"""What makes more of a run comparable."""
LOWER = 10.0
"""In tolerances: the height of rebounds up to which a run may leave them out."""
FLIGHTS = 2.0
"""In the time that a rebound takes: a contact that has not come back by then does not, because loads have changed."""


def has_rows(mechanism: Mechanism) -> bool:
    """Whether contacts, stops, dry friction or latches act in ``mechanism``."""
    return bool(mechanism.unilaterals or mechanism.frictions or mechanism.latches)


def comparable_growth(tolerance: float) -> float:
    """The growth of errors up to which trajectories can be compared at this ``tolerance``."""
    return CHAOS / (SAFETY * tolerance)


def horizon_of(task: Task, reference: Reference) -> float:
    """The time (s) until which trajectories can be compared at this tolerance."""
    comparable = reference.growth <= comparable_growth(task.tolerance)
    return float(reference.trajectory.time[comparable][-1]) if comparable[0] else 0.0


def out_of_time(task: Task, reference: Reference) -> str:
    """A phrase on where the time for the direct integration was over; "" where it came to the end."""
    reached = float(reference.trajectory.time[-1])
    if reached >= task.stop_time * (1 - 1e-9):
        return ""
    return (
        f"the direct integration reached t = {reached:.4g} s in its {task.limit:g} s of CPU time; give a longer "
        "--limit or a shorter --stop-time"
    )


def on_grid(reference: Reference, time: Floats) -> NDArray[np.intp]:
    """The rows of the reference at ``time`` (k,) in s: (k,); raises SimulationError if a time is not on its grid."""
    known = reference.trajectory.time
    rounding = 1e-3 * float(np.diff(known).min(initial=np.inf))
    rows = np.minimum(np.searchsorted(known, time - rounding), len(known) - 1)
    if not (np.abs(known[rows] - time) <= rounding).all():
        raise SimulationError("the communication points of the FMU are not those of the direct integration")
    return rows


def comparable(task: Task, reference: Reference) -> NDArray[np.bool_]:
    """At which times of ``reference`` another run must agree with it: (m,).

    What the reference would do right behind its end another run may do before.
    """
    time = reference.trajectory.time
    if reference.comparable is None:
        return np.ones(len(time), dtype=bool)
    seen: NDArray[np.bool_] = reference.comparable.copy()
    widths = widths_of(task, reference)
    for at in (*(event.time for event in reference.events), float(time[-1])):
        width = width_at(reference, widths, at)  # the bar is that of the time before the event
        seen &= np.abs(time - at) > np.minimum(widths, width)
    for begin, end in _cascades(task, reference):
        seen &= (time < begin) | (time > end + width_at(reference, widths, end))
    return seen


def widths_of(task: Task, reference: Reference) -> Floats:
    """By how much (s) an event may be earlier or later in another run, at each time of ``reference``, (m,).

    It is the bar of the run's errors over its speed, and two steps of an FMU that steps over events: what sticks there
    may hold for one more. A coordinate that rests tells no speed: none takes longer than the run.
    """
    q = [c.name for c in task.mechanism.coordinates]
    pace = max(reference.scales[name] / reference.scales[names.velocity(name)] for name in q)
    pace = min(pace, task.stop_time)
    widths: Floats = SAFETY * reference.growth * task.tolerance * pace + 2 * task.solver_step
    return widths


def width_at(reference: Reference, widths: Floats, t: float) -> float:
    """By how much (s) an event at ``t`` (s) may be earlier or later; ``widths`` (m,) are those of ``widths_of``."""
    row = min(int(np.searchsorted(reference.trajectory.time, t)), len(widths) - 1)
    return float(widths[row])


def lowest(task: Task, reference: Reference, t: float) -> float:
    """How high, in nominal sizes of the gap, the rebounds are that a run may leave out at the time ``t`` (s).

    An FMU that steps over events leaves out those that are not higher than what its earlier steps have made.
    """
    row = min(int(np.searchsorted(reference.trajectory.time, t)), len(reference.growth) - 1)
    return LOWER * task.tolerance * (float(reference.growth[row]) if task.solver_step else 1.0)


def most_left_out(task: Task) -> float:
    """Which part of a run need not be compared with a second one, so that the whole is judged.

    All of it where the FMU steps over events. Its errors are of first order, so that impacts soon part two right runs;
    no direct integration follows hundreds of contacts. The laws along the whole run judge the rest.
    """
    return 1.0 if task.solver_step else LEFT_OUT


def _cascades(task: Task, reference: Reference) -> Iterator[tuple[float, float]]:
    """(first time, last time), in s, of the intervals in which impacts follow that rise less than the tolerance.

    They end with a higher impact, when the contact closes, or where it does not come back. Where it closes another run
    may be in a rebound that is just as high as the tolerance.
    """
    found: dict[str, tuple[float, float]] = {}
    flights: dict[str, float] = {}  # of the last rebound that comes back, over the square root of its height
    for event in reference.events:
        if event.kind not in ("impact", "closes"):
            continue
        height = lowest(task, reference, event.time)
        begin, end = found.pop(event.element, (event.time, event.time))
        if event.kind == "impact" and event.time > end:
            yield begin, end
            begin = event.time
        if 0 < event.height < np.inf:
            flights[event.element] = event.flight / np.sqrt(event.height)
        if event.kind == "impact" and event.height <= height:
            found[event.element] = begin, event.time + FLIGHTS * event.flight
        else:
            closes = event.kind == "closes"
            yield begin, event.time + (flights.get(event.element, 0.0) * np.sqrt(height) if closes else 0.0)
    last = float(reference.trajectory.time[-1])
    yield from ((begin, min(end, last)) for begin, end in found.values())
