"""Coefficients of the implicit methods against published ones."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from lag2fmu.solvers.collocation import COLLOCATIONS


@pytest.mark.parametrize("name", COLLOCATIONS)
def test_orders_are_as_claimed(name: str) -> None:
    method = COLLOCATIONS[name]
    method.check()
    if method.a == method.hat:
        with pytest.raises(ValueError, match=f"'{name}': b has order {method.order}, not {method.order + 1}"):
            method._replace(order=method.order + 1).check()


def test_pairs_of_variational_methods() -> None:
    """Gauss's methods are their own partners, Lobatto's IIIA has IIIB: Hairer, Lubich, Wanner, section II.1.4."""
    for name in ("midpoint", "gauss4", "gauss6"):
        assert COLLOCATIONS[name].hat == COLLOCATIONS[name].a
    half, third, sixth = Fraction(1, 2), Fraction(1, 3), Fraction(1, 6)
    assert COLLOCATIONS["verlet"].hat == ((half, 0), (half, 0))
    assert COLLOCATIONS["lobatto4"].hat == ((sixth, -sixth, 0), (sixth, third, 0), (sixth, 5 * sixth, 0))


def test_radau5_is_the_method_of_the_book() -> None:
    """Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, table IV.5.6."""
    root, method = np.sqrt(6.0), COLLOCATIONS["radau5"]
    a = [
        [(88 - 7 * root) / 360, (296 - 169 * root) / 1800, (-2 + 3 * root) / 225],
        [(296 + 169 * root) / 1800, (88 + 7 * root) / 360, (-2 - 3 * root) / 225],
        [(16 - root) / 36, (16 + root) / 36, 1 / 9],
    ]
    assert np.array(method.a, float) == pytest.approx(np.array(a), abs=1e-15)
    assert np.array(method.c, float) == pytest.approx(np.array(a).sum(axis=1), abs=1e-15)


def test_the_modes_of_radau5() -> None:
    """The eigenvalues of the inverse of a are the zeros of x^3 - 9 x^2 + 36 x - 60: the method's denominator."""
    method = COLLOCATIONS["radau5"]
    modes = method.modes
    assert modes is not None
    pair = complex(*modes.pair)
    assert 1 / modes.real == pytest.approx(3.6378342527444957, rel=1e-15)
    assert 1 / pair == pytest.approx(2.6810828736277523 - 3.0504301992474105j, rel=1e-15)
    blocks = np.array([[modes.real, 0, 0], [0, pair.real, pair.imag], [0, -pair.imag, pair.real]])
    product = np.array(modes.from_modes) @ blocks @ np.array(modes.to_modes)
    assert product == pytest.approx(np.array(method.a, float), abs=1e-14)
    assert np.array(modes.from_modes) @ np.array(modes.to_modes) == pytest.approx(np.eye(3), abs=1e-14)


def test_weights_of_multipliers() -> None:
    """They invert how the positions at later nodes answer forces at earlier ones."""
    for method in (method for method in COLLOCATIONS.values() if method.variational):
        answer = (np.array(method.node_a, float) @ np.array(method.node_hat, float))[1:, :-1]
        assert np.array(method.node_weights, float) @ answer == pytest.approx(np.eye(len(answer)), abs=1e-14)


def test_constraints_hold_at_the_stages_of_lobatto_and_between_those_of_gauss() -> None:
    """Jay, SIAM J. Numer. Anal. 45 (2007): (1, 1)-Gauss-Lobatto; for Lobatto's pairs the method's own coefficients."""
    for method in (COLLOCATIONS["verlet"], COLLOCATIONS["lobatto4"]):
        assert (method.node_a, method.node_hat, method.node_b) == (method.a, method.hat, method.b)
    method = COLLOCATIONS["midpoint"]
    assert (method.node_a, method.node_hat) == (((0,), (1,)), ((Fraction(1, 2), 0),))
