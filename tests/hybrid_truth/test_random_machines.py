"""Random machines obey the laws of contact and friction, whoever integrates them, and all ways of running them agree.

Each machine runs by co-simulation at three communication steps, by CVode, by RK4 and Euler's method with events that
are seen after the step, and by FMI 3.0. The checks need no second simulation, see checks.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from checks import Bar, Record, recorded, violations
from late_hosts import EULER, RK4, fixed_steps
from machines import FAMILIES, mechanism
from numpy.typing import NDArray

from lag2fmu.errors import SimulationError
from lag2fmu.fmu import Fmu
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

pytestmark = pytest.mark.fmu

Floats = NDArray[np.float64]
STOP, TOLERANCE = 1.0, 1e-7
LOCATED: dict[str, tuple[int, dict[str, Any], str, Bar]] = {
    "co-simulation in one step": (1, {}, "2.0", Bar(1e-5, 1e-5)),
    "co-simulation at 0.1 s": (10, {}, "2.0", Bar(1e-5, 1e-5)),
    "co-simulation at 2 ms": (500, {}, "2.0", Bar(1e-5, 1e-5)),
    "CVode": (100, {"kind": "model-exchange", "tolerance": TOLERANCE / 100}, "2.0", Bar(1e-4, 1e-4)),
    "FMI 3.0": (10, {}, "3.0", Bar(1e-5, 1e-5)),
}
"""Ways that locate events: the number of steps, options, the version of FMI, and what may be wrong.

CVode keeps its tolerance in each step alone. Over a run its errors are some hundred tolerances: it gets a hundredth.
"""
SEEN_LATE = {
    "RK4 at 1 ms": (1e-3, RK4, Bar(2e-2, 0.1)),
    "Euler at 0.2 ms": (2e-4, EULER, Bar(2e-2, 0.05)),
}
"""Ways that see events after a step (s)."""
AGREE, AGREE_LATE = 1e-5, 0.15
"""Parts of a coordinate, and of 1 in SI units, by which two ways may differ: 100 tolerances, and of late hosts."""
TIPPING = 129
"""The seed of a box whose lowest rebounds decide whether a foot sticks or slips."""
CLOSING = 846
"""The seed of a row in which a contact between two blocks closes in the step in which the slips of both turn."""
HYSTERESIS = 1e-8
"""What an indicator may be beside its slip: its hysteresis, and what an event in the last step has left of it."""
QUICK = ("chain", "loop", "clutch", "disc", "puck")
LONG = {"row": 40}
"""How many machines of a family are enough where each of them takes more than a second."""


def _located(family: str, fmus: dict[str, Fmu], values: dict[str, float], way: str) -> tuple[Record, list[str]]:
    steps, options, fmi, bar = LOCATED[way]
    names = recorded(FAMILIES[family])
    options = {"tolerance": TOLERANCE, **options}
    chosen = {"stop_time": STOP, "step": STOP / steps, "values": values, "outputs": names}
    run = simulate_fmu(fmus[fmi].path, Run(**chosen, **options))
    record = Record(names, run.columns(names))
    return record, violations(FAMILIES[family], record, bar)


def _seen_late(family: str, fmus: dict[str, Fmu], values: dict[str, float], way: str) -> tuple[Record, list[str]]:
    step, method, bar = SEEN_LATE[way]
    names = recorded(FAMILIES[family])
    every = round(STOP / step) // 100
    rows, indicators = fixed_steps(fmus["2.0"].path, values, names, STOP, step, method, every)
    record = Record(names, rows)
    return record, [*violations(FAMILIES[family], record, bar), *_biases(family, record, indicators)]


def _biases(family: str, record: Record, indicators: Floats) -> Iterator[str]:
    """The indicators of dry frictions that slide are their slips; they stand last, in the order of the mechanism."""
    slips = {slip.mode: slip for slip in FAMILIES[family].slips if not slip.normal}
    frictions = mechanism(family).frictions
    for k, friction in enumerate(frictions, indicators.shape[1] - len(frictions)):
        mode = f"{friction.name}_mode"
        direction = np.select([record[mode] == 4, record[mode] == 5], [1.0, -1.0])
        bias = np.abs(direction) * (indicators[:, k] - direction * record[slips[mode].slips[0]])
        if np.abs(bias).max() > HYSTERESIS:
            yield f"{mode}: the indicator is {np.abs(bias).max():g} beside the slip"


def _faults(family: str, seed: int, fmus: dict[str, Fmu]) -> Iterator[str]:
    values, ends = FAMILIES[family].draw(np.random.default_rng(seed)), {}
    for way in (*LOCATED, *SEEN_LATE):
        run = _located if way in LOCATED else _seen_late
        try:
            record, broken = run(family, fmus, values, way)
        except SimulationError as error:
            broken = [str(error)]
        else:
            ends[way] = np.array([record[name][-1] for name in FAMILIES[family].compared])
        yield from (f"{family} {seed}, {way}: {line}" for line in broken)
    flies = FAMILIES[family].flies
    for way, end in ends.items():
        other = ends.get("co-simulation at 0.1 s", end)
        bar = AGREE if way in LOCATED else np.inf if flies else AGREE_LATE
        if (np.abs(end - other) > bar * np.maximum(1.0, np.abs(other))).any():
            yield f"{family} {seed}, {way}: ends at {end}, and not at {other}"


def _chosen() -> Iterator[object]:
    """Four machines of five families in 'make test', 100 of each family in 'make test-all', where LONG has no less."""
    for family in FAMILIES:
        for first in range(0, LONG.get(family, 100), 20):
            yield pytest.param(family, range(first + 4, first + 24), marks=pytest.mark.slow, id=f"{family}-{first + 4}")
        marks = () if family in QUICK else pytest.mark.slow
        yield pytest.param(family, range(4), marks=marks, id=f"{family}-0")
    # a box begins to tip: the force and the friction of a foot come to 0 at one time
    yield pytest.param("box", (TIPPING,), marks=pytest.mark.slow, id="box-tips")
    # where the contact has closed the one block slides on as before
    yield pytest.param("row", (CLOSING,), marks=pytest.mark.slow, id="row-closes")


@pytest.mark.parametrize(("family", "seeds"), _chosen())
def test_machines_obey_the_laws(family: str, seeds: range, exported) -> None:
    # the code of users is worth its compilation where 'make test-all' has long runs, but for ten steps of FMI 3.0
    users = len(seeds) > 4 or family not in QUICK
    fmus = {"2.0": exported(mechanism(family), optimised=users or None), "3.0": exported(mechanism(family), fmi="3.0")}
    assert [fault for seed in seeds for fault in _faults(family, seed, fmus)] == []
