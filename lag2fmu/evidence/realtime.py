"""The report on what a mechanism in plain C takes in real time."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from lag2fmu.evidence.accuracy import KNOWN, TIGHT, Errors, errors_of
from lag2fmu.evidence.counting import Counted, counted
from lag2fmu.evidence.footprint import footprints
from lag2fmu.fmu.firmware import Firmware

REPORT = "REPORT.md"

_ENUMERATION = re.compile(r"^enum \{([^}]*)\};", re.MULTILINE)
_BOUND = re.compile(r"\b(MOST_\w+) = (?:REAL_TIME \? (\d+) : \d+|(\d+))(?=[,\s]|$)")


MOST_ROWS = 20
"""The most outputs whose errors are listed."""


def realtime_report(made: Firmware, in_double: Firmware | None = None) -> str:
    """What ``made`` takes, as Markdown: memory, the deepest stack, code and constants on processors, bounds of loops.

    It has the operations and instructions of steps over the experiment, and the errors of the run: those of steps of
    fixed length, and those of numbers of type float against the same mechanism ``in_double``, None where ``made`` is.
    Raises BuildError with the compiler's output if it fails.
    """
    name = next(name for name in made.files if name.endswith(".c") and name != "main.c")
    found = footprints(name, made.files)
    text = made.files[name]
    taken = counted(made)
    double = taken if in_double is None else counted(in_double, instructions=False)
    count = made.bound.solver_steps
    lines = [
        f"# What {name.removesuffix('.c')} takes in real time",
        "",
        f"- numbers: {made.real}; solver {made.solver}",
        f"- a step: {made.bound.longest:g} s at most, {count} solver step{'s' if count > 1 else ''} in it",
        f"- memory of an instance: {made.size} bytes with 64-bit pointers; nothing else is allocated",
        "",
        "| processor | code, bytes | constants, bytes | deepest stack, bytes |",
        "|---|---|---|---|",
        *(f"| {f.processor} | {f.code} | {f.constants} | {f.stack} |" for f in found),
        "",
        "Code is that of the whole file; a linker with `--gc-sections` leaves out what is not called. The C library,",
        "and the compiler's own functions where a processor lacks an operation, are not in these numbers.",
        "",
        f"Deepest path, {found[0].processor}: {' > '.join(found[0].path)}",
        "",
        *_steps(taken),
        *_accuracy(made, errors_of(made, taken.values, double.values)),
    ]
    bounds = sorted(
        (bound, int(bounded or other))
        for block in _ENUMERATION.findall(text)
        for bound, bounded, other in _BOUND.findall(block)
        if re.search(rf"(for|while) \(.*<=? {bound}\b", text)
    )
    if bounds:
        lines += ["| iterations end after | times |", "|---|---|", *(f"| {b} | {number} |" for b, number in bounds), ""]
    return "\n".join(lines)


def _steps(taken: Counted) -> list[str]:
    """What steps took, as lines of Markdown."""
    rows = {"floating-point operations": taken.operations}
    rows |= {} if taken.instructions is None else {"instructions": taken.instructions}
    lines = [f"| one of {len(taken.operations)} steps, this machine | least | median | most |", "|---|---|---|---|"]
    lines += [
        f"| {name} | {' | '.join(f'{value:.0f}' for value in _spread(counts))} |" for name, counts in rows.items()
    ]
    if taken.instructions is None:
        return [*lines, "", "Instructions were not counted: valgrind is not on this machine.", ""]
    return [*lines, ""]


def _spread(counts: NDArray[np.float64]) -> tuple[float, float, float]:
    """The least, median and greatest of ``counts`` (steps,)."""
    return float(counts.min()), float(np.median(counts)), float(counts.max())


def _accuracy(made: Firmware, errors: Errors) -> list[str]:
    """The errors of the run, as lines of Markdown."""
    columns = {"greatest value": [f"{value:.3g}" for value in errors.values]}
    if errors.steps is None:
        lines = [f"Errors of the steps are not known: {errors.why}"]
    else:
        columns["error of the steps"] = [*map(_error, errors.steps, errors.values)]
        lines = [f"Errors of the steps are the greatest differences to a run with the tolerance {TIGHT:g}."]
    if errors.real is not None:
        columns["error of float"] = [f"{value:.3g}" for value in errors.real]
        lines.append("Those of float are the greatest differences to the same steps in double.")
    names = [f"{name}, {unit}" if unit else name for name, unit in made.outputs.items()]
    rows = [f"| {' | '.join(row)} |" for row in zip(names, *columns.values(), strict=True)]
    more = len(rows) - MOST_ROWS
    lines += [f"{more} further outputs are left out."] if more > 0 else []
    return [
        f"| {' | '.join(['output', *columns])} |",
        "|---|" + "---|" * len(columns),
        *rows[:MOST_ROWS],
        "",
        *lines,
        "",
    ]


def _error(error: float, value: float) -> str:
    """An error of the steps; it is not known where it is as small as those of the run that it is measured against."""
    least = KNOWN * value
    return f"{error:.3g}" if error >= least else f"below {least:.1g}"
