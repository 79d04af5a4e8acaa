"""Runs that tell what is doubtful in them: of ``simulate``, and of an FMU that was just exported."""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from lag2fmu.errors import Lag2FmuError
from lag2fmu.fmu.contents import read_mechanism
from lag2fmu.fmu.materials import solver_inside
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.doubts import DoubtWatch
from lag2fmu.verify.instances import description_of, state_of
from lag2fmu.verify.plan import recorded
from lag2fmu.verify.run import Run
from lag2fmu.verify.scalars import scalars_of
from lag2fmu.verify.simulate import simulate_fmu

PATIENCE = 5.0
"""The most seconds that an export waits for a run of the FMU."""

_LOGGER = logging.getLogger("lag2fmu")


def watch_of(mechanism: Mechanism) -> DoubtWatch | None:
    """What is looked at in runs of ``mechanism``; None where nothing can be doubtful, or nothing can be derived."""
    if not mechanism.held:
        return None
    try:
        return DoubtWatch(mechanism)
    except Lag2FmuError:  # an older version exported what this one refuses
        return None


def watched(path: Path, run: Run, mechanism: Mechanism | None = None) -> Trajectory:
    """What ``simulate_fmu`` gives; what is doubtful in the run of the FMU ``path`` is told as its warnings are.

    ``mechanism`` is that of the FMU where it is at hand; otherwise it is read from the FMU.
    """
    watch = _watch_inside(path, state_of(path)) if mechanism is None else watch_of(mechanism)
    if watch is None or not watch.outputs:
        return simulate_fmu(path, run)
    found = simulate_fmu(path, replace(run, beside=[*dict.fromkeys((*run.beside, *watch.outputs))]))
    for doubt in watch.doubts(found, run.tolerance, run.values or {}, solver_inside(path)):
        _LOGGER.warning("warning: %s", doubt)
    wanted = len(recorded(run, scalars_of(description_of(path), path)))
    return Trajectory(found.time, found.names[:wanted], found.values[:, :wanted])


@lru_cache(maxsize=4)
def _watch_inside(path: Path, state: tuple[object, ...]) -> DoubtWatch | None:
    """What is looked at in runs of the FMU ``path``, as long as the file is in this ``state``.

    None where nothing can be doubtful, or where it carries no mechanism that can be read.
    """
    try:
        return watch_of(read_mechanism(path))
    except Lag2FmuError:  # of another tool, or in words of another version
        return None


def doubts_of(mechanism: Mechanism, path: Path) -> list[str]:
    """Sentences on what is doubtful in the default run of the FMU ``path`` of ``mechanism``.

    A run that fails is told. One that takes longer than PATIENCE is not waited for.
    """
    watch, begun = watch_of(mechanism), time.monotonic()
    if watch is None or not set(watch.outputs) <= scalars_of(description_of(path), path).keys():
        return []

    def reached(_: float) -> None:
        if time.monotonic() - begun > PATIENCE:
            raise _EnoughError

    tolerance = mechanism.experiment.tolerance
    warned: list[str] = []
    try:
        run = simulate_fmu(
            path, Run(outputs=watch.outputs, tolerance=tolerance, progress=reached, warned=warned.append)
        )
    except _EnoughError:
        return []
    except Lag2FmuError as error:
        return [f"the default run does not come to its end: {error}"]
    return list(watch.doubts(run, tolerance, {}, solver_inside(path)))


class _EnoughError(BaseException):
    """Ends a run that takes too long; no error of the FMU, so that nothing else catches it."""
