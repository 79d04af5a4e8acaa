"""Impacts, sticks and slips come at the same places whatever the units of mass and time."""

from __future__ import annotations

import numpy as np
import pytest

import lag2fmu
from lag2fmu.language.units import Unit
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference.trajectory import Trajectory

pytestmark = pytest.mark.fmu

WATCHED = {
    "braked_wheel": ("x", "phi", "road_mode", "brake_mode"),
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
@pytest.mark.parametrize(("kg", "s"), [(2.0**-60, 1.0)])
def test_units_of_mass_and_time_do_not_matter(model: str, kg: float, s: float, exported) -> None:
    """Sliding friction was found down to 1e-14 N, and was 0 below that."""
    usual, other = _run(model, exported, 1.0, 1.0), _run(model, exported, kg, s)
    assert np.abs(other.values - usual.values).max(axis=0) == pytest.approx(0, abs=2e-5)
