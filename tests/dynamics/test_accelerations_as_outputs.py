"""Outputs that contain accelerations: of a quarter car, which is free, and of a bead on a wire, which is tied."""

from __future__ import annotations

import math

import pytest
from describing import described

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.starts import start_values
from lag2fmu.errors import MechanismError
from lag2fmu.fmu.dependencies import dependencies
from lag2fmu.formats.text import read
from lag2fmu.formats.write import write
from lag2fmu.reference import Equations

CAR = """
[mechanism]
name = "car"
strict_units = true
[parameters]
ms = { value = 300.0, unit = "kg" }
mu = { value = 40.0, unit = "kg" }
k = { value = 2e4, unit = "N/m" }
kt = { value = 1.5e5, unit = "N/m" }
c = { value = 1200.0, unit = "N.s/m" }
[coordinates]
zs = { unit = "m", start = 0.02 }
zu = { unit = "m", start = -0.01, velocity = 0.3 }
[inputs]
road = { unit = "m", start = 0.03, motion = true }
[energy]
kinetic = "ms*zs_dot**2/2 + mu*zu_dot**2/2"
potential = "k*(zs - zu)**2/2 + kt*(zu - road)**2/2"
dissipation = "c*(zs_dot - zu_dot)**2/2"
[outputs]
comfort = { expression = "zs_ddot", unit = "m/s2" }
load = { expression = "mu*zu_ddot + ms*zs_ddot", unit = "N" }
"""
WIRE = """
[mechanism]
name = "wire"
[coordinates]
x = { unit = "m", start = 0.5, velocity = 1.0 }
y = { unit = "m", guess = 0.2 }
[energy]
kinetic = "(x_dot**2 + y_dot**2)/2"
potential = "9.81*y"
[constraints.holonomic]
wire = "y - x**2"
[outputs]
felt = { expression = "x_ddot**2 + (y_ddot + 9.81)**2" }
"""


@pytest.mark.parametrize("text", [CAR, WIRE])
def test_an_output_may_contain_accelerations(text: str) -> None:
    """As on the independent path; through text and into the sources of an FMU."""
    mechanism = read(text, "m.toml")
    assert read(write(mechanism), "m.toml") == mechanism
    equations, independent = derive(mechanism), Equations(mechanism)
    q, qd = independent.energies.start()
    values = start_values(equations.mechanism)
    qdd = independent.accelerations(0.0, q, qd)
    values |= {f"{c.name}_ddot": a for c, a in zip(mechanism.coordinates, qdd, strict=True)}
    expected = independent.outputs(0.0, q, qd)
    for name, node in equations.outputs.items():
        assert equations.graph.evaluate([node], values) == pytest.approx([float(expected[name])], rel=1e-12)
    if text == CAR:
        by_hand = (-2e4 * (0.02 + 0.01) + 1200 * 0.3) / 300
        assert float(expected["comfort"]) == pytest.approx(by_hand, rel=1e-12)
        assert {"zs", "zu", "zs_dot", "zu_dot", "Q_zs"} <= dependencies(equations)["comfort"]
    described(mechanism, ["all"])


def test_accelerations_stand_in_outputs_only() -> None:
    with pytest.raises(MechanismError, match=r"'zs_ddot' is an acceleration and cannot stand here"):
        read(CAR.replace("c*(zs_dot - zu_dot)**2/2", "c*zs_ddot**2/2"), "m.toml")


def test_what_may_not_stand_in_a_force_is_no_remedy_for_a_name_that_is_none() -> None:
    force = '[forces]\nzs = "-{0}"\n'
    with pytest.raises(MechanismError, match=r"'zs_ddot' is an acceleration .* belongs to a kinetic energy"):
        read(CAR + force.format("zs_ddot"), "m.toml")
    with pytest.raises(MechanismError, match=r"undefined symbol 'b'; known are t, (?!.*z[su]_ddot)"):
        read(CAR + force.format("b"), "m.toml")


SWING = """
[mechanism]
name = "swing"
[coordinates]
phi = { unit = "rad", start = 0.4, velocity = 1.2 }
[inputs]
x0 = { unit = "m", motion = true }
[parameters]
l = { value = 0.8, unit = "m" }
"""
IN_THE_PLANE = """
[bodies.bob]
mass = 2
position = ["x0 + l*sin(phi)", "-l*cos(phi)"]
[outputs]
felt = { point = "bob", quantity = "acceleration" }
"""
IN_SPACE = """
[frames.rod]
origin = ["x0", 0, 0]
rotations = [["y", "-phi"]]
[bodies.bob]
frame = "rod"
center = [0, 0, "-l"]
mass = 2
[outputs]
felt = { point = "bob", quantity = "acceleration" }
"""


@pytest.mark.parametrize("body", [IN_THE_PLANE, IN_SPACE])
def test_a_point_has_an_acceleration(body: str) -> None:
    """x = x0 + l sin(phi), hence a = x0'' + l (phi'' cos(phi) - phi'^2 sin(phi)), upwards alike; on both paths."""
    mechanism = read(SWING + body, "m.toml")
    assert read(write(mechanism), "m.toml") == mechanism
    equations, independent = derive(mechanism), Equations(mechanism)
    inputs = {"x0": 0.3, "x0_dot": -0.7, "x0_ddot": 1.9, "Q_phi": 0.5}
    (phi,), (spin,) = q, qd = independent.energies.start()
    (turn,) = independent.accelerations(0.0, q, qd, inputs)
    expected = {
        "felt_x": 1.9 + 0.8 * (turn * math.cos(phi) - spin**2 * math.sin(phi)),
        "felt_y": 0.0,
        "felt_z": 0.8 * (turn * math.sin(phi) + spin**2 * math.cos(phi)),
    }
    if body == IN_THE_PLANE:
        expected["felt_y"] = expected.pop("felt_z")
    values = start_values(equations.mechanism) | inputs | {"phi_ddot": turn}
    found = independent.outputs(0.0, q, qd, inputs)
    for name, number in expected.items():
        assert float(found[name]) == pytest.approx(number, rel=1e-12, abs=1e-14)
        assert equations.graph.evaluate([equations.outputs[name]], values) == pytest.approx([number], abs=1e-13)
    assert {"x0_ddot", "Q_phi", "phi_dot"} <= dependencies(equations)["felt_x"]
    described(mechanism, ["all"])
