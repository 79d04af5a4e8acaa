"""Running a bundled model's FMU at tolerance 1e-10."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import lag2fmu
from lag2fmu.reference import Trajectory

Motion = Callable[..., Trajectory]


@pytest.fixture
def motion(exported) -> Motion:
    """``motion(model, stop, steps, tolerance=1e-10, **values)``: the FMU's run with these parameters and starts."""

    def run(model: str, stop: float, steps: int = 20, tolerance: float = 1e-10, **values: float) -> Trajectory:
        return lag2fmu.simulate(exported(model), stop_time=stop, step=stop / steps, tolerance=tolerance, values=values)

    return run
