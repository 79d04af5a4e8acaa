"""What several tests of FMUs share: direct integrations to compare with, one a session and model, and the FMUs."""

from __future__ import annotations

import shlex
import shutil
import sys
from collections.abc import Callable

import numpy as np
import pytest
from chosen import models

from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import load
from lag2fmu.reference import Reference, integrate

STOP, POINTS = 10.0, 1000
"""Longest duration of the direct integrations, in s, and their number of output times."""


def duration(model: str) -> float:
    """What tests integrate a model for, in s: 10 s or, where the model names a shorter time, that."""
    return min(STOP, load(model).experiment.stop_time)


@pytest.fixture(scope="session")
def directly() -> Callable[..., Reference]:
    """``directly(model, part=1.0)``: its direct integration at 1001 times of that part of its duration.

    Its own error is about 1e-10.
    """
    done: dict[tuple[str, float], Reference] = {}

    def run(model: str, part: float = 1.0) -> Reference:
        key = (model, part)
        if key not in done:
            times = np.linspace(0.0, part * duration(model), POINTS + 1)
            done[key] = integrate(with_derived(load(model)), times, rtol=1e-12)
            own = done[key].relative_error.max()
            if own >= 2e-9:  # an estimate from above, of the run at 1e-11 that it is compared with; the bars are 1e-8
                pytest.skip(f"the direct integration of {model} is not sharp enough: its error is up to {own:.1g}")
        return done[key]

    return run


@pytest.fixture
def host_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler for ``--compiler host``: that of the machine or, where there is none, zig by way of $CC."""
    if not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        monkeypatch.setenv("CC", shlex.join([sys.executable, "-m", "ziglang", "cc"]))


@pytest.fixture(params=models())
def fmu(request: pytest.FixtureRequest, exported: Callable[..., Fmu]) -> Fmu:
    """The FMU of every model that stands for others."""
    return exported(request.param)
