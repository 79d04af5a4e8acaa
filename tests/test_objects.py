"""What objects of the package show of themselves, and in which forms results come."""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
import sympy as sp

import lag2fmu
from lag2fmu.errors import DerivationError, LoadError, SimulationError
from lag2fmu.language.expressions import symbol
from lag2fmu.reference import Trajectory
from lag2fmu.verify import Check, Report

RUN = Trajectory.of([0.0, 1.0, 2.0], {"theta": [1.0, -2.0, 0.5], "theta_dot": [0.0, 1.0, 2.0]})


def test_objects_are_short_in_a_line_and_show_themselves_in_a_notebook() -> None:
    mechanism = lag2fmu.load("double_pendulum")
    equations = lag2fmu.derive(mechanism)
    report = Report("A run", (Check("step <1>", 1.0, 0.5),), (), ("theta",), {})
    linearization = lag2fmu.linearize(mechanism)
    for thing in (mechanism, equations, RUN, report, linearization):
        assert len(repr(thing)) < 200
    assert repr(mechanism).startswith("<Mechanism double_pendulum: Double pendulum")
    assert repr(linearization) == "<Linearization of double_pendulum: 4 states, 2 inputs, 6 outputs>"
    assert repr(RUN) == "<Trajectory: 3 points, 0 s to 2 s, of theta, theta_dot>"
    assert repr(report) == "<Report: A run; FAILED: step <1>>"
    assert "theta1" in mechanism._repr_html_()
    assert "<svg" in mechanism._repr_html_()
    assert r"\ddot{\theta}_{1}" in equations._repr_latex_()
    assert "<td>-2</td>" in RUN._repr_html_()
    assert "<td>step &lt;1&gt;</td><td>1.00e+00</td><td>5.00e-01</td><td><b>FAILED</b></td>" in report._repr_html_()


def test_a_report_is_text_in_a_notebook_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a kernel of Jupyter, rich shows tables by itself unless it is told not to."""
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    assert "step" in str(Report("A run", (Check("step", 1.0, 0.5),), (), ("theta",), {}))


def test_a_trajectory_is_a_film() -> None:
    film = Trajectory.of([0.0, 0.04], {"theta": [1.0, 0.9]}).animate("pendulum")
    assert film.gif.startswith(b"GIF8")
    assert film._repr_html_().startswith('<img alt="the motion" src="data:image/gif;base64,R0lGOD')


@pytest.mark.fmu
def test_an_fmu_shows_its_page(exported, tmp_path) -> None:
    fmu = exported("pendulum")
    shown = fmu._repr_html_()
    assert 'srcdoc="&lt;!DOCTYPE html&gt;' in shown
    assert "<td>theta</td><td>output</td><td>rad</td>" in shown
    gone = replace(fmu, path=tmp_path / "gone.fmu")
    assert "<iframe" not in gone._repr_html_()


def test_equations_as_sympy() -> None:
    """m l^2 theta_ddot = -m g l sin(theta) + Q_theta, and L = m l^2 theta_dot^2 / 2 + m g l cos(theta)."""
    found = lag2fmu.derive("pendulum").sympy
    m, length, g, theta, rate = (symbol(name) for name in ("m", "l", "g", "theta", "theta_dot"))
    assert sp.simplify(found.mass_matrix[0, 0] - m * length**2) == 0
    lagrangian = m * length**2 * rate**2 / 2 + m * g * length * sp.cos(theta)
    assert sp.simplify(found.lagrangian - lagrangian).free_symbols <= {m, length, g}
    (equation,) = found.equations
    expected = m * length**2 * symbol("theta_ddot") - symbol("Q_theta") + m * g * length * sp.sin(theta)
    assert sp.simplify((equation.lhs - equation.rhs - expected).subs(symbol("c"), 0)) == 0
    assert found.forcing.shape == (1, 1)


def test_analyses_are_verbs_of_the_package() -> None:
    """A pendulum of 1 m swings with sqrt(g / l) about the bottom."""
    pendulum = lag2fmu.load("pendulum")
    values = {p.name: p.value for p in pendulum.parameters}
    (mode,) = lag2fmu.modes(pendulum)
    assert mode.frequency == pytest.approx(np.sqrt(values["g"] / values["l"]), rel=1e-9)
    assert lag2fmu.equilibria("pendulum")[0].q == pytest.approx([0.0], abs=1e-9)
    assert lag2fmu.linearize(pendulum, q=np.zeros(1), qd=np.zeros(1)).stiffness[0, 0] > 0


def test_results_in_other_forms(monkeypatch) -> None:
    figure = RUN.plot("theta")
    assert figure.axes[0].lines[0].get_ydata() == pytest.approx(RUN["theta"])
    for package, export in (("pandas", RUN.to_pandas), ("xarray", RUN.to_xarray)):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, package, None)
            with pytest.raises(SimulationError, match=f"pip install {package}"):
                export()
    if find_spec("xarray"):
        assert float(RUN.to_xarray()["theta"].sel(time=1.0)) == -2.0
    table = pytest.importorskip("pandas") and RUN.to_pandas()
    assert table["theta"].loc[1.0] == -2.0


def test_runs_of_an_ensemble_in_other_forms() -> None:
    xarray, pandas = pytest.importorskip("xarray"), pytest.importorskip("pandas")
    asked = {"starts": {"theta": [0.1, 0.2]}, "stop_time": 1.0, "extremes": ["theta"], "outputs": ["theta"]}
    ensemble = lag2fmu.Ensemble("pendulum")
    runs = ensemble.run(**asked, samples=3)
    found = runs.to_xarray()
    assert isinstance(found, xarray.Dataset)
    assert found["theta"].sel(run=1).values.tolist() == runs["theta"][1].tolist()
    assert found["theta_maximum"].values.tolist() == runs.maximum["theta"].tolist()
    frame = runs.to_pandas()
    assert frame.loc[(1, 0.5), "theta"] == runs["theta"][1, 1]
    ends = ensemble.run(**asked).to_pandas()
    assert isinstance(ends, pandas.DataFrame)
    assert ends["theta_final"].tolist() == runs.final["theta"].tolist()


def test_runs_without_their_packages_name_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = lag2fmu.Ensemble("pendulum").run(stop_time=0.1)
    for package in ("xarray", "pandas"):
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(LoadError, match=f"pip install {package}"):
            getattr(runs, f"to_{package}")()


def test_state_spaces_and_calibrations_are_printed_to_be_read() -> None:
    space = lag2fmu.linearize("cart_pole").state_space(["F"])
    assert repr(space) == "<StateSpace of cart_pole at t = 0 s: 4 states, 1 inputs, 6 outputs>"
    text = str(space)
    assert "x: x [m], theta [rad], x_dot [m/s], theta_dot [rad/s]\nu: F [N]\n" in text
    assert "-1.168328" in text
    assert "drift" in text
    time = np.linspace(0.0, 3.0, 40)
    swing = lag2fmu.simulate("pendulum", stop_time=3.0, step=3 / 39, values={"l": 0.8})
    noise = np.random.default_rng(1).normal(0, 1e-3, 40)
    found = lag2fmu.calibrate("pendulum", {"time": time, "theta": swing["theta"] + noise}, free=["l"])
    assert repr(found).startswith("<Calibration of pendulum: l = 0.8")
    assert str(found).startswith("Calibration of pendulum, 39 degrees of freedom, SI units\nl = 0.8")


def test_every_verb_takes_values() -> None:
    """A pendulum of length l swings with sqrt(g / l), whatever l the model has."""
    values, stiff = {"l": 0.25}, -9.81 / 0.25
    assert lag2fmu.linearize("pendulum", "equilibrium", values=values).A[1, 0] == pytest.approx(stiff)
    derived = lag2fmu.derive("pendulum", values=values)
    assert lag2fmu.linearize(derived, "equilibrium").A[1, 0] == pytest.approx(stiff)
    assert lag2fmu.modes("pendulum", values=values)[0].frequency == pytest.approx(np.sqrt(-stiff))
    assert lag2fmu.equilibria("pendulum", values={"theta": 3.0})[0].q == pytest.approx([np.pi])
    assert lag2fmu.function("pendulum", values=values)([0.1, 0.0])[1] == pytest.approx(stiff * np.sin(0.1))
    whole = lag2fmu.Ensemble("pendulum", values=values | {"theta": 0.1}).run(stop_time=1.0)
    given = lag2fmu.Ensemble("pendulum").run(starts={"theta": 0.1}, parameters=values, stop_time=1.0)
    assert whole.final["theta"] == pytest.approx(given.final["theta"], abs=1e-6)


def test_words_that_are_none_and_a_text_for_a_list_are_refused() -> None:
    with pytest.raises(DerivationError, match=r"no method 'Hamilton' .* known are elimination, factorisation"):
        lag2fmu.derive("pendulum", "Hamilton")
    with pytest.raises(LoadError, match=r"'Q_theta' is one text; give a list of names"):
        lag2fmu.linearize("pendulum").state_space("Q_theta")
    with pytest.raises(LoadError, match=r"'theta_ddot' is one text; give a list of names"):
        lag2fmu.export("pendulum", outputs="theta_ddot")
