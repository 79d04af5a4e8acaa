"""Running a bundled model's FMU at tolerance 1e-10."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

import lag2fmu
from lag2fmu.reference import Trajectory

Motion = Callable[..., Trajectory]


@pytest.fixture
def motion(exported) -> Motion:
    """``motion(model, stop, steps, tolerance=1e-10, outputs=None, **values)``: the FMU's run with these values.

    ``outputs`` are the variables that are recorded, by default the outputs.
    """

    def run(
        model: str,
        stop: float,
        steps: int = 20,
        tolerance: float = 1e-10,
        outputs: Sequence[str] | None = None,
        **values: float,
    ) -> Trajectory:
        return lag2fmu.simulate(
            exported(model), stop_time=stop, step=stop / steps, tolerance=tolerance, values=values, outputs=outputs
        )

    return run
