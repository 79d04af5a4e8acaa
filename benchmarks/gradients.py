"""What a gradient by adjoints costs, in runs, over many parameters: a chain of 40 links whose masses are all free.

Each link has bobs of its own along its rod, with masses and places, a length, a damper and a spring in its hinge. Run
``python benchmarks/gradients.py``.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from sympy import Add, cos, sin

from lag2fmu.mechanism import Body, Damper, Mechanism, Spring, coordinate, parameter
from lag2fmu.studies.library import compiled
from lag2fmu.studies.requests import scale_of
from lag2fmu.studies.tape import Tape


def chain(links: int = 40, bobs: int = 11) -> Mechanism:
    """A chain of ``links`` with 2 ``bobs`` + 3 parameters each, and gravity."""
    g = parameter("g", 9.81, "m/s2")
    parameters, bodies, springs, dampers, angles = [g], [], [], [], []
    x, y, above = [], [], 0
    for i in range(1, links + 1):
        length = parameter(f"l{i}", 0.5 + 0.01 * i, "m")
        damping = parameter(f"d{i}", 0.02, "N*m*s/rad")
        stiffness = parameter(f"k{i}", 0.1, "N*m/rad")
        parameters += [length, damping, stiffness]
        angle = coordinate(f"theta{i}", "rad", start=0.3)
        angles.append(angle)
        for j in range(1, bobs + 1):
            mass = parameter(f"m{i}_{j}", 1.0 / bobs, "kg")
            part = parameter(f"a{i}_{j}", j / bobs, "1")
            parameters += [mass, part]
            place = (Add(*x, part * length * sin(angle)), Add(*y, -part * length * cos(angle)))
            bodies.append(Body(f"bob{i}_{j}", mass, place))
        x.append(length * sin(angle))
        y.append(-length * cos(angle))
        springs.append(Spring(f"spring{i}", stiffness=stiffness, elongation=angle - above))
        rate = angle.dot - (above.dot if i > 1 else 0)
        dampers.append(Damper(f"damper{i}", damping=damping, rate=rate))
        above = angle
    return Mechanism(
        "chain", coordinates=angles, parameters=parameters, bodies=bodies, springs=springs, dampers=dampers, gravity=g
    )


def seconds(work: Callable[[], object], rounds: int = 20) -> float:
    """The least time (s) of ``rounds`` rounds."""
    best = np.inf
    for _ in range(rounds):
        begun = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - begun)
    return float(best)


def costs(links: int = 40, bobs: int = 11, stop: float = 2.0, solver: str | None = None) -> tuple[int, float, float]:
    """(number of parameters, seconds of a run, seconds of a run with the gradient of its last states)."""
    library = compiled(chain(links, bobs), solver=solver, adjoints=True)
    over = [name for name, kind in library.kinds.items() if kind == "VARIABLE_PARAMETER"]
    outputs = library.readable([f"theta{i}" for i in range(1, links + 1)])
    seeds = [(library.settable(name), scale_of(library, name, {})) for name in over]
    plain, tape = Tape(library, 0), Tape(library, len(over))
    times, weights = np.array([stop]), np.ones((1, links))

    def gradient() -> None:
        _, reason = tape.record({}, times, outputs, tolerance=1e-8, seeds=seeds)
        found, why = tape.gradient(weights)
        assert [reason, why] == ["", ""]
        assert np.isfinite(found).all()

    run = seconds(lambda: plain.record({}, times, outputs, tolerance=1e-8))
    return len(over), run, seconds(gradient)


if __name__ == "__main__":
    for solver in ("dopri5", "dop853"):
        count, run, both = costs(*map(int, sys.argv[1:]), solver=solver)
        print(f"{solver}: {count} parameters, a run {run:.3f} s, with the gradient {both:.3f} s: {both / run:.1f} runs")
