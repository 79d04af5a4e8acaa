"""The elementary functions in lanes against mpmath: errors in units of the last place."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from lag2fmu.ensemble.libraries import built, lanes_here
from lag2fmu.resources import resource_folder

FUNCTIONS = ("sin", "cos", "exp", "log")
SOURCE = """
#include "lane_math.h"
#define EACH(name) \\
    __attribute__((visibility("default"))) void each_##name(const double x[], double y[], int64_t count); \\
    void each_##name(const double x[], double y[], int64_t count) { \\
        Lanes value = {0.0}; \\
        for (int64_t i = 0; i < count; i++) { \\
            value[i % LANES] = x[i]; \\
            y[i] = lanes_##name(value)[i % LANES]; \\
        } \\
    }
"""

PLAIN = "#undef __FMA__\n#undef __ARM_FEATURE_FMA\n"
"""As if the processor had no fused products."""

Each = Callable[[str, np.ndarray], np.ndarray]


@pytest.fixture(scope="module", params=["", pytest.param(PLAIN, marks=pytest.mark.slow)], ids=["native", "plain"])
def each(request: pytest.FixtureRequest) -> Each:
    """``each(name, x)``: a function of lane_math.h at all ``x``, beside whatever the other lanes hold."""
    folder = resource_folder("templates") / "ensemble"
    sources = {name: (folder / name).read_text("utf-8") for name in ("lanes.h", "lane_math.h")}
    sources["lane_sizes.h"] = f"#define LANES {lanes_here('zig')}\n"
    sources["each.c"] = request.param + SOURCE + "".join(f"EACH({name})\n" for name in FUNCTIONS)
    library = built(sources, "lane_math", "zig")

    def values(name: str, x: np.ndarray) -> np.ndarray:
        y = np.empty_like(x)
        library.function(f"each_{name}")(
            ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(y.ctypes.data), ctypes.c_int64(len(x))
        )
        return y

    return values


def ulps(name: str, x: np.ndarray, y: np.ndarray) -> float:
    """The greatest error of y = name(x) in units of the last place of the true value."""
    worst = 0.0
    with mpmath.workprec(1200):
        for a, b in zip(x.tolist(), y.tolist(), strict=True):
            true = getattr(mpmath, name)(mpmath.mpf(a))
            worst = max(worst, float(abs(mpmath.mpf(b) - true)) / math.ulp(float(true)))
    return worst


def arguments(name: str) -> np.ndarray:
    """Arguments of all sizes, and those near multiples of pi/2."""
    rng = np.random.default_rng(0)
    signs = rng.choice([-1.0, 1.0], 300)
    if name in ("sin", "cos"):
        multiples = np.rint(rng.uniform(1, 6e5, 200)) * (np.pi / 2)
        return np.concatenate(
            [rng.uniform(-10, 10, 400), signs * 10.0 ** rng.uniform(-12, 6, 300), multiples, signs[:40] * 1e12]
        )
    if name == "exp":
        return np.concatenate([rng.uniform(-720, 709, 500), signs * 10.0 ** rng.uniform(-12, 0, 300)])
    return np.concatenate([10.0 ** rng.uniform(-307, 308, 500), 1.0 + signs * 10.0 ** rng.uniform(-12, -0.5, 300)])


@pytest.mark.fmu
@pytest.mark.parametrize("name", FUNCTIONS)
def test_errors_are_below_one_unit_in_the_last_place(each: Each, name: str) -> None:
    x = arguments(name)
    assert ulps(name, x, each(name, x)) < 1.0


@pytest.mark.fmu
def test_unusual_arguments_are_those_of_the_c_library(each: Each) -> None:
    x = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 5e-324, 800.0, -800.0, -1.0, 1e300])
    with np.errstate(all="ignore"):
        for name in FUNCTIONS:
            assert np.allclose(each(name, x), getattr(np, name)(x), rtol=3e-16, atol=0, equal_nan=True), name
    assert math.copysign(1.0, each("sin", np.array([-0.0]))[0]) == -1.0
