"""Numbers that are longer than doubles or beyond their range, on both paths."""

from __future__ import annotations

import numpy as np
import pytest

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.samples import samples
from lag2fmu.errors import DerivationError
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference import Equations
from lag2fmu.reference.single import single_state


def oscillator(potential: str, constant: str = "2.5") -> Mechanism:
    """A mass of 1 kg in a ``potential``, with a dependent parameter ``l`` of no others."""
    return read(
        f'[mechanism]\nname = "long"\n[parameters]\nl = {{ expression = "{constant}" }}\n'
        "[coordinates]\nx = { start = 0.3, velocity = 0.2 }\n"
        f'[energy]\nkinetic = "x_dot**2/2"\npotential = "{potential}"\n',
        "long.toml",
    )


@pytest.mark.parametrize(
    ("potential", "force"),
    [
        ("-cos(1e30*x)/1e60", lambda x: -np.sin(1e30 * x) / 1e30),
        ("123456789.123456789012345*0.333333333333333333333*x**2/2", lambda x: -123456789.12345679 / 3 * x),
        ("6.02214076e23*(1.000000001)**40*x**2/2*1e-23", lambda x: -6.02214076 * 1.000000001**40 * x),
        ("sin(1e-150*x)*1e150", lambda x: -1.0),
        ("(7/3)**(5/7)*x + 1e22*tanh(x/1e22)", lambda x: -((7 / 3) ** (5 / 7)) - 1.0),
        ("1e200*x**2/1e200", lambda x: -2 * x),
        ("l*x", lambda x: -2.5),
    ],
)
def test_long_fractions_are_the_doubles_next_to_them(potential: str, force) -> None:
    mechanism = oscillator(potential)
    equations, independent = derive(mechanism), Equations(mechanism)
    single = single_state(independent.energies, independent.scale)
    assert equations.solution is not None
    assert single is not None
    for drawn in samples(mechanism, 3):
        at = dict(drawn) | {"Q_x": 0.0}
        expected = pytest.approx([force(at["x"])], rel=1e-12)
        q, qd = np.array([at["x"]]), np.array([at["x_dot"]])
        state = independent.energies.state(at["t"], q, qd)
        assert equations.graph.evaluate(equations.solution.x, at | {"l": 2.5}) == expected
        assert independent.accelerations(at["t"], q, qd) == expected
        assert single.rates(at["t"], np.concatenate([q, qd]), state.inputs)[0] == expected


@pytest.mark.parametrize("product", ["l*l*x", "l*l*l*l*x"])
def test_constants_beyond_the_range_of_doubles_are_refused(product: str) -> None:
    """1.5e154^2 is beyond 1.8e308; definitions are multiplied where the equations are made."""
    text = '[mechanism]\nname = "long"\n[coordinates]\nx = {}\n[definitions]\nl = "1.5e154"\n[energy]\n'
    with pytest.raises(DerivationError, match="beyond the range of double precision"):
        derive(read(f'{text}kinetic = "x_dot**2/2"\npotential = "{product}"\n', "long.toml"))


def test_functions_of_constants_without_a_value_do_not_stop_the_derivation_itself() -> None:
    """1e300^1.5 has none among doubles, nor has log(-1): the checks of start values say so."""
    for constant in ("l**(3/2)", "log(-l)"):
        text = '[mechanism]\nname = "long"\n[coordinates]\nx = {}\n[definitions]\nl = "1e300"\n[energy]\n'
        with pytest.raises(DerivationError, match="finite"):
            derive(read(f'{text}kinetic = "x_dot**2/2"\npotential = "x*{constant}"\n', "long.toml"))
