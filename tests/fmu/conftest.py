"""Direct integrations that several tests of FMUs compare with, one a session and model."""

from __future__ import annotations

import shlex
import shutil
import sys
from collections.abc import Callable

import numpy as np
import pytest

from lag2fmu.dynamics.lagrange import complete
from lag2fmu.mechanism.loading import load
from lag2fmu.reference import Reference, integrate

STOP, STEP = 10.0, 0.01
"""Duration and grid of the direct integrations, in s."""


@pytest.fixture(scope="session")
def directly() -> Callable[..., Reference]:
    """``directly(model, stop=10.0)``: its direct integration every 0.01 s, with an own error of about 1e-10."""
    done: dict[tuple[str, float], Reference] = {}

    def run(model: str, stop: float = STOP) -> Reference:
        key = (model, stop)
        if key not in done:
            done[key] = integrate(complete(load(model)), np.linspace(0.0, stop, round(stop / STEP) + 1), rtol=1e-12)
            # an estimate from above, of the run at 1e-11 that it is compared with; the bars are 1e-8
            assert done[key].relative_error.max() < 2e-9
        return done[key]

    return run


@pytest.fixture
def host_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler for ``--compiler host``: that of the machine or, where there is none, zig by way of $CC."""
    if not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        monkeypatch.setenv("CC", shlex.join([sys.executable, "-m", "ziglang", "cc"]))
