"""Impacts and dry friction with closed forms, beside tools that know contacts: error, and CPU time.

Run with `make published` or `python -m benchmarks.nonsmooth`. A ball falls from 1 m and loses a tenth of its velocity
in each impact (its height at 3 s); a block with 3 m/s slides to rest on a plane with friction 0.3 (its place at 2 s).
The others take fixed steps; a tool is looked for in the interpreters of the variable PEERS, in this one, and in the
system's. CPU time of lag2fmu is that of fmpy and the FMU with loading, that of the others of their steps alone. Exudyn
is given the force of friction, the others find it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.contact_peers import END, TOOLS, G
from benchmarks.stranger import run

SCRIPT = Path(__file__).with_name("contact_peers.py")
STEPS = (1e-2, 1e-3, 1e-4)
STATES = {"ball": "z", "block": "x"}


def exact(case: str) -> float:
    """Height or place (m) at the end, in closed form."""
    if case == "block":
        return 9.0 / (2 * 0.3 * G)
    left, speed = END["ball"] - np.sqrt(2 / G), 0.9 * np.sqrt(2 * G)
    while left > 2 * speed / G:
        left -= 2 * speed / G
        speed *= 0.9
    return float(speed * left - G * left**2 / 2)


def interpreters() -> list[str]:
    """Interpreters in which tools are looked for."""
    asked = [path for path in os.environ.get("PEERS", "").split(os.pathsep) if path]
    system = [path for path in (shutil.which("python3"), "/usr/bin/python3") if path and Path(path).exists()]
    return list(dict.fromkeys([*asked, sys.executable, *system]))


def peer(tool: str, case: str, step: float) -> tuple[float, float] | str:
    """The value (m) and the CPU time (s) of a tool, or why there is none."""
    said = "not installed"
    for interpreter in interpreters():
        words = [interpreter, str(SCRIPT), tool, case, repr(step)]
        done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=SCRIPT.parent.parent.parent)
        if done.returncode == 0:
            value, seconds = done.stdout.split()[-2:]
            return float(value), float(seconds)
        last = (done.stderr.strip().splitlines() or [""])[-1]
        said = said if "ModuleNotFoundError" in last else last
    return said


def rows() -> Iterator[str]:
    """The lines of the table, in Markdown."""
    for case, state in STATES.items():
        truth = exact(case)
        ours = run(case, END[case], 0.01)
        value = float(ours.trajectory[state][-1])
        yield f"| {case} | lag2fmu | by error control | {abs(value - truth):.1e} | {1000 * ours.seconds:.1f} |"
        for tool in TOOLS:
            for step in STEPS:
                found = peer(tool, case, step)
                if isinstance(found, str):
                    yield f"| {case} | {tool} | | {found} | |"
                    break
                yield f"| {case} | {tool} | {step:g} | {abs(found[0] - truth):.1e} | {1000 * found[1]:.1f} |"


def section() -> str:
    """The section of docs/published.md."""
    title, *paragraphs = (__doc__ or "").split("\n\n")
    prose = "\n\n".join(" ".join(part.split()) for part in paragraphs)
    head = "| case | tool | step (s) | error (m) | CPU time (ms) |\n|---|---|---|---|---|"
    return f"## {title.split(':')[0]}\n\n{prose}\n\n{head}\n" + "\n".join(rows()) + "\n"


if __name__ == "__main__":
    print(section())
