"""Dampers whose force depends on the rate in any way: closed forms, generalized forces, and the independent path."""

from __future__ import annotations

import numpy as np
import pytest

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.samples import samples
from lag2fmu.errors import MechanismError
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference import Equations
from lag2fmu.reference.single import single_state

CAR = """
[mechanism]
name = "car"
strict_units = true
[parameters]
c1 = { value = 800.0, unit = "N.s/m" }
c2 = { value = 2500.0, unit = "N.s/m" }
d = { value = 90.0, unit = "N.s2/m2" }
h = { value = 9.0, unit = "m" }
[coordinates]
zs = { unit = "m", start = 0.3, velocity = -0.4 }
zu = { unit = "m", start = 0.1, velocity = 0.5 }
[inputs]
u = { start = 0.2, unit = "1" }
[bodies.top]
mass = 300
position = [0, "zs + h"]
[bodies.bottom]
mass = 40
position = [0, "zu"]
[springs.k]
stiffness = 2e4
elongation = "zs - zu"
"""
FORCE = "(1 + u)*(c1*max(0, {0}) + c2*min(0, {0})) + d*abs({0})*{0}"
DAMPER = f'[dampers.shock]\nforce = "{FORCE.format("rate")}"\n'
BY_RATE = DAMPER + 'rate = "zs_dot - zu_dot"\n'
BETWEEN = DAMPER + 'between = ["top", "bottom"]\n'
AS_FORCES = f'[forces]\nzs = "-({FORCE.format("(zs_dot - zu_dot)")})"\nzu = "{FORCE.format("(zs_dot - zu_dot)")}"\n'

ARM = """
[mechanism]
name = "arm"
[parameters]
k = { value = 3.0 }
[coordinates]
a = { start = 0.4, velocity = 0.9 }
b = { start = -0.3, velocity = -1.2 }
[inputs]
F = { start = 0.3 }
[frames.upper]
rotations = [["y", "a"]]
[frames.lower]
parent = "upper"
origin = [0, 0, -1]
rotations = [["x", "b"]]
[bodies.one]
frame = "upper"
center = [0, 0, -1]
mass = 1
[bodies.two]
frame = "lower"
center = [0.1, 0, -1]
mass = 2
inertia = [0.1, 0.2, 0.3, 0, 0, 0]
[points.wall]
position = [0.5, 0.3, -0.2]
frame = "world"
[dampers.shock]
force = "k*rate**3 + F*tanh(rate) + a*rate"
between = ["two", "wall"]
"""


def states(mechanism: Mechanism) -> list[dict[str, float]]:
    """Some states, with the parameters' own values."""
    own = {p.name: p.value for p in mechanism.parameters}
    return [dict(at) | own for at in samples(mechanism, 4)]


def accelerations(mechanism: Mechanism) -> np.ndarray:
    """The accelerations of the graph at ``states``, (states, n)."""
    equations = derive(mechanism)
    assert equations.solution is not None
    return np.array([equations.graph.evaluate(equations.solution.x, at) for at in states(mechanism)])


@pytest.mark.parametrize("damper", [BY_RATE, BETWEEN])
def test_a_damper_with_a_force_is_the_same_as_generalized_forces(damper: str) -> None:
    found, same = (accelerations(read(CAR + text, "car.toml")) for text in (damper, AS_FORCES))
    assert np.abs(found).max() > 1.0
    assert found == pytest.approx(same, rel=1e-12)


def test_quadratic_drag_slows_down_as_the_closed_form_says() -> None:
    """Of m v' = -c |v| v the solution is v = v0 / (1 + c v0 t / m), so that v' = -c v^2 / m."""
    text = (
        '[mechanism]\nname = "drag"\n[coordinates]\nx = { velocity = 3.0 }\n[bodies.b]\nmass = 2\nposition = ["x", 0]\n'
    )
    mechanism = read(text + '[dampers.air]\nforce = "0.5*abs(rate)*rate"\nrate = "x_dot"\n', "drag.toml")
    for found, at in zip(accelerations(mechanism), states(mechanism), strict=True):
        drag = 0.5 * abs(at["x_dot"]) * at["x_dot"]
        assert found == pytest.approx([(at["Q_x"] - drag) / 2], rel=1e-14)


@pytest.mark.parametrize("text", [CAR + BY_RATE, CAR + BETWEEN, ARM])
def test_the_independent_path_agrees(text: str) -> None:
    """In NumPy and compiled, in the plane and on frames; the text is written back as it was."""
    mechanism = read(text, "m.toml")
    assert read(write(mechanism), "m.toml") == mechanism
    independent = Equations(mechanism)
    energies = independent.energies
    single = single_state(independent.energies, independent.scale)
    assert single is not None
    for found, at in zip(accelerations(mechanism), states(mechanism), strict=True):
        q = np.array([at[c.name] for c in mechanism.coordinates])
        qd = np.array([at[c.name + "_dot"] for c in mechanism.coordinates])
        state = energies.state(at["t"], q, qd, {name: at[name] for name in energies.input_names})
        for qdd in (independent.rates(state)[0], single.rates(at["t"], np.concatenate([q, qd]), state.inputs)[0]):
            assert found == pytest.approx(qdd, rel=1e-10)


def test_faults_of_dampers_are_named() -> None:
    wrong = {
        'damping = 1\nforce = "rate"\nrate = "zs_dot"': "give either 'damping' or 'force'",
        'rate = "zs_dot"': "give either 'damping' or 'force'",
        'force = "c1*rate**2"\nrate = "zs_dot"': r"dampers.shock.force: .* expected N",
        'damping = "rate"\nrate = "zs_dot"': "undefined symbol 'rate'",
        'force = "c1*rate"\nrate = "rate"': "'rate' is a damper's own rate and cannot stand here",
    }
    for text, message in wrong.items():
        with pytest.raises(MechanismError, match=message):
            read(f"{CAR}[dampers.shock]\n{text}\n", "car.toml")
    with pytest.raises(MechanismError, match="calls something else so too"):
        read(CAR.replace("c1 =", "rate = { value = 1 }\nc1 =") + BY_RATE, "car.toml")
