"""Impacts, sticks and slips come at the same places whatever the units of mass and time."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import lag2fmu
from lag2fmu.language.units import Unit
from lag2fmu.mechanism import Body, Force, Mechanism, Spring, Stop, coordinate
from lag2fmu.reference.trajectory import Trajectory

pytestmark = pytest.mark.fmu

WATCHED = {
    "block_on_belt": ("x", "belt_mode"),
    "braked_wheel": ("x", "phi", "road_mode", "brake_mode"),
    "woodpecker": ("y", "phi_M", "phi_S", "beak_impacts"),
}
"""What has no mass and no time in its unit."""


def _scaled(mechanism: Mechanism, kg: float, s: float) -> dict[str, float]:
    """Parameters, inputs and starts (SI) of the same motion with masses ``kg`` and times ``s`` times as large."""

    def factor(unit: Unit | None) -> float:
        return kg ** float(unit.exponents[0]) * s ** float(unit.exponents[2]) if unit else 1.0

    given = [p for p in mechanism.parameters if p.value is not None]
    values = {p.name: p.value * factor(p.unit) for p in given}
    values |= {u.name: u.start * factor(u.unit) for u in mechanism.inputs}
    return values | {f"{q.name}_dot": q.velocity / s for q in mechanism.coordinates}


def _run(model: str, exported, kg: float, s: float) -> Trajectory:
    mechanism = lag2fmu.load(model)
    stop = 0.5 * mechanism.experiment.stop_time * s
    values = _scaled(mechanism, kg, s)
    fmu, watched = exported(model), list(WATCHED[model])
    return lag2fmu.simulate(fmu, stop_time=stop, step=stop / 50, values=values, outputs=watched)


@pytest.mark.parametrize("model", WATCHED)
@pytest.mark.parametrize(("kg", "s"), [(2.0**-60, 1.0), (2.0**60, 1.0), (1.0, 2.0**20), (2.0**-40, 2.0**-20)])
def test_units_of_mass_and_time_do_not_matter(model: str, kg: float, s: float, exported) -> None:
    """Margins of forces were compared with 1e-14 N, slow slips with 1e-5 m/s: friction was lost without a word."""
    usual, other = _run(model, exported, 1.0, 1.0), _run(model, exported, kg, s)
    assert np.abs(other.values - usual.values).max(axis=0) == pytest.approx(0, abs=2e-5)


def _relay() -> Mechanism:
    """A relay of 1e-12 kg: a voltage that falls lets go of the armature, 0.1 um from the electrode."""
    x, volt = coordinate("x", "m", start=2e-6), 4 - 2e5 * sp.Symbol("t")
    bodies, springs = [Body("armature", 1e-12, (x, 0))], [Spring("beam", 1.0, elongation=x)]
    forces, stops = [Force(x, 4.427e-21 * volt**2 / (2.1e-6 - x) ** 2)], [Stop("rest", of=x, upper=2e-6)]
    return Mechanism("relay", coordinates=[x], bodies=bodies, springs=springs, forces=forces, stops=stops)


@pytest.mark.parametrize("step", [1e-6, 5e-8, 2e-8, 1.3e-8, 1e-8, 7e-9])
def test_a_stop_of_a_small_relay_lets_go(step: float, exported) -> None:
    """Its last force, 1e-20 N of rounding beside two of 2e-6 N, was taken for a load in a motion of microseconds."""
    leaves = (4 - np.sqrt(2e-6 * 1e-14 / 4.427e-21)) / 2e5
    run = lag2fmu.simulate(exported(_relay()), stop_time=1.1e-5, step=step, outputs=["x", "rest_upper_mode"])
    assert (run["x"][run.time < leaves] == 2e-6).all()
    assert (run["rest_upper_mode"][run.time > leaves + 5e-8] == 1).all()
    assert run["x"][-1] == pytest.approx(1.0895932e-6, rel=1e-6)


def test_time_stepping_sticks_in_slow_motions(exported) -> None:
    """Steps a million times as long: a slip below 1e-10 m/s was at rest."""
    fmu, mechanism, ends = exported("block_on_belt", solver="moreau"), lag2fmu.load("block_on_belt"), []
    for s in (1.0, 2.0**20):
        values = _scaled(mechanism, 1.0, s) | {"solver_step": 1e-3 * s}
        run = lag2fmu.simulate(fmu, stop_time=15 * s, step=0.5 * s, values=values, outputs=["x"])
        ends.append(run["x"])
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)
