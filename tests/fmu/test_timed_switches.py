"""Conditions of the time alone: every root is met, however short the pulses and whatever the communication step."""

from __future__ import annotations

import random
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, minimize_scalar

from lag2fmu import simulate
from lag2fmu.errors import SimulationError
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference import integrate

pytestmark = pytest.mark.fmu

STOP = 0.2
SAMPLES = 200_001
"""The fastest condition turns at 2000 rad/s, so that these resolve it; extremes between them are looked for."""
TABLE = [0.0, 0.1, 0.2, 0.3], [0.0, 1.0, 0.0, 2.0]
NUMPY = {name: getattr(np, name) for name in ("sin", "cos", "exp", "sqrt", "abs")} | {
    "min": np.minimum,
    "atan2": np.arctan2,
    "f": CubicSpline(*TABLE),
}


def conditions(seed: int) -> list[str]:
    """Random margins of the time: periodic and nested ones, most of them positive for short pulses."""
    rng, found = random.Random(seed), []
    for kind in range(9):
        w, v, a, phase = rng.uniform(200, 2000), rng.uniform(20, 200), rng.uniform(1, 3), rng.uniform(0, 6)
        short = 10 ** rng.uniform(-6, -2)
        found.append(
            (
                f"sin({w}*t + {phase}) - {1 - short}",
                f"cos({a}*sin({v}*t)) - {1 - short}",
                f"exp(-{a}*t)*sin({w}*t) - {0.8 - short}",
                f"sin({w}*t)*cos({v}*t) - {1 - 30 * short}",
                f"min(sin({w}*t), cos({v}*t)) - {0.9 - short}",
                f"abs(sin({w}*t + {phase})) - {1 - short}",
                f"sqrt(1.5 + sin({w}*t + {phase})) - {np.sqrt(2.5) - short}",
                f"atan2(sin({v}*t), cos({v}*t) + 2) - {np.pi / 6 - short}",
                f"f(0.15 + 0.15*sin({v}*t)) - {2 - 30 * short}",
            )[kind]
        )
    return found


@cache
def pulsed(seed: int) -> Mechanism:
    """A mass of 1 kg for each condition, which pushes it by 1 N while it holds; the last one needs two at once."""
    held = [f"{c} > 0" for c in conditions(seed)]
    held.append(f"sin({1500 + seed}*t) > 0.99 and cos({40 + seed}*t) > 0.9")
    names = [f"x{i}" for i, _ in enumerate(held)]
    forces = "\n".join(f'{name} = "if({c}, 1, 0)"' for name, c in zip(names, held, strict=True))
    kinetic = " + ".join(f"{name}_dot**2/2" for name in names)
    coordinates = "\n".join(f"{name} = {{}}" for name in names)
    text = f'[mechanism]\nname = "pulsed"\n[coordinates]\n{coordinates}\n[energy]\nkinetic = "{kinetic}"\n'
    text += f'[tables.f]\ncolumns = {[*TABLE]}\ninterpolation = "cubic"\n'
    return read(f"{text}[forces]\n{forces}\n[experiment]\nstop_time = {STOP}\nstep = 0.01\n", "pulsed.toml")


@cache
def on_times(seed: int, end: float = STOP) -> list[float]:
    """How long (s) each condition holds until the ``end`` (s): its velocity there.

    Roots are found by samples, extremes between them, and Brent's method.
    """
    margins = [*conditions(seed), f"min(sin({1500 + seed}*t) - 0.99, cos({40 + seed}*t) - 0.9)"]
    return [_on_time(compile(margin, "margin", "eval"), end) for margin in margins]


def _on_time(code: object, end: float) -> float:
    def value(t: object) -> object:
        return eval(code, NUMPY | {"t": t})  # type: ignore[arg-type]

    times = np.linspace(0, end, SAMPLES)
    values = value(times)
    middle = values[1:-1]
    turning = (middle - values[:-2]) * (values[2:] - middle) <= 0
    near = 1 + np.flatnonzero(turning & (np.abs(middle) < 1e-5))
    extremes = []
    for j in near.tolist():
        sense = -np.sign(values[j - 1] + values[j + 1] - 2 * values[j]) or 1.0
        bounds = (times[j - 1], times[j + 1])
        extremes.append(minimize_scalar(lambda t, s=sense: -s * value(t), bounds=bounds, method="bounded").x)
    grid = np.unique([*times, *extremes])
    values = value(grid)
    crossings = [brentq(value, grid[j], grid[j + 1], xtol=1e-16) for j in np.flatnonzero(values[1:] * values[:-1] < 0)]
    return sum(b - a for a, b in pairwise([0.0, *crossings, end]) if value((a + b) / 2) > 0)


def velocities(run: object, seed: int) -> list[float]:
    return [run[f"x{i}_dot"][-1] for i, _ in enumerate(on_times(seed))]  # type: ignore[index]


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow)])
def test_no_pulse_is_missed(exported, seed: int) -> None:
    """About 3 s, nearly all of it for the export."""
    expected = on_times(seed)
    assert sum(0 < t < 0.05 * STOP for t in expected) >= 4  # pulses, not steps
    for step in (STOP, 0.01, 0.0007):
        run = simulate(exported(pulsed(seed)).path, step=step)
        assert velocities(run, seed) == pytest.approx(expected, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_model_exchange_gets_the_time_of_every_root(exported, version: str) -> None:
    """nextEventTime stops the importer's solver, whose steps would pass most pulses."""
    run = simulate(exported(pulsed(1), fmi=version).path, step=0.01, tolerance=1e-9, kind="model-exchange")
    assert velocities(run, 1) == pytest.approx(on_times(1), abs=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["rk4", "radau5", "midpoint"])
def test_other_solvers_meet_them(exported, solver: str) -> None:
    run = simulate(exported(pulsed(1), solver=solver).path, step=0.01)
    assert velocities(run, 1) == pytest.approx(on_times(1), abs=1e-9)


@pytest.mark.slow
def test_the_independent_path_meets_them() -> None:
    """To a tenth of the time: SciPy's solvers start anew after each of some hundred events, which takes seconds."""
    reference = integrate(pulsed(1), np.linspace(0.0, STOP / 10, 3))
    assert velocities(reference.trajectory, 1) == pytest.approx(on_times(1, STOP / 10), abs=1e-10)


@pytest.mark.slow
def test_a_condition_that_turns_ever_faster_is_named(exported) -> None:
    text = '[mechanism]\nname = "ending"\n[coordinates]\nx = {}\n[energy]\nkinetic = "x_dot**2/2"\n'
    ending = read(f'{text}[forces]\nx = "if(sin(1/(100*(t - 0.5))) > 0.2, 1, 0)"\n', "ending.toml")
    with pytest.raises(SimulationError, match=r"sin\(.*t.*\) - 1/5 .* turns ever faster"):
        simulate(exported(ending).path, stop_time=1.0, step=0.1)
