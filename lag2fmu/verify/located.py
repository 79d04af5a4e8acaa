"""Runs of co-simulation with both sides of every event, found from outside: by steps that are taken back and halved.

FMU states are all that this needs, so it does for FMI 2.0 and 3.0. Between two communication points an event is seen by
what the FMU shows of it: a mode or a count of impacts is another one behind it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from lag2fmu.errors import SimulationError
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.apart import came_through, run_apart, runs_apart
from lag2fmu.verify.co_simulation import Inputs, Reader
from lag2fmu.verify.instances import Instance, description_of, instance_of, is_fmi3
from lag2fmu.verify.plan import planned
from lag2fmu.verify.run import Floats, Plan, Run
from lag2fmu.verify.scalars import scalars_of
from lag2fmu.verify.simulate import followed, initialize, recorder, setter

MOST_EVENTS = 200
"""The most events of a run that are seen from both sides; an event takes some 30 short steps."""
INNER = (0.5 * (3.0 - math.sqrt(5.0)),)
"""A point that divides a communication step by the golden ratio. No oscillation hides between points so uneven, as one
does between even ones whose period is the step.
"""
BRACKET = 1e-10
"""In communication steps: the distance of the two sides of an event, but no less than four roundings of the time."""


@dataclass(frozen=True)
class _Stepper:
    """What is done with an instance: record rows, set the inputs at a time (s), step from a time by a length (s).

    ``watch`` records what tells events, in a fraction of the time of a whole row.
    """

    fmu: Any
    record: Callable[[Floats], None]
    watch: Callable[[Floats], None]
    set_inputs: Callable[[float], None]
    step: Callable[[float, float], None]

    def row(self, size: int) -> Floats:
        """The present values of the recorded variables, (size,)."""
        row = np.empty(size)
        self.record(row)
        return row


def located(path: Path, run: Run, watched: list[str], inner: tuple[float, ...] = INNER) -> Trajectory | None:
    """The co-simulation ``run`` of the FMU ``path`` at its communication points and on both sides of its events.

    It is told at ``inner`` points, parts of communication steps, too. An event is where one of the ``watched``
    variables changes. None for an FMU without FMU states. Raises
    SimulationError if the run fails.
    """
    if not description_of(path).coSimulation.canGetAndSetFMUstate:
        return None

    def here(path: Path, run: Run) -> Trajectory:
        return _located(path, run, watched, inner)

    if not runs_apart(path):
        return here(path, run)
    found = run_apart(path, run, here)
    came_through(path)
    return found


def _located(path: Path, run: Run, watched: list[str], inner: tuple[float, ...]) -> Trajectory:
    description = description_of(path)
    plan = planned(description, scalars_of(description, path), run)
    asked = followed(plan) if is_fmi3(description) else ()
    with instance_of(path, "CoSimulation", followed=asked) as instance:
        try:
            stepper = (_of_fmi3 if is_fmi3(description) else _of_fmi2)(instance, run, plan, watched)
            time, values = _followed(stepper, plan, [plan.names.index(name) for name in watched], inner)
        except Exception as error:  # fmpy raises bare exceptions
            raise SimulationError(
                f"'{path.name}': the simulation failed: {str(error).rstrip('.')}; {instance.log.tail()}"
            ) from error
    return Trajectory(np.array(time), tuple(plan.names), np.array(values))


def _of_fmi2(instance: Instance, run: Run, plan: Plan, watched: list[str]) -> _Stepper:
    initialize(instance, run, plan)
    fmu, references = instance.fmu, {v.name: v.valueReference for v in instance.description.modelVariables}

    def step(t: float, length: float) -> None:
        fmu.fmi2DoStep(fmu.component, t, length, 0)

    record, watch = (recorder(instance, part, references) for part in (plan, replace(plan, names=watched)))
    return _Stepper(fmu, record, watch, setter(instance, plan, references), step)


def _of_fmi3(instance: Instance, run: Run, plan: Plan, watched: list[str]) -> _Stepper:
    initialize(instance, run, plan)

    def step(t: float, length: float) -> None:
        instance.fmu.doStep(t, length, noSetFMUStatePriorToCurrentPoint=False)

    inputs = Inputs(instance, run, plan)
    record, watch = (Reader(instance.fmu, plan.scalars, seen).read for seen in (plan.names, watched))
    return _Stepper(instance.fmu, record, watch, inputs.begin, step)


def _followed(
    stepper: _Stepper, plan: Plan, watched: list[int], inner: tuple[float, ...]
) -> tuple[list[float], list[Floats]]:
    """The times (s) and rows (outputs,) of the whole run, with ``inner`` points of communication steps."""
    points, events = plan.points.tolist(), 0
    time, values = [points[0]], [stepper.row(len(plan.names))]
    for begin, end in pairwise(points):
        stepper.set_inputs(begin)
        for goal in [begin + part * (end - begin) for part in inner] + [end]:
            while time[-1] < goal:
                side = _Side(time[-1], values[-1])
                found = _passed(stepper, plan, side, goal, watched if events < MOST_EVENTS else [])
                events += len(found) > 1
                time += [side.time for side in found]
                values += [side.row for side in found]
    return time, values


@dataclass(frozen=True)
class _Side:
    """A ``row`` (outputs,) at a ``time`` (s)."""

    time: float
    row: Floats


def _passed(stepper: _Stepper, plan: Plan, start: _Side, end: float, watched: list[int]) -> list[_Side]:
    """Go on from ``start`` to ``end`` (s), or to the first event between them, of which both sides are told.

    The side before an event is ``start`` itself if the event follows at once.
    """
    fmu, width = stepper.fmu, max(BRACKET * float(plan.grid[1] - plan.grid[0]), 4 * float(np.spacing(end)))
    marks = np.empty(len(watched))

    def passes(begin: float, end: float) -> bool:
        """Step from ``begin`` to ``end``; whether there is an event between them."""
        if plan.pieces is not None:  # inputs that are held were set where the communication step began
            stepper.set_inputs(begin)
        stepper.step(begin, end - begin)
        if watched:
            stepper.watch(marks)
        return bool((marks != start.row[watched]).any())

    left, right, state = start.time, end, fmu.getFMUState()
    try:
        if not passes(left, right):
            return [_Side(right, stepper.row(len(plan.names)))]
        while right - left > width:
            fmu.setFMUState(state)
            middle = (left + right) / 2
            if passes(left, middle):
                right = middle
            else:
                fmu.freeFMUState(state)
                left, state = middle, fmu.getFMUState()
        fmu.setFMUState(state)
        before = [_Side(left, stepper.row(len(plan.names)))] if left > start.time else []
        passes(left, right)
        return [*before, _Side(right, stepper.row(len(plan.names)))]
    finally:
        fmu.freeFMUState(state)
