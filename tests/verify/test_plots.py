"""The figures: files that are not blank, what they show, and sentences for what does not apply."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.language.expressions import symbol
from lag2fmu.mechanism import Mechanism
from lag2fmu.mechanism.display import display_units
from lag2fmu.reference import Trajectory, integrate
from lag2fmu.verify.plots import comparison, mechanism_figure, motion_figure, save

pytestmark = pytest.mark.long


def foot(figure: Figure) -> str:
    return "" if figure._supxlabel is None else " ".join(figure._supxlabel.get_text().split())


def titles(figure: Figure) -> list[str]:
    return [axes.get_title() for axes in figure.axes if axes.get_title()]


def motion(mechanism: Mechanism, stop: float = 0.5) -> Trajectory:
    return integrate(mechanism, np.linspace(0.0, stop, 51), rtol=1e-9).trajectory


# ------------------------------------------------------------------------------------------------ show --plot


def test_the_modes_of_a_double_pendulum_have_their_frequencies(tmp_path: Path) -> None:
    """omega^2 = (2 +- sqrt(2)) g/l for equal masses and lengths: Landau, Lifshitz, section 23, problem 2."""
    figure = mechanism_figure(load("double_pendulum"))
    expected = np.sqrt((2 + np.array([-1, 1]) * np.sqrt(2)) * 9.81) / (2 * np.pi)
    assert titles(figure) == [f"mode {i}: {f:.4g} Hz" for i, f in enumerate(expected, 1)]
    save(figure, tmp_path / "x.png")
    assert np.std(imread(tmp_path / "x.png")[:, :, 0]) > 0.02


def test_an_svg_is_the_same_each_time(tmp_path: Path) -> None:
    for name in ("a.svg", "b.svg"):
        save(mechanism_figure(load("pendulum")), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    ElementTree.parse(tmp_path / "a.svg")


@pytest.mark.parametrize(
    ("model", "sentence"),
    [
        ("kepler", "There are no normal modes: no equilibrium was found."),
        ("heavy_top", "There are no normal modes: the mass matrix is singular at the state"),
        ("vertically_driven_pendulum", "There are no normal modes: the equations change with time."),
        ("rolling_disc", "rolling_x, rolling_y"),
        ("parallel_manipulator", "no motion has a restoring force"),
        ("triatomic_molecule", "1 without a restoring force"),
    ],
)
def test_what_does_not_apply_is_told(model: str, sentence: str) -> None:
    assert sentence in foot(mechanism_figure(load(model)))


def test_the_inputs_that_modes_are_about_are_named() -> None:
    assert "with the inputs at their start values, F = 0 N" in foot(mechanism_figure(load("cart_pole")))


def test_slow_modes_come_first_and_the_others_are_counted() -> None:
    figure = mechanism_figure(load("n_pendulum", {"n": 10}))
    assert len(titles(figure)) == 8
    assert "2 faster modes are left out." in foot(figure)


@pytest.mark.parametrize(("model", "title"), [("wilberforce_pendulum", "potential energy and configuration path")])
def test_without_bodies_the_potential_is_drawn(model: str, title: str) -> None:
    assert title in titles(mechanism_figure(load(model)))


def test_without_a_potential_the_coordinates_are_drawn_over_time() -> None:
    """A potential that is flat says nothing of where two flywheels turn."""
    figure = mechanism_figure(load("clutch_pair"))
    assert [axes.get_ylabel() for axes in figure.axes] == ["φ₁ in rad", "φ₂ in rad"]
    time, phi = figure.axes[0].lines[0].get_data()
    assert time[-1] == 10.0
    assert np.all(np.diff(phi) > 0)
    assert "its potential energy is constant" in foot(figure)


def test_one_coordinate_without_bodies_moves_in_its_potential() -> None:
    free = replace_bodies(load("anharmonic_oscillator"))
    curve = mechanism_figure(free).axes[0].lines[0]
    values = {p.name: p.value for p in free.parameters}
    x, V = curve.get_data()
    written = free.energy.potential.xreplace({symbol(name): value for name, value in values.items()})
    q = symbol(free.coordinates[0].name)
    np.testing.assert_allclose(V, [float(written.subs(q, at)) for at in x], rtol=1e-9, atol=1e-12)


def replace_bodies(mechanism: Mechanism) -> Mechanism:
    """The same with its kinetic energy written, without a body."""
    (body,) = mechanism.bodies
    (c,) = mechanism.coordinates
    energy = replace(mechanism.energy, kinetic=body.mass * symbol(f"{c.name}_dot") ** 2 / 2)
    return Mechanism(
        "free",
        coordinates=mechanism.coordinates,
        parameters=mechanism.parameters,
        energy=energy,
        experiment=mechanism.experiment,
    )


def test_nothing_to_draw_is_said_with_the_remedy() -> None:
    with pytest.raises(LoadError, match=r"'charged_particle' has no bodies or points: .* give it a point, e\.g\."):
        mechanism_figure(load("charged_particle"))


# ------------------------------------------------------------------------------------------------ simulate --plot


def test_a_run_is_shown_in_time_and_in_both_spaces(tmp_path: Path) -> None:
    mechanism = load("double_pendulum")
    run = motion(mechanism)
    figure = motion_figure(mechanism.title, run, mechanism)
    assert titles(figure)[:2] == ["coordinates", "velocities"]
    assert {"energies", "paths of the bodies", "configuration path", "phase portrait"} <= set(titles(figure))
    panels = {axes.get_title(): axes for axes in figure.axes}
    path = panels["configuration path"].lines[0].get_xydata()
    assert len(path) > 1000
    np.testing.assert_array_equal(path[:: len(path) // 50], run.columns(["theta1", "theta2"]))
    drift = next(axes for title, axes in panels.items() if title.startswith("drift of the conserved energy"))
    assert np.abs(drift.lines[0].get_ydata()).max() < 1e-6
    T, V, total = (line.get_ydata() for line in panels["energies"].lines)
    theta1, theta2 = run["theta1"], run["theta2"]
    np.testing.assert_allclose(V, -9.81 * (2 * np.cos(theta1) + np.cos(theta2)), rtol=1e-12)
    np.testing.assert_allclose(T + V, total)
    save(figure, tmp_path / "x.png")
    assert np.std(imread(tmp_path / "x.png")[:, :, 0]) > 0.02


def test_curves_between_few_points_follow_the_motion() -> None:
    """The path between ten points is that of a run with a thousand, to the fourth order of their distance."""
    mechanism = load("double_pendulum")
    coarse, fine = (integrate(mechanism, np.linspace(0.0, 0.5, n), rtol=1e-9).trajectory for n in (11, 1001))
    axes = next(a for a in motion_figure("x", coarse, mechanism).axes if a.get_title() == "coordinates")
    for line, name in zip(axes.lines, ("theta1", "theta2"), strict=True):
        time, column = line.get_data()
        assert np.abs(column - np.interp(time, fine.time, fine[name])).max() < 1e-3 * np.ptp(fine[name])


CRANE = """
[mechanism]
name = "crane"
[parameters]
m = { value = 50, unit = "kg" }
l = { value = 2, unit = "m" }
[coordinates]
x = { unit = "mm", start = 100 }
theta = { unit = "deg", start = 30 }
[inputs]
F = { unit = "kN" }
[gravity]
acceleration = "9.81"
[bodies.trolley]
mass = "2*m"
position = ["x", "0"]
[bodies.load]
mass = "m"
position = ["x + l*sin(theta)", "-l*cos(theta)"]
[forces]
x = "F"
[outputs]
number = { expression = "theta", unit = "1" }
"""


def test_axes_have_one_display_unit_each() -> None:
    """Inputs, coordinates and velocities in the units they are declared in; never metres beside radians."""
    mechanism = read(CRANE, "crane.toml")
    run = motion(mechanism)
    signals = Trajectory.of([0.0, 0.5], {"F": [0.0, 2000.0]})
    figure = motion_figure("crane", run, mechanism, signals)
    found = [(a.get_title(), a.get_ylabel(), [line.get_label() for line in a.lines]) for a in figure.axes]
    assert ("inputs", "in kN", ["F"]) in found
    assert ("coordinates", "in mm", ["x"]) in found
    assert ("coordinates", "in deg", ["θ"]) in found
    assert ("velocities", "in deg/s", ["dθ/dt"]) in found
    assert ("outputs", "", ["number"]) in found
    histories = [a for a in figure.axes if a.get_title() in ("inputs", "coordinates")]
    lines = {line.get_label(): line.get_ydata() for a in histories for line in a.lines}
    assert lines["F"].tolist() == [0.0, 2.0]
    assert [lines["x"][0], lines["θ"][0]] == pytest.approx([100.0, 30.0])
    direct = comparison("x", ["x", "theta"], {"a": run, "b": run}, display_units(mechanism))
    assert [a.get_ylabel() for a in direct.axes] == ["in mm", "in deg", "largest |difference| / range"]


def test_damping_is_not_called_a_drift() -> None:
    mechanism = load("spring_mass_damper")
    found = titles(motion_figure("x", motion(mechanism), mechanism))
    assert any(title.startswith("change of the energy h, which is not conserved") for title in found)


PUSHED = """
[mechanism]
name = "pushed"
[coordinates]
x = {{ unit = "m" }}
[inputs]
F = {{ unit = "N", start = {start} }}
[forces]
x = "F"
[bodies.weight]
mass = 2
position = ["x", 0]
"""


def test_energy_that_inputs_change_is_not_called_a_drift() -> None:
    """It is conserved for inputs of zero only: a start of an input, or a signal, does work."""
    time = np.linspace(0.0, 1.0, 5)
    rising = Trajectory(time, ("F",), time[:, None])
    run = Trajectory(time, ("x", "x_dot"), np.stack([time**2 / 2, time], axis=1))
    for start, signals, expected in (
        (0, None, "drift of the conserved energy h"),
        (2, None, "change of the energy h, which is not conserved"),
        (0, rising, "change of the energy h, which is not conserved"),
    ):
        found = titles(motion_figure("x", run, read(PUSHED.format(start=start), "pushed"), signals))
        assert any(title.startswith(expected) for title in found)


def test_many_coordinates_stay_legible() -> None:
    mechanism = load("n_pendulum", {"n": 12})
    figure = motion_figure("x", motion(mechanism, 0.01), mechanism)
    assert max(len(axes.lines) for axes in figure.axes if axes.get_title() in ("coordinates", "velocities")) == 8
    assert "Of 12 coordinates in rad the first 8 are drawn." in foot(figure)
    assert "Of 12 bodies' paths the first 8 are drawn." in foot(figure)


def test_one_coordinate_has_no_configuration_path() -> None:
    mechanism = load("pendulum")
    found = titles(motion_figure("x", motion(mechanism), mechanism))
    assert "phase portrait" in found
    assert "configuration path" not in found


def test_a_run_of_another_tool_is_drawn_column_by_column() -> None:
    run = Trajectory.of(np.linspace(0, 1, 5), {f"y{i}": np.arange(5.0) for i in range(14)})
    figure = motion_figure("other", run)
    assert len(figure.axes) == 12
    assert "Of 14 columns the first 12 are drawn." in foot(figure)


def test_impacts_are_marked_and_velocities_jump_there(tmp_path: Path) -> None:
    """A ball that strikes the floor at 0.4515 s, between two times: no curve goes beyond the velocities there."""
    g, strike, e = 9.81, np.sqrt(2 / 9.81), 0.8
    t = np.linspace(0.0, 0.6, 13)
    late = np.maximum(t - strike, 0.0)
    up = e * g * strike
    y = np.where(t < strike, 1 - g * t**2 / 2, up * late - g * late**2 / 2)
    speed = np.where(t < strike, -g * t, up - g * late)
    struck = (t >= strike).astype(float)
    columns = {"y": y, "y_dot": speed, "floor_mode": 1 + 0 * t, "floor_impacts": struck, "floor_impulse": 2 * struck}
    figure = motion_figure("ball", Trajectory.of(t, columns), load("bouncing_ball"))
    assert {"modes", "impulses of impacts"} <= set(titles(figure))
    panels = {axes.get_title(): axes for axes in figure.axes}
    curve, marks = panels["velocities"].lines
    assert curve.get_ydata().max() == pytest.approx(speed.max())
    assert curve.get_ydata().min() == pytest.approx(speed.min())
    assert list(marks.get_xdata()) == [t[t >= strike][0]]
    assert panels["impulses of impacts"].get_ylabel() == "in kg.m/s"
    save(figure, tmp_path / "x.png")
