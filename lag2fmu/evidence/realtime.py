"""The report on what a mechanism in plain C takes in real time."""

from __future__ import annotations

import re

from lag2fmu.evidence.footprint import footprints
from lag2fmu.fmu.firmware import Firmware

REPORT = "REPORT.md"

_ENUMERATION = re.compile(r"^enum \{([^}]*)\};", re.MULTILINE)
_BOUND = re.compile(r"\b(MOST_\w+) = (?:REAL_TIME \? (\d+) : \d+|(\d+))(?=[,\s]|$)")


def realtime_report(made: Firmware) -> str:
    """What ``made`` takes, as Markdown: memory, the deepest stack, code and constants on processors, bounds of loops.

    Raises BuildError with the compiler's output if it fails.
    """
    name = next(name for name in made.files if name.endswith(".c") and name != "main.c")
    found = footprints(name, made.files)
    text = made.files[name]
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
