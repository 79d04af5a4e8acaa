"""The own sines and the like: below 1 unit in the last place, against mpmath, in double and in float."""

from __future__ import annotations

import ctypes
import math
import shutil
from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from compiling import compiled

from lag2fmu.codegen.firmware import EXACT, OWN_MATH
from lag2fmu.codegen.sources import engine_text
from lag2fmu.codegen.tokens import in_single

pytestmark = pytest.mark.fmu

REALS = {
    "double": (np.float64, ctypes.c_double, 53, -1074, 700.0, 300),
    "float": (np.float32, ctypes.c_float, 24, -149, 87.0, 37),
}
"""type -> (of NumPy, of C, bits, exponent of the least number, most exponent of exp, decades)"""
COUNT = 400


@pytest.fixture(scope="module", params=REALS)
def real(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def call(real: str, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., float]:
    """``call(name, *arguments)``."""
    texts = {name: engine_text(f"base/own_math/{name}") for name in ("own_math.c", "own_math.h")}
    texts["own_constants.h"] = engine_text(f"base/own_math/{real}/own_constants.h")
    if real == "float":
        texts = {name: in_single(text, EXACT) for name, text in texts.items()}
    options = ("-Wshadow", *(("-Wdouble-promotion",) if real == "float" else ()))
    library, kind = (
        compiled(tmp_path_factory.mktemp(real), texts, "gcc" if shutil.which("gcc") else "zig", options=options),
        REALS[real][1],
    )

    def called(name: str, *arguments: float) -> float:
        function = getattr(library, f"own_{name}")
        function.restype, function.argtypes = kind, [kind] * len(arguments)
        return function(*arguments)

    return called


def arguments(name: str, real: str) -> np.ndarray:
    """Usual and unusual arguments of a function of one."""
    rng, (kind, _, _, _, most, decades) = np.random.default_rng(1), REALS[real]

    def wide(low: float, high: float) -> np.ndarray:
        return rng.choice([-1, 1], COUNT) * 10.0 ** rng.uniform(low, high, COUNT)

    near_1 = rng.choice([-1, 1], COUNT) * (1 - 10.0 ** rng.uniform(-15, 0, COUNT))
    angles = np.r_[rng.uniform(-10, 10, COUNT), wide(-decades, decades), np.arange(1, COUNT) * (math.pi / 2)]
    growing = np.r_[rng.uniform(-most, most, COUNT), rng.uniform(-1, 1, COUNT), wide(-20, 0)]
    positive = np.r_[10.0 ** rng.uniform(-decades, decades, COUNT), rng.uniform(0.5, 2, COUNT), 1 + wide(-10, -1)]
    sides = np.r_[rng.uniform(-1, 1, COUNT), near_1, wide(-20, 0)]
    chosen = {"sin": angles, "cos": angles, "tan": angles, "log": positive, "asin": sides, "acos": sides}
    return chosen.get(name, np.r_[rng.uniform(-5, 5, COUNT), wide(-20, 20)] if name == "atan" else growing).astype(kind)


def in_units(found: float, exact: mpmath.mpf, real: str) -> float:
    """The error in units in the last place of the exact value."""
    _, _, bits, least, _, _ = REALS[real]
    exponent = mpmath.frexp(exact)[1] if exact else least
    return float(abs(mpmath.mpf(found) - exact) / mpmath.mpf(2) ** max(exponent - bits, least))


@pytest.mark.parametrize("name", [name for name in OWN_MATH if name not in ("atan2", "pow", "hypot")])
def test_functions_of_one_argument(name: str, real: str, call: Callable[..., float]) -> None:
    with mpmath.workprec(1200):
        errors = [in_units(call(name, x), getattr(mpmath, name)(x), real) for x in map(float, arguments(name, real))]
    assert max(errors) < 0.75


@pytest.mark.parametrize("name", ["atan2", "pow", "hypot"])
def test_functions_of_two_arguments(name: str, real: str, call: Callable[..., float]) -> None:
    rng, kind, most = np.random.default_rng(2), REALS[real][0], REALS[real][4]
    x = np.r_[10.0 ** rng.uniform(-3, 3, COUNT), rng.uniform(0.9, 1.1, COUNT)].astype(kind)
    y = np.r_[rng.uniform(-most / 8, most / 8, COUNT), rng.uniform(-3, 3, COUNT)].astype(kind)
    exact = {"pow": mpmath.power, "atan2": mpmath.atan2, "hypot": mpmath.hypot}[name]
    with mpmath.workprec(300):
        pairs = [(float(a), float(b)) for a, b in zip(x, y, strict=True)]
        errors = [in_units(call(name, a, b), exact(a, b), real) for a, b in pairs]
        errors += [in_units(call(name, b, -a), exact(b, -a), real) for a, b in pairs if name != "pow"]
    assert max(errors) < 0.75


MARGINS = """
pow -2.0 3.0 = -8.0
pow -2.0 2.0 = 4.0
pow -2.0 0.5 = nan
pow 0.0 -1.0 = inf
pow 0.0 0.0 = 1.0
pow nan 0.0 = 1.0
pow 1.0 nan = 1.0
pow inf -2.0 = 0.0
pow 0.5 inf = 0.0
pow 2.0 1e9 = inf
pow 2.0 -1e9 = 0.0
pow -0.0 3.0 = -0.0
pow -inf 3.0 = -inf
pow 9.0 0.5 = 3.0
pow 3.0 2.0 = 9.0
exp 1e4 = inf
exp -1e4 = 0.0
exp inf = inf
exp nan = nan
exp 0.0 = 1.0
log 0.0 = -inf
log -1.0 = nan
log inf = inf
log 1.0 = 0.0
sin -0.0 = -0.0
sin inf = nan
cos 0.0 = 1.0
tan nan = nan
asin 1.5 = nan
acos 1.0 = 0.0
acos -1.5 = nan
atan2 0.0 0.0 = 0.0
atan2 -0.0 -1.0 = -3.141592653589793
atan2 inf -inf = 2.356194490192345
atan2 1.0 0.0 = 1.5707963267948966
atan2 1.0 -inf = 3.141592653589793
atan2 nan 1.0 = nan
sinh -1e4 = -inf
cosh -1e4 = inf
tanh -1e4 = -1.0
tanh nan = nan
hypot 3.0 4.0 = 5.0
hypot 0.0 -0.0 = 0.0
hypot nan inf = inf
"""
"""A line each: function, arguments = value."""


@pytest.mark.parametrize("line", MARGINS.split("\n")[1:-1])
def test_margins_are_those_of_c(line: str, real: str, call: Callable[..., float]) -> None:
    name, *given = line.partition(" = ")[0].split()
    found, kind, expected = call(name, *map(float, given)), REALS[real][0], float(line.rpartition(" = ")[2])
    if math.isnan(expected):
        assert math.isnan(found)
    else:
        assert kind(found) == kind(expected)
        assert math.copysign(1, found) == math.copysign(1, expected)
