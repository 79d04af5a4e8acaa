"""What checkers say of an FMU, and how far the runs of importers are from its reference."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from lag2fmu.checking.check import check_fmu
from lag2fmu.errors import SimulationError
from lag2fmu.evidence.importers import IMPORTERS, Importer, run_by
from lag2fmu.evidence.verdict import Verdict
from lag2fmu.fmu.exported import Fmu
from lag2fmu.reference.integrated import Reference
from lag2fmu.verify.agreement import CHAOS, SAFETY, comparable, horizon_of
from lag2fmu.verify.task import Task
from lag2fmu.version import VERSION


def verdicts_of(fmu: Fmu, fmi: str, reference: Reference) -> list[Verdict]:
    """What every checker and importer says of ``fmu``, by version ``fmi`` of the standard, beside its ``reference``.

    Raises LoadError if ``fmu`` is none, or none of FMI 2.0 or 3.0.
    """
    return [_by_lag2fmu(fmu.path), _by_validator_of_fmpy(fmu.path), *_runs(fmu, fmi, reference)]


def _by_lag2fmu(path: Path) -> Verdict:
    """The rules of FMI, statically and by trials in a process of its own."""
    found = check_fmu(path)
    detail = f"{len(found.errors)} errors, {len(found.warnings)} warnings"
    return Verdict("lag2fmu check", VERSION, "static and run", "passed" if found.passed else "FAILED", detail)


def _by_validator_of_fmpy(path: Path) -> Verdict:
    """fmpy's own static checks."""
    from fmpy.validation import validate_fmu

    problems = [str(problem) for problem in validate_fmu(str(path))]
    detail = problems[0].splitlines()[0] if problems else "no problem"
    version = importlib.metadata.version("fmpy")
    return Verdict("fmpy validate", version, "static", "FAILED" if problems else "passed", detail)


def _runs(fmu: Fmu, fmi: str, reference: Reference) -> Iterator[Verdict]:
    for importer in IMPORTERS:
        reason = ""
        if not importer.installed:
            reason = "it is not installed here"
        elif fmi not in importer.versions:
            reason = f"it does not import FMI {fmi}"
        elif fmu.mechanism.hybrid and not importer.events:
            reason = "it handles no state events"
        if reason:
            yield Verdict(importer.package, importer.version, importer.kind, "not run", reason)
        else:
            yield _run(importer, fmu, reference)


def _run(importer: Importer, fmu: Fmu, reference: Reference) -> Verdict:
    """The verdict on a run of ``fmu`` by ``importer``, by the bars of ``verify.agreement``."""
    mechanism, time = fmu.mechanism, reference.trajectory.time
    task = Task(mechanism, fmu.path, float(time[-1]), mechanism.experiment.tolerance, None)
    names = list(reference.scales)
    try:
        values = run_by(importer, fmu.path, task.tolerance, time, names)
    except SimulationError as error:
        return Verdict(importer.package, importer.version, importer.kind, "FAILED", str(error))
    seen = comparable(task, reference) & (time <= horizon_of(task, reference)) & (time > 0.0)
    if not seen.any():
        return Verdict(importer.package, importer.version, importer.kind, "not run", "no two runs are comparable")
    errors = np.abs(values - reference.trajectory.columns(names)) / [reference.scales[name] for name in names]
    worst = errors[seen].max(axis=1, initial=0.0)
    bar = np.minimum(SAFETY * reference.growth[seen] * task.tolerance, CHAOS)
    until = float(time[seen][-1])
    detail = f"largest difference from the reference {worst.max():.1e} of the range, until {until:.4g} s"
    return Verdict(
        importer.package, importer.version, importer.kind, "passed" if (worst <= bar).all() else "FAILED", detail
    )
