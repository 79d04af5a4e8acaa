"""Impacts and dry friction with closed forms, beside tools that know contacts: error, and CPU time.

Run with `make published` or `python -m benchmarks.nonsmooth [CASE ...]`. The cases are of Siconos's tutorials, block
and rocking with other values: a ball falls from 1 m and loses a tenth of its velocity in each impact (its height at 3
s); a block with 3 m/s slides to rest on a plane with friction 0.3 (its place at 2 s); Housner's block rocks on its
edges (its angle at 1 s); Glocker's woodpecker hops down its pole (height of the sleeve at 0.3 s); a cam of four arcs at
358 rpm throws its follower off (its place at 1 s); a four-bar linkage with clearance in three joints is let go (angle
of the crank at 0.5 s, with no controller, and the coupler 1 mm and the rocker 1.5 mm lower than there, since a pin in
the middle of its bush has no direction of contact); ten beads fall in a column on a floor and on each other (height of
the last one at 0.8 s, after 113 impacts).

Truth is a closed form for ball, block, rocking and column: parabolas between impacts, and Housner's equation of the
turning block. For woodpecker, cam and clearance it is the independent path of lag2fmu, and smaller steps of Siconos
come nearer to it (cam: 1.7e-4 m at 1e-6 s). The others take fixed steps; a tool is looked for in the interpreters of
the variable PEERS, in this one, and in the system's. CPU time of lag2fmu is that of fmpy and the FMU with loading, that
of the others of their steps alone. Exudyn is given the force of friction, the others find it.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.contact_peers import BEADS, END, TILT, TOOLS, G
from benchmarks.stranger import model_of, run
from lag2fmu.formats.loading import load
from lag2fmu.reference import integrate

SCRIPT = Path(__file__).with_name("contact_peers.py")
STEPS = (1e-2, 1e-3, 1e-4, 1e-5)
PROBLEMS = {
    "ball": ("ball", "z", "m"),
    "block": ("block", "x", "m"),
    "rocking": ("rocking_block", "theta", "rad"),
    "woodpecker": ("woodpecker", "y", "m"),
    "cam": ("cam_follower", "q", "m"),
    "clearance": ("four_bar_with_clearance", "a", "rad"),
    "column": ("column_of_beads", "z9", "m"),
}
"""{case: (its problem or model, the state that is asked for, its unit)}"""


def ball() -> float:
    """The height (m) of the ball: parabolas between impacts."""
    left, speed = END["ball"] - np.sqrt(2 / G), 0.9 * np.sqrt(2 * G)
    while left > 2 * speed / G:
        left -= 2 * speed / G
        speed *= 0.9
    return float(speed * left - G * left**2 / 2)


def rocking() -> float:
    """The angle (rad) of the rocking block: Housner's equation about an edge, and what impacts leave of the rate."""
    diagonal, alpha = np.hypot(0.1, 0.4), np.arctan2(0.1, 0.4)

    def slope(_: float, state: list[float]) -> list[float]:
        return [state[1], -0.75 * G / diagonal * np.sin(alpha - state[0])]

    def flat(_: float, state: list[float]) -> float:
        return state[0]

    flat.terminal, flat.direction = True, -1.0  # type: ignore[attr-defined]
    time, state, side = 0.0, [TILT, 0.0], 1.0
    while True:
        part = solve_ivp(slope, (time, END["rocking"]), state, "DOP853", events=flat, rtol=1e-13, atol=1e-15)
        if part.status == 0:
            return float(side * part.y[0, -1])
        time, side = part.t[-1], -side
        state = [0.0, -(1 - 1.5 * np.sin(alpha) ** 2) * part.y[1, -1]]


def column() -> float:
    """The height (m) of the last bead: from impact to impact, the relative motions of beads are uniform."""
    z, v, left = 1 + 0.25 * np.arange(BEADS), np.zeros(BEADS), END["column"]
    while True:
        gaps, rates = np.diff(z) - 0.2, np.diff(v)
        waits = np.array([-gap / rate if rate < 0 else np.inf for gap, rate in zip(gaps, rates, strict=True)])
        fall = float(v[0] + np.sqrt(max(v[0] ** 2 + 2 * G * (z[0] - 0.1), 0))) / G
        first = int(np.argmin(waits))
        step = min(left, fall, waits[first])
        z, v, left = z + v * step - G * step**2 / 2, v - G * step, left - step
        if left == 0:
            return float(z[-1])
        if fall <= waits[first]:
            v[0] *= -0.9
        else:
            mean, half = (v[first] + v[first + 1]) / 2, 0.9 * (v[first] - v[first + 1]) / 2
            v[first], v[first + 1] = mean - half, mean + half


def independent(case: str) -> float:
    """The value at the end by the independent path."""
    name, state, _ = PROBLEMS[case]
    return float(integrate(load(model_of(name)), [0.0, END[case]]).trajectory[state][-1])


CLOSED = {"ball": ball, "block": lambda: 9.0 / (2 * 0.3 * G), "rocking": rocking, "column": column}


def exact(case: str) -> float:
    """What the case is asked for, in closed form where there is one."""
    return CLOSED[case]() if case in CLOSED else independent(case)


def interpreters() -> list[str]:
    """Interpreters in which tools are looked for."""
    asked = [path for path in os.environ.get("PEERS", "").split(os.pathsep) if path]
    system = [path for path in (shutil.which("python3"), "/usr/bin/python3") if path and Path(path).exists()]
    return list(dict.fromkeys([*asked, sys.executable, *system]))


def peer(tool: str, case: str, step: float) -> tuple[float, float] | str:
    """The value and the CPU time (s) of a tool, or why there is none."""
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


def rows(case: str) -> tuple[list[str], bool]:
    """The lines of a case in the table, in Markdown, and whether another tool has an error as small as lag2fmu's."""
    truth, (name, state, unit) = exact(case), PROBLEMS[case]
    ours = run(name, END[case], 0.01)
    error = abs(float(ours.trajectory[state][-1]) - truth)
    lines = [f"| {case} ({unit}) | lag2fmu | by error control | {error:.1e} | {1000 * ours.seconds:.1f} |"]
    reached = False
    for tool in TOOLS:
        for step in STEPS:
            found = peer(tool, case, step)
            if isinstance(found, str):
                lines.append(f"| {case} | {tool} | | {found} | |")
                break
            theirs = abs(found[0] - truth)
            reached = reached or theirs <= error
            lines.append(f"| {case} | {tool} | {step:g} | {theirs:.1e} | {1000 * found[1]:.1f} |")
    return lines, reached


def section(cases: list[str]) -> str:
    """The section of docs/published.md."""
    title, *paragraphs = (__doc__ or "").split("\n\n")
    prose = "\n\n".join(" ".join(part.split()) for part in paragraphs)
    head = "| case | tool | step (s) | error | CPU time (ms) |\n|---|---|---|---|---|"
    found = {case: rows(case) for case in cases}
    table = "\n".join(line for lines, _ in found.values() for line in lines)
    met = [case for case, (_, reached) in found.items() if reached]
    equal = (
        f"As small an error as that of lag2fmu is met by others in: {', '.join(met) or 'no case'}. In the other cases "
        "their CPU time at equal error is beyond that of their smallest step here."
    )
    return f"## {title.split(':')[0]}\n\n{prose}\n\n{head}\n{table}\n\n{equal}\n"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help=" ".join(PROBLEMS))
    print(section(parser.parse_args().cases or [*PROBLEMS]))
