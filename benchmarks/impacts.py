"""A run over 1000 impacts, beside the same arcs one by one and beside event detection in heyoka and SciPy.

Run with `make bench` or `python -m benchmarks.impacts`. Nothing is lost in the impacts (e = 1). A ball bounces, a
pendulum hits a stop straight below its pivot, and so does the first link of chains of two and six. The programs are
compiled as FMUs are. "the arcs" is the CPU time of the same solver in the same mechanism without contacts, which starts
at what the run had after an impact and goes on to the next one, again and again, with the length of step that it has
come to. "anew" is the same where each arc is a run of its own, which finds the length of its first step. The bar: the
run takes at most 1.3 times as long as its arcs one by one, each begun anew. With the length of step handed on from arc
to arc, no run of the ball could be as short: its arc is one step, and a step that meets an impact is taken twice, once
to see the impact and once to end there, with three more evaluations for the interpolant and two to polish. Peers stop
at each impact by a terminal event and reverse the velocity; heyoka's compiler is not counted. The error is that of the
time of the last impact.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from benchmarks.running import KERNELS
from lag2fmu.dynamics import derive, lower
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import FLAGS, compiler_command
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.fmu.translation_units import translation_units
from lag2fmu.formats.loading import load, with_values
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism import Mechanism, Stop

IMPACTS = 1000
TOLERANCE = 1e-9
SOLVER = "dop853"
REPETITIONS, ROUNDS = 5, 5
G = 9.81


@dataclass(frozen=True)
class Case:
    """A mechanism with impacts that lose nothing, and the time (s) of a run in which about IMPACTS of them lie.

    Where the motion repeats itself: the ``period`` (s) from impact to impact, how the coordinate is accelerated, and
    its first value; the coordinate stays positive.
    """

    name: str
    mechanism: Mechanism
    stop: float
    period: float | None = None
    acceleration: str = ""
    first: float = 0.0


def cases() -> list[Case]:
    """The mechanisms; those whose motion repeats itself first."""
    bounce = float(2 * np.sqrt(2 / G))
    swing = float(2 * ellipk(np.sin(1.0) ** 2) / np.sqrt(G))
    ball = with_values(load("bouncing_ball"), {"e": 1.0})
    pendulum = with_values(load("pendulum_with_stop"), {"e": 1.0})
    return [
        Case("ball", ball, IMPACTS * bounce, bounce, f"-{G}", 1.0),
        Case("pendulum", pendulum, IMPACTS * swing, swing, f"-{G}*sin(x)", 2.0),
        Case("double pendulum", chain(2), 600.0),
        Case("chain of 6", chain(6), 600.0),
    ]


def chain(links: int) -> Mechanism:
    """Links in a chain, the first of which hits a stop straight below the pivot."""
    plain = load("n_pendulum", {"n": links})
    return replace(plain, stops=(Stop("wall", symbol(plain.coordinates[0].name), lower=0, restitution=1),))


def build(mechanism: Mechanism, solver: str, place: Path) -> Path:
    """The program of kernels/impacts.c for ``mechanism``, compiled as an FMU is."""
    equations = derive(mechanism)
    _, sources = describe(equations.mechanism, equations, lower(equations), solver)
    place.mkdir(parents=True)
    for name, text in sources.items():
        (place / name).write_text(text, "utf-8")
    joined = translation_units(sources)
    for name, text in joined.items():
        (place / name).write_text(text, "utf-8")
    flags = [flag for flag in FLAGS if flag != "-fPIC"]
    files = [*(str(place / unit) for unit in joined), str(KERNELS / "impacts.c")]
    zig = compiler_command("zig", host_platform().targets[0])
    command = [*zig, *flags, f"-I{place}", f"-I{fmi_headers()}", *files, "-lm", "-o", str(place / "host")]
    subprocess.run(command, check=True)
    return place / "host"


def run(host: Path, mode: str, stop: float, arcs: str = "") -> str:
    """What the program prints."""
    command = [str(host), mode, repr(TOLERANCE), repr(stop), *([] if mode == "record" else [str(REPETITIONS)])]
    return subprocess.run(command, input=arcs, check=True, capture_output=True, text=True).stdout


@dataclass(frozen=True)
class Cost:
    """CPU time (us) of a run, of its arcs and of its arcs with first steps of their own, and the times (s) of ends."""

    whole: float
    parts: float
    anew: float
    ends: tuple[float, ...]


def ours(case: Case, folder: Path) -> Cost:
    """A run in C and its arcs, each the least of REPETITIONS in each of some rounds, in which all take turns."""
    host = build(case.mechanism, SOLVER, folder / case.name)
    bare = build(replace(case.mechanism, contacts=(), stops=()), SOLVER, folder / f"{case.name}, arcs")
    arcs = run(host, "record", case.stop)
    ends = tuple(float(line.split()[0]) for line in arcs.splitlines())
    turns = ((host, "run"), (bare, "arcs"), (bare, "anew"))
    taken = [[float(run(program, mode, case.stop, arcs).split()[0]) for program, mode in turns] for _ in range(ROUNDS)]
    whole, parts, anew = (min(times) for times in zip(*taken, strict=True))
    return Cost(whole, parts, anew, ends)


# -------------------------------------------------------------------------------------------------------------- peers


def last_impact(case: Case) -> float:
    """The time of the last impact in closed form: the motion begins between two of them."""
    assert case.period is not None
    return (IMPACTS - 0.5) * case.period


def scipys(case: Case) -> tuple[float, float]:
    """CPU time (us) of SciPy's DOP853 with a terminal event, and the error (s) of the last impact's time."""
    right = eval(f"lambda t, y: (y[1], {case.acceleration.replace('sin', 'np.sin').replace('x', 'y[0]')})", {"np": np})

    def wall(t: float, y: np.ndarray) -> float:
        return float(y[0])

    wall.terminal, wall.direction = True, -1.0  # type: ignore[attr-defined]
    begin = time.process_time()
    now, state = 0.0, [case.first, 0.0]
    for _ in range(IMPACTS):
        arc = solve_ivp(right, (now, case.stop), state, "DOP853", events=wall, rtol=TOLERANCE, atol=TOLERANCE)
        now, state = float(arc.t[-1]), [0.0, -float(arc.y[1, -1])]
    return 1e6 * (time.process_time() - begin), abs(now - last_impact(case))


def heyokas(case: Case) -> tuple[float, float]:
    """The same of heyoka's Taylor series with a terminal event."""
    import heyoka

    x, v = heyoka.make_vars("x", "v")
    rate = eval(case.acceleration, {"x": x, "sin": heyoka.sin}) + 0.0 * x
    hits: list[float] = []

    def bounce(integrator: heyoka.taylor_adaptive, sign: int) -> bool:  # type: ignore[name-defined]
        hits.append(integrator.time)
        integrator.state[1] = -integrator.state[1]
        return True

    event = heyoka.t_event(x, callback=bounce, direction=heyoka.event_direction.negative)
    integrator = heyoka.taylor_adaptive([(x, v), (v, rate)], [case.first, 0.0], t_events=[event], tol=TOLERANCE)
    begin = time.process_time()
    integrator.propagate_until(case.stop)
    cost = 1e6 * (time.process_time() - begin)
    return cost, abs(hits[IMPACTS - 1] - last_impact(case))


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0]).parse_args()
    table = Table(title=f"CPU time an impact (us), tolerance {TOLERANCE:g}, solver {SOLVER}", title_justify="left")
    for heading in (
        "",
        "impacts",
        "the run",
        "the arcs",
        "ratio",
        "anew",
        "ratio",
        "error (s)",
        "heyoka",
        "error (s)",
        "SciPy",
        "error (s)",
    ):
        table.add_column(heading, justify="right" if heading else "left")
    with tempfile.TemporaryDirectory() as folder:
        for case in cases():
            table.add_row(case.name, *_row(case, ours(case, Path(folder))))
    Console(width=140).print(table)


def _row(case: Case, cost: Cost) -> list[str]:
    count = len(cost.ends) - 1  # the last arc ends with the run
    cells = [str(count), f"{cost.whole / count:.2f}"]
    for arcs in (cost.parts, cost.anew):
        cells += [f"{arcs / count:.2f}", f"{cost.whole / arcs:.2f}"]
    if case.period is None:
        return cells
    cells.append(f"{abs(cost.ends[IMPACTS - 1] - last_impact(case)):.0e}")
    for peer in (heyokas, scipys):
        try:
            taken, error = peer(case)
            cells += [f"{taken / IMPACTS:.2f}", f"{error:.0e}"]
        except ImportError as absent:
            cells += [f"no {absent.name}", ""]
    return cells


if __name__ == "__main__":
    main()
