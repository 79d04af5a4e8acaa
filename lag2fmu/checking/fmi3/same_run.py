"""A trial of co-simulation with and without Event Mode: an event is the same, whoever handles it."""

from __future__ import annotations

from collections.abc import Iterator
from time import monotonic

from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.binding import Manner
from lag2fmu.checking.fmi3.session import Model3

_MOST_STEPS = 80
_PATIENCE = 3.0
"""Time (s) for a run."""
_BAR = 1e-3
"""Of the greatest value of an output and 1: steps that begin at events differ by the solver's error, which events
amplify."""

Rows = list[tuple[float, list[float]]]


def same_run(model: Model3) -> Iterator[Finding]:
    """Outputs at communication points do not depend on whether the FMU or the importer handles events.

    A run with Event Mode returns early at events; without early return events may wait for the end of a step.
    Source: FMI 3.0.2 specification, section 4.2.1 (eventModeUsed, earlyReturnAllowed).
    """
    if model.kind != "CoSimulation" or not (model.can("hasEventMode") and model.can("mightReturnEarlyFromDoStep")):
        return
    inside, outside = (_run(model, Manner(events=by, early=by)) for by in (False, True))
    names = [(v, i) for v in model.outputs for i in range(v.size)]
    for column, (v, i) in enumerate(names):
        size = max([1.0, *(abs(row[column]) for _, row in inside)])
        for (t, alone), (_, led) in zip(inside, outside, strict=False):
            if not abs(alone[column] - led[column]) <= _BAR * size:
                element = f", element {i + 1}," if v.size > 1 else ""
                problem = (
                    f"{element} is {alone[column]:.9g} at t = {t:.9g} s without Event Mode, {led[column]:.9g} with"
                )
                yield Finding("event-run", v.place, problem.lstrip(", "), "let an event do the same in both", "warning")
                return


def _run(model: Model3, manner: Manner) -> Rows:
    """Times (s) and outputs after each step; shorter if the FMU ends the run or time is up."""
    rows: Rows = []
    begun = monotonic()
    with model.session(manner=manner) as session:
        session.start()
        while len(rows) < _MOST_STEPS and monotonic() < begun + _PATIENCE and session.step():
            rows.append((session.time, session.numbers(model.outputs)))
    return rows
