"""Checks that hold an FMU against the laws of mechanics along its own run, with both sides of its events."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from lag2fmu.deadline import LIMIT, OutOfTimeError, within
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.verify.agreement import SAFETY, has_rows
from lag2fmu.verify.instances import description_of
from lag2fmu.verify.laws.along import Along, needed, watched
from lag2fmu.verify.laws.events import at_events
from lag2fmu.verify.laws.points import at_points
from lag2fmu.verify.laws.residual import Accuracy, Residual
from lag2fmu.verify.laws.spans import INTEGRALS, between_points
from lag2fmu.verify.located import INNER, located
from lag2fmu.verify.report import Check
from lag2fmu.verify.run import Run
from lag2fmu.verify.scalars import scalars_of
from lag2fmu.verify.task import ROUNDING, Task

PARTS = (8, 64)
"""The times in each step, first the one number and then the other, at which an integral is looked at that seems to be
wrong: a pulse may lie between two times."""
SHARPER = 0.01
"""The tolerance of those runs, as a part of that of the run: what the interpolant of a solver step is wrong by may be
some tolerances, and goes with it; a fault stays."""
EXACT = 100.0
"""The tolerance over the error of what follows from the state alone; the error is no less than rounding."""


def accuracy_of(tolerance: float, step: float = 0.0) -> Accuracy:
    """The errors that co-simulation with this relative ``tolerance`` may have; ``step`` is that of ``Accuracy``."""
    return Accuracy(max(ROUNDING, tolerance / EXACT), tolerance, SAFETY * tolerance, step)


def law_checks(task: Task) -> Iterator[Check]:
    """A check for each law of mechanics, contact and friction; none for mechanisms without contacts and dry friction.

    An FMU without FMU states, or without some of the variables that laws speak of, cannot be judged by them.
    """
    if not has_rows(task.mechanism):
        return
    check = partial(Check, evidence="laws")
    names, step = needed(task.mechanism), task.steps[1]
    missing = sorted(set(names) - scalars_of(description_of(task.path), task.path).keys())
    options = Run(
        stop_time=task.stop_time,
        step=step,
        tolerance=task.tolerance,
        inputs=task.inputs,
        hold=task.hold,
        values=task.settings,
        outputs=names,
        warned=lambda sentence: None,
    )
    system = None if missing else _system(task)
    inner = () if task.solver_step else INNER  # steps over events have no parts
    along = None if system is None else _along(task, system, options, inner)
    if system is None or along is None:
        unseen = f"the FMU does not show {', '.join(missing)}"
        slow = f"the equations are not derived in {_limit(task):g} s of CPU time; give a longer --limit"
        why = unseen if missing else slow if system is None else "the FMU cannot go back to earlier states"
        yield check("laws along the run", 1.0, 0.0, why, extent=True)
        return
    for item in _residuals(task, system, along, options):
        yield check(item.law, item.value, item.bar, item.where, unit=item.unit)


def _residuals(task: Task, system: HybridSystem, along: Along, options: Run) -> list[Residual]:
    """What ``judged`` says ``along`` a run by ``options``; where an integral seems wrong, what finer runs say of it."""
    accuracy = accuracy_of(task.tolerance, task.solver_step)
    items = [*judged(along, accuracy, smooth=not task.holds)]
    for parts in (n for n in PARTS if n * accuracy.step <= task.steps[1]):
        if all(item.value <= item.bar for item in items if item.law in INTEGRALS):
            break
        finer_run = replace(options, step=task.steps[1] / parts, tolerance=SHARPER * task.tolerance)
        finer = _along(task, system, finer_run, ())
        better = {} if finer is None else {item.law: item for item in between_points(finer, accuracy, parts)}
        items = [better.get(item.law, item) for item in items]
    return items


def _along(task: Task, system: HybridSystem, options: Run, inner: tuple[float, ...]) -> Along | None:
    """What the laws of the ``system`` speak of along a run, with ``inner`` points of its steps.

    None where the FMU cannot go back to earlier states.
    """
    run = located(task.path, options, watched(task.mechanism), inner)
    if run is None:
        return None
    signals = task.driving(options.step or task.steps[1])
    inputs = {} if signals is None else signals.sampled(run.time)
    units = {v.name: v.unit for v in description_of(task.path).modelVariables if getattr(v, "unit", None)}
    return Along(system, run, inputs, units)


def _limit(task: Task) -> float:
    """The CPU time (s) for the equations, also where that of the direct integration is over."""
    return max(LIMIT, task.limit)


def _system(task: Task) -> HybridSystem | None:
    """The equations of the mechanism on their own path; None where they cannot be derived in time."""
    try:
        with within(_limit(task)):
            return HybridSystem(task.mechanism)
    except OutOfTimeError:
        return None


def judged(a: Along, accuracy: Accuracy, *, smooth: bool = True) -> Iterator[Residual]:
    """The worst residual of each law along ``a``, in units of the law; what is broken is beyond its bar.

    Without ``smooth`` rates may jump at every time, as those of held inputs do, and no integrals are looked at. Source:
    Ch. Glocker, Set-Valued Force Laws, Springer 2001, chapters 5 and 6.
    """
    yield from at_points(a, accuracy)
    if smooth:
        yield from between_points(a, accuracy)
    yield from at_events(a, accuracy)
