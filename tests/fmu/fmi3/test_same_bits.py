"""Whether the importer or the FMU passes events, the trajectory is the same bit for bit."""

from __future__ import annotations

import pytest

from lag2fmu.verify.instances import description_of
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

pytestmark = pytest.mark.fmu

SLOW = [
    *[("gripper", solver) for solver in ("dopri5", "dop853", "radau5")],
    *[("clutch_pair", solver) for solver in ("dopri5", "rk4", "ros2")],
    *[("falling_rod", solver) for solver in ("rk4", "ros2")],
    *[("woodpecker", "dopri5"), ("bouncing_ball", "ros2"), ("block_on_belt", "dopri5"), ("hopper_leg", "dopri5")],
]
CASES = [("gripper", "rk4"), *(pytest.param(*case, marks=pytest.mark.slow) for case in SLOW)]


@pytest.mark.parametrize(("model", "solver"), CASES)
def test_events_by_the_importer_and_by_the_fmu(model: str, solver: str, exported) -> None:
    """All numbers at the communication points, with steps that binary numbers have and others."""
    path = exported(model, solver=solver, fmi="3.0").path
    names = [v.name for v in description_of(path).modelVariables if v.type == "Float64" and v.causality != "parameter"]
    for step in (1 / 64, 0.01, 0.1):
        inside, outside = (simulate_fmu(path, Run(step=step, outputs=names[1:], events=by)) for by in (False, True))
        differing = [n for n, a, b in zip(names[1:], inside.values.T, outside.values.T, strict=True) if (a != b).any()]
        assert differing == [], step
