"""Compiled equations at single states are those that NumPy evaluates for batches."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product

import numpy as np
import pytest
import sympy as sp
from mechanisms import loaded, pendulum
from spatial_mechanisms import everything_spatial

from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Energy, Mechanism, coordinate
from lag2fmu.reference import Equations, integrate, native
from lag2fmu.reference.hybrid.system import HybridSystem
from lag2fmu.reference.single import single_state


def all_functions() -> Mechanism:
    """Every function of the language, some powers, and quotients, in a potential and a mass."""
    x, y = coordinate("x", start=0.4, velocity=0.3), coordinate("y", start=0.7, velocity=-0.2)
    one = [
        sp.sin,
        sp.cos,
        sp.tan,
        sp.asin,
        sp.acos,
        sp.atan,
        sp.sinh,
        sp.cosh,
        sp.tanh,
        sp.sqrt,
        sp.exp,
        sp.log,
        sp.Abs,
    ]
    potential = sp.Add(*((i + 1) * f(x * y + TIME / 10) for i, f in enumerate(one)))
    potential += sp.atan2(x, y) + sp.Max(x, y, x * y) * sp.Min(x, y) + sp.Heaviside(x - y) * (x - y) + sp.sign(x) * x
    potential += x ** sp.Rational(7, 3) + y**x + x**-3 + 1 / (x + y) + x**12 + sp.pi * sp.Rational(2, 3) * x
    kinetic = (1 + x**2 / (1 + y**2)) * x.dot**2 / 2 + sp.exp(x) * y.dot**2 / 2 + sp.cos(y) * x.dot * y.dot / 3
    energy = Energy(kinetic=kinetic, potential=potential, dissipation=x**2 * y.dot**2 / 2)
    return Mechanism("all_functions", coordinates=[x, y], energy=energy, forces={y: sp.sign(x.dot) * sp.Abs(x)})


MECHANISMS = {
    "all_functions": all_functions,
    "loaded": loaded,
    "everything_spatial": everything_spatial,
    **{name: partial(load, name) for name in ("rattleback", "heavy_top_quaternion")},
}


@pytest.mark.parametrize("made", MECHANISMS.values(), ids=MECHANISMS)
def test_compiled_equations_are_the_same(made: Callable[[], Mechanism]) -> None:
    equations, generator = Equations(made()), np.random.default_rng(3)
    single, n = single_state(equations.energies, equations.scale), equations.n
    assert single is not None, "zig is a dependency"
    q, qd = equations.energies.start()
    q, qd = q + generator.uniform(-0.02, 0.02, n), qd + generator.uniform(-0.5, 0.5, n)
    state = equations.energies.state(
        0.3, q, qd, {name: generator.uniform(-1, 1) for name in equations.energies.input_names}
    )
    for name, expected in vars(equations.terms(state)).items():
        found = getattr(single.terms(state), name)
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-12 * max(1.0, np.abs(expected).max())), name
    expected = equations.rates(state, 2.0)
    for value, other in zip(single.rates(0.3, np.concatenate([q, qd]), state.inputs, 2.0), expected, strict=True):
        assert value == pytest.approx(other, rel=1e-9, abs=1e-10 * max(1.0, np.abs(other).max(initial=0.0)))


SIDED = """
[mechanism]
name = "sided"
[coordinates]
x = { start = 0.3, velocity = -0.4 }
y = { start = 0.2, velocity = 0.7 }
[energy]
kinetic = "(2 + cos(x))*x_dot**2/2 + y_dot**2/2 + sin(y)*x_dot*y_dot/3"
potential = "abs(x)*y + max(0, y - x)**2"
[forces]
x = "-sign(x_dot)*exp(y)"
y = "if(x > y, x**3, y**2)"
"""


def test_compiled_equations_stay_on_the_sides_of_kinks() -> None:
    """At each side that kinks may have, also where the state itself lies on the other one, as in trial steps."""
    system = HybridSystem(read(SIDED, "sided.toml"))
    single = single_state(system.energies, system.equations.scale)
    assert single is not None, "zig is a dependency"
    state = system.energies.state(0.0, [0.3, 0.2], [-0.4, 0.7])
    told = set()
    for sides in product((1, -1), repeat=system.elements.sides):
        system.elements.set_sides(sides)
        expected, found = system.equations.terms(state), single.terms(state)
        told.add((*np.round(expected.lagrangian_slope, 9), *np.round(expected.forces, 9)))
        for name, value in vars(expected).items():
            assert getattr(found, name) == pytest.approx(value, rel=1e-12, abs=1e-12), (sides, name)
    assert len(told) == 2**3, "three kinks, and each of them matters"


def test_without_a_compiler_numpy_integrates_alone(monkeypatch) -> None:
    """The period of 4 s at 2 rad is missed by neither: both meet each other."""
    mechanism = pendulum(2.0)
    times = np.linspace(0, 10, 11)
    compiled = integrate(mechanism, times).trajectory["theta"]
    monkeypatch.setattr(native, "find_spec", lambda name: None)
    native.native_terms.cache_clear()
    alone = integrate(mechanism, times).trajectory["theta"]
    native.native_terms.cache_clear()
    assert alone == pytest.approx(compiled, abs=1e-10)
