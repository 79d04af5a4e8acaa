"""Operating points: where inputs hold the mechanism, where nothing can move, and analyses that fail."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest

from lag2fmu.analysis import analysis_report, analysis_sections, equilibria, linearize, stiffness
from lag2fmu.dynamics import derive
from lag2fmu.errors import DerivationError
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Mechanism

PUSHED = """
[mechanism]
name = "pushed"
[coordinates]
theta = { unit = "rad", start = 0.2 }
[inputs]
M = { unit = "N.m", start = 4.0 }
[energy]
kinetic = "theta_dot**2/2"
potential = "-8*cos(theta)"
[forces]
theta = "M"
"""
PIVOTS = {"a": (0.0, 0.0), "b": (1.0, 0.0), "c": (0.4, 0.7)}


def platform() -> Mechanism:
    """A plate on three equal cranks: it moves while these are parallel, and is rigid where they are not."""
    rows = []
    for one, other in (("a", "b"), ("b", "c"), ("c", "a")):
        x, y = (p - q for p, q in zip(PIVOTS[other], PIVOTS[one], strict=True))
        across, up = (f"({d} + 0.3*{f}({other}) - 0.3*{f}({one}))**2" for d, f in ((x, "cos"), (y, "sin")))
        rows.append(f'{one}{other} = "{across} + {up} - {x * x + y * y!r}"')
    angles = "".join(f'{q} = {{ unit = "rad", start = 0.5, velocity = 1.0 }}\n' for q in PIVOTS)
    energy = 'kinetic = "0.05*(a_dot**2 + b_dot**2 + c_dot**2)"\npotential = "3*(sin(a) + sin(b) + sin(c))"'
    text = f'[mechanism]\nname = "platform"\n[coordinates]\n{angles}[energy]\n{energy}\n[constraints.holonomic]\n'
    return read(text + "\n".join(rows), "platform.toml")


def test_operating_points_are_those_of_the_inputs() -> None:
    """sin(theta) = M/8; small motions about it by omega^2 = 8 cos(theta)."""
    equations = derive(read(PUSHED, "pushed.toml"))
    assert equilibria(equations)[0].q == pytest.approx([np.arcsin(0.5)], abs=1e-9)
    (place,) = (e.q for e in equilibria(equations, most=1, inputs={"M": -2.0}))
    assert place == pytest.approx([np.arcsin(-0.25)], abs=1e-9)
    about = linearize(equations, place, np.zeros(1), inputs={"M": -2.0})
    assert about.eigenvalues == pytest.approx(np.array([-1j, 1j]) * np.sqrt(8 * np.cos(place[0])), abs=1e-9)
    assert about.values["M"] == -2.0
    with pytest.raises(DerivationError, match="'N' is no input; known are Q_theta, M"):
        linearize(equations, inputs={"N": 1.0})
    assert analysis_report(read(PUSHED, "pushed.toml")).count("with the inputs at their start values, M = 4 N.m") == 3


def test_operating_points_are_shown_in_declared_units() -> None:
    pushed = PUSHED.replace('"rad", start = 0.2', '"deg", start = 10').replace(
        '"N.m", start = 4.0', '"kN.m", start = 0.004'
    )
    report = analysis_report(read(pushed, "pushed.toml"))
    assert "theta = 30 deg" in report
    assert report.count("with the inputs at their start values, M = 0.004 kN.m") == 3
    assert report.count(", in SI units") == 1


def test_where_nothing_can_move_it_is_rigid() -> None:
    lines = [str(line) for section in analysis_sections(derive(platform())) for line in section.lines]
    assert any(line.endswith(": rigid, nothing can move there.") for line in lines)
    assert any(line.endswith(": small motions do not grow.") for line in lines)


def test_no_failure_of_an_analysis_stops_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise np.linalg.LinAlgError("SVD did not converge")

    for module, name in (("report", "conserved"), ("report", "equilibria"), ("linearization", "linearize")):
        monkeypatch.setattr(import_module(f"lag2fmu.analysis.{module}"), name, fails)
    equations = derive("pendulum")
    first, second, *_ = analysis_sections(equations)
    assert str(first.lines[0]) == "This could not be found: LinAlgError, SVD did not converge"
    assert "None was found" in str(second.lines[0])
    assert stiffness(equations) is None


def test_a_hamiltonian_without_a_value_is_not_printed() -> None:
    """y has no mass: p_y does not determine its velocity."""
    text = PUSHED.replace("[inputs]", 'y = { unit = "m", guess = 0.1 }\n[inputs]').replace(
        "-8*cos(theta)", "-8*cos(theta) + 50*(y - theta)**2"
    )
    report = analysis_report(read(text, "pushed.toml"))
    assert "zoo" not in report
    assert "the mass matrix is singular" in report


@pytest.mark.filterwarnings("error")
def test_a_further_state_without_derivatives_is_named() -> None:
    """The square root has none at 0; NumPy has nothing to say of it."""
    text = (
        '[mechanism]\nname = "tank"\n[coordinates]\nx = { velocity = -1 }\n[bodies.b]\nmass = 1\nposition = ["x", 0]\n'
    )
    mechanism = read(text + '[states]\nlevel = { derivative = "sqrt(max(0, -x))" }\n', "tank.toml")
    with pytest.raises(DerivationError, match="a further state has no finite derivatives"):
        linearize(derive(mechanism))
