"""Where polynomials come down to 0: against NumPy's roots, and places where signs at nodes see nothing."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np
import pytest
from compiling import compiled

from lag2fmu.resources import resource_folder

Descent = Callable[..., float]
NONE = 2.0


@pytest.fixture(scope="module")
def descent(tmp_path_factory: pytest.TempPathFactory) -> Descent:
    """The first descent of a polynomial that is given as a function of theta; about 0.3 s to compile."""
    core = resource_folder("templates") / "engine" / "base"
    sources = {name: (core / name).read_text("utf-8") for name in ("roots.h", "roots.c")}
    library = compiled(tmp_path_factory.mktemp("roots"), sources)
    library.roots_first_descent.restype = ctypes.c_double
    places = np.array((ctypes.c_double * 6).in_dll(library, "ROOT_PLACES"))

    def first(function: Callable[[np.ndarray], np.ndarray], noise: float = 0.0) -> float:
        values, bernstein = (ctypes.c_double * 6)(*function(places)), (ctypes.c_double * 6)()
        library.roots_fit(values, bernstein)
        return library.roots_first_descent(bernstein, ctypes.c_double(noise))

    return first


def expected(polynomial: np.polynomial.Polynomial) -> float:
    """The first simple root in (0, 1] where the polynomial comes down, by the eigenvalues of its companion matrix."""
    roots = polynomial.roots()
    real = np.sort(roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0) & (roots.real <= 1)].real)
    return next((float(r) for r in real if polynomial.deriv()(r) < 0), NONE)


def test_random_polynomials(descent: Descent) -> None:
    generator = np.random.default_rng(1)
    met = 0
    for _ in range(3000):
        roots = generator.uniform(-0.5, 1.5, generator.integers(1, 6))
        if np.min(np.diff(np.sort(roots)), initial=1.0) < 1e-3:
            continue
        polynomial = np.polynomial.Polynomial.fromroots(roots) * generator.choice([-1e-6, 1.0, 1e9])
        wanted = 0.0 if polynomial(0.0) < 0 else expected(polynomial)
        met += wanted < NONE
        assert descent(polynomial) == pytest.approx(wanted, abs=1e-9)
    assert met > 1000


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_two_roots_between_nodes(descent: Descent, gap: float) -> None:
    """A dip that no node sees."""
    for place in (0.2, 0.5, 0.77):
        low, high = place - gap / 2, place + gap / 2
        assert descent(lambda x, a=low, b=high: (x - a) * (x - b)) == pytest.approx(low, abs=1e-9)
        assert descent(lambda x, a=place: (x - a) ** 2 + 1e-9) == NONE
        assert descent(lambda x, a=low, b=high: -(x - a) * (x - b), 1.0) == NONE


def test_what_begins_at_zero(descent: Descent) -> None:
    """It comes down at once if it falls, later if it rises first; noise counts as 0."""
    assert descent(lambda x: x * (0.5 - x)) == pytest.approx(0.5)
    assert descent(lambda x: x * (0.5 - x) - 1e-15, 1e-14) == pytest.approx(0.5)
    assert descent(lambda x: -x + 1e-15, 1e-14) == 0.0
    assert descent(lambda x: x**2 * (0.25 - x)) == pytest.approx(0.25)
    assert descent(lambda x: -(x**3), 1e-15) == 0.0
    assert descent(lambda x: x**3) == NONE
    assert descent(lambda x: 0.0 * x) == NONE
    assert descent(lambda x: 1e-15 * np.cos(9 * x), 1e-14) == NONE


def test_a_root_at_the_end(descent: Descent) -> None:
    assert descent(lambda x: 1 - x) == pytest.approx(1.0, abs=1e-15)
    assert descent(lambda x: 1 + 1e-12 - x) == NONE


def test_multiple_roots(descent: Descent) -> None:
    """An odd one is a descent, to the accuracy that it can have; an even one is none."""
    assert descent(lambda x: (0.3 - x) ** 3) == pytest.approx(0.3, abs=1e-4)
    assert descent(lambda x: (0.3 - x) ** 3 * (x - 0.7) ** 2) == pytest.approx(0.3, abs=1e-4)
    assert descent(lambda x: (x - 0.7) ** 2 + 1e-14) == NONE
