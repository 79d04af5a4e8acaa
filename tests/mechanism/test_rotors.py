"""Bodies without mass but with inertia, and those that only turn and are at no certain place."""

from __future__ import annotations

import numpy as np
import pytest
from describing import described

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.samples import samples
from lag2fmu.errors import MechanismError
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.reference import Equations

HEAD = """
[mechanism]
name = "shaft"
[parameters]
J1 = { value = 0.3, unit = "kg.m2" }
J2 = { value = 0.7, unit = "kg.m2" }
k = { value = 40.0, unit = "N.m/rad" }
[coordinates]
a = { unit = "rad", start = 0.2 }
b = { unit = "rad", velocity = 1.5 }
[inputs]
tau = { unit = "N.m" }
[springs.shaft]
stiffness = "k"
elongation = "a - b"
"""
ROTORS = """
[bodies.motor]
angle = "a"
inertia = "J1"
[bodies.wheel]
angle = "b"
inertia = "J2"
[loads.drive]
body = "motor"
torque = "tau"
"""
BESIDE_A_PENDULUM = """
[gravity]
acceleration = 9.81
[bodies.bob]
mass = 2
position = ["sin(b)", "-cos(b)"]
"""


@pytest.mark.parametrize("more", ["", BESIDE_A_PENDULUM])
def test_what_only_turns_needs_no_position(more: str) -> None:
    """J1 a'' = tau - k (a - b), J2 b'' = k (a - b), with a pendulum on b of 2 kg m2 and 2 g sin(b)."""
    mechanism = read(HEAD + ROTORS + more, "shaft.toml")
    assert read(write(mechanism), "shaft.toml") == mechanism
    equations, independent = derive(mechanism), Equations(mechanism)
    assert equations.solution is not None
    inertia, weight = (2.7, 2 * 9.81) if more else (0.7, 0.0)
    for drawn in samples(mechanism, 3):
        at = dict(drawn) | {p.name: p.value for p in mechanism.parameters}
        twist = 40.0 * (at["a"] - at["b"])
        by_hand = [
            (at["tau"] + at["Q_a"] - twist) / 0.3,
            (at["Q_b"] + twist - weight * np.sin(at["b"])) / inertia,
        ]
        assert equations.graph.evaluate(equations.solution.x, at) == pytest.approx(by_hand, rel=1e-13)
        given = {name: at[name] for name in independent.energies.input_names}
        q, qd = [at["a"], at["b"]], [at["a_dot"], at["b_dot"]]
        assert independent.accelerations(at["t"], q, qd, given) == pytest.approx(by_hand, rel=1e-12)
    described(mechanism, ["all"])


def test_a_body_may_have_inertia_alone() -> None:
    """A rod without mass that turns about its end: J a'' = Q."""
    text = HEAD.replace("a - b", "b") + '[bodies.rod]\nposition = ["cos(a)", "sin(a)"]\nangle = "a"\ninertia = "J1"\n'
    equations = derive(read(text + '[bodies.wheel]\nangle = "b"\ninertia = "J2"\n', "rod.toml"))
    assert equations.solution is not None
    (at,) = samples(equations.mechanism, 1)
    assert equations.graph.evaluate(equations.solution.x[:1], at) == pytest.approx([at["Q_a"] / at["J1"]], rel=1e-13)


def test_what_lacks_is_named() -> None:
    wrong = {
        'angle = "a"\ninertia = "J1"\nmass = 2': "'position' is missing",
        'position = ["a", 0]': "'mass' is missing",
        'inertia = "J1"': "'position' is missing",
    }
    for body, message in wrong.items():
        with pytest.raises(MechanismError, match=message):
            read(f"{HEAD}[bodies.x]\n{body}\n", "shaft.toml")
    with pytest.raises(MechanismError, match=r"there is no point or body 'motor'"):
        read(HEAD + ROTORS + '[outputs]\no = { point = "motor", quantity = "position" }\n', "shaft.toml")
