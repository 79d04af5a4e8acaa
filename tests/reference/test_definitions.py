"""Long definitions, which stay calls: as right as those that are written out, and no exponential work."""

import math

import numpy as np
import pytest
from kkt import solve

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.starts import start_values
from lag2fmu.formats.text import read
from lag2fmu.language import definitions
from lag2fmu.mechanism import Mechanism
from lag2fmu.picture.skeleton import Skeleton
from lag2fmu.procedure.steps import procedure
from lag2fmu.reference import Equations, integrate, sympy_accelerations

CHAIN = """
[mechanism]
name = "chain"
title = "A potential of many definitions"
source = "V = f(f(...f(x))) with f(u) = sin(u)/2 + u**2/(1 + u**2)"
[parameters]
m = {{ value = 2.0, unit = "kg" }}
[coordinates]
x = {{ unit = "1", start = 0.7 }}
[definitions]
{lines}
[energy]
kinetic = "m*x_dot**2/2"
potential = "{last}"
"""

EVERYTHING = """
[mechanism]
name = "NAME"
title = "A driven pendulum on a damped, switched support"
source = "made up: definitions stand in every place that takes an expression"
[parameters]
m = { value = 1.5, unit = "kg" }
l = { value = 0.8, unit = "m" }
[coordinates]
a = { unit = "rad", start = 0.4, velocity = 0.3 }
x = { unit = "m", start = 0.1 }
y = { unit = "m", guess = -0.7 }
[inputs]
u = { unit = "m", motion = true, start = 0.05 }
[definitions]
reach = "l*sin(a) + x"
height = "-l*cos(a) + 0.1*u"
tip = "reach + 0.2*height**2"
speed = "x_dot*(1 + 0.1*reach**2)"
kink = "abs(x - 0.08) + 0.1*sign(speed)"
turned = "atan2(reach, 2 + height)"
[bodies.bob]
mass = "m"
position = ["tip", "y"]
[bodies.cart]
mass = "2*m"
inertia = "0.1"
position = ["x", "0.3*t"]
angle = "turned"
[gravity]
acceleration = 9.81
[springs.wall]
stiffness = 40
elongation = "tip - 0.1*abs(x - 0.08)"
[dampers.wall]
damping = 0.7
rate = "speed"
[forces]
x = "-2*kink"
[constraints.holonomic]
rod = "y - height"
[outputs]
seen = { expression = "kink*tip" }
fast = { expression = "x_ddot + reach" }
[outputs.spot]
point = "bob"
quantity = "acceleration"
[experiment]
stop_time = 0.5
step = 0.05
"""


def chain(count: int) -> Mechanism:
    """Each definition uses the one before three times."""
    terms = [f"sin({u})/2 + {u}**2/(1 + {u}**2)" for u in ("x", *(f"d{i}" for i in range(count)))]
    lines = "\n".join(f'd{i} = "{term}"' for i, term in enumerate(terms[:count]))
    return read(CHAIN.format(lines=lines, last=f"d{count - 1}"), "chain")


def test_a_chain_of_definitions_takes_no_exponential_work() -> None:
    """30 definitions would be 3**30 operations; x_ddot = -dV/dx / m by the chain rule in floats."""
    mechanism, u, slope = chain(30), 0.7, 1.0
    for _ in range(30):
        square = u * u
        slope *= math.cos(u) / 2 + 2 * u / (1 + square) ** 2
        u = math.sin(u) / 2 + square / (1 + square)
    equations, independent = derive(mechanism), Equations(mechanism)
    assert solve(equations, start_values(equations.mechanism))[0] == pytest.approx([-slope / 2], rel=1e-12)
    assert independent.accelerations(0.0, [0.7], [0.0]) == pytest.approx([-slope / 2], rel=1e-12)
    assert independent.potential_energy(0.0, [0.7], [0.0]) == pytest.approx(u, rel=1e-12)
    assert sympy_accelerations(mechanism)(0.0, [0.7], [0.0], None) == pytest.approx([-slope / 2], rel=1e-12)
    text = procedure(mechanism)
    assert "V = d29\n" in text
    assert "d29 = sin(d28)/2 + d28**2/(1 + d28**2)" in text
    assert {x.name for x in Skeleton(mechanism).written(mechanism.energy.potential).free_symbols} == {"x"}


def test_definitions_that_stay_calls_are_those_written_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Positions, energies, forces, kinks, constraints and outputs, all the derivatives that they need included."""
    written = read(EVERYTHING.replace("NAME", "written"), "written")
    expected = integrate(written, np.linspace(0, 0.5, 6)).trajectory
    monkeypatch.setattr(definitions, "LONG", 0)
    called = read(EVERYTHING.replace("NAME", "called"), "called")
    found = integrate(called, np.linspace(0, 0.5, 6)).trajectory
    for name in expected.names:
        assert found[name] == pytest.approx(expected[name], rel=1e-9, abs=1e-11), name
