"""Outputs that contain accelerations: of a quarter car, which is free, and of a bead on a wire, which is tied."""

from __future__ import annotations

import pytest
from describing import described

from lag2fmu.dynamics import derive
from lag2fmu.dynamics.samples import start_values
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
