"""Random mechanisms, with and without constraints, printed and compared with SymPy's Lagrange equations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from random_mechanisms import expected, mechanism, mechanism_with_bodies, mechanism_without_mass

from lag2fmu.codegen.c import c_function
from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.samples import samples
from lag2fmu.fmu.variables import promotable
from lag2fmu.mechanism import Mechanism


def compare(seed: int, written: Callable[[int], Mechanism] = mechanism) -> None:
    """The equations of a mechanism at two random states; all its functions are printed, with all outputs."""
    equations = derive(written(seed))
    program = lower(equations, promotable(equations, ["all"]), variational=True)
    texts = [c_function(program, function) for function in program.functions]
    assert not any("= ;" in text for text in texts)
    independent = expected(equations.mechanism)
    outputs = list(equations.outputs.values())
    for sampled in samples(equations.mechanism, 2):
        values = independent.moving_in_equilibrium(sampled)
        rows = zip((equations.residual, equations.momenta, outputs), independent.numbers(values), strict=True)
        for nodes, numbers in rows:
            found = np.array(equations.graph.evaluate(list(nodes), values))
            usable = np.isfinite(numbers)  # SymPy's formulas have no value where one of their parts has none
            bar = 1e-9 * (1.0 + np.abs(numbers).max(initial=0.0, where=usable))
            assert np.all(np.abs(found - numbers)[usable] <= bar), (seed, found, numbers)


@pytest.mark.parametrize("seed", range(4))
def test_a_random_mechanism_has_the_equations_of_lagrange(seed: int) -> None:
    compare(seed)


@pytest.mark.parametrize("seed", [1, 5])
def test_a_random_mechanism_with_bodies_has_the_equations_of_lagrange(seed: int) -> None:
    compare(seed, mechanism_with_bodies)


@pytest.mark.parametrize("seed", [0, 3])
def test_what_has_no_mass_in_a_random_mechanism_is_in_equilibrium(seed: int) -> None:
    compare(seed, mechanism_without_mass)


@pytest.mark.all_models
def test_what_has_no_mass_in_many_random_mechanisms_is_in_equilibrium() -> None:
    for seed in range(10, 40):
        compare(seed, mechanism_without_mass)


@pytest.mark.all_models
def test_many_random_mechanisms_with_bodies_have_the_equations_of_lagrange() -> None:
    """Half of them on frames in space, where SymPy's derivatives take seconds."""
    for seed in range(10, 20):
        compare(seed, mechanism_with_bodies)


@pytest.mark.all_models
@pytest.mark.parametrize("start", range(10, 110, 10))
def test_many_random_mechanisms_have_the_equations_of_lagrange(start: int) -> None:
    for seed in range(start, start + 10):
        compare(seed)
