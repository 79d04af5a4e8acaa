"""Tables of measured data in FMUs: values against SciPy, a motor's torque curve, what is said outside the data."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import fmpy
import numpy as np
import pytest
import sympy as sp
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.interpolate import CubicSpline, PchipInterpolator, RectBivariateSpline
from stepping import Stepping

from lag2fmu import export, simulate
from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.tables import interpolant
from lag2fmu.fmu import Fmu
from lag2fmu.language.vocabulary import Smooth
from lag2fmu.mechanism import Body, Contact, Energy, Mechanism, Output, Table, coordinate, signal

pytestmark = pytest.mark.fmu
Floats = NDArray[np.float64]

X, Y = np.array([-2.0, -1.1, 0.3, 0.9, 2.2, 3.0]), np.array([0.0, 0.5, 1.7, 2.0, 3.1])
LINE, GRID = np.array([0.3, 1.2, 0.8, -0.4, 0.1, 0.9]), np.random.default_rng(3).normal(size=(6, 5))


def lookups() -> Mechanism:
    """A free mass, and tables of its inputs as outputs."""
    x, a, b = coordinate("x", "m"), signal("a"), signal("b")
    tables = [
        Table("line", columns=[X, LINE]),
        Table("cubic", columns=[X, LINE], interpolation="cubic", outside="extrapolate"),
        Table("pchip", columns=[X, LINE], interpolation="pchip"),
        Table("grid", columns=[X, Y, GRID], outside="extrapolate"),
        Table("patches", columns=[X, Y, GRID], interpolation="cubic"),
    ]
    line, cubic, pchip, grid, patches = tables
    return Mechanism(
        "lookups",
        coordinates=[x],
        inputs=[a, b],
        tables=tables,
        energy=Energy(kinetic=x.dot**2 / 2),
        outputs=[
            *(Output(f"of_{table.name}", table(a)) for table in (line, cubic, pchip)),
            *(Output(f"of_{table.name}", table(a, b)) for table in (grid, patches)),
        ],
    )


LOOKUPS = lookups()
NAMES = [output.name for output in LOOKUPS.outputs]


def by_scipy(a: float, b: float) -> tuple[list[float], list[float]]:
    """Values of the outputs, and their derivatives by a, inside the data."""
    plane, surface = (RectBivariateSpline(X, Y, GRID, kx=k, ky=k).ev for k in (1, 3))
    i = int(np.searchsorted(X, a)) - 1
    width = X[i + 1] - X[i]
    values = [np.interp(a, X, LINE), CubicSpline(X, LINE)(a), PchipInterpolator(X, LINE)(a), plane(a, b), surface(a, b)]
    slopes = [
        (LINE[i + 1] - LINE[i]) / width,
        CubicSpline(X, LINE)(a, 1),
        PchipInterpolator(X, LINE)(a, 1),
        (plane(X[i + 1], b) - plane(X[i], b)) / width,
        surface(a, b, 1, 0),
    ]
    return [float(x) for x in values], [float(x) for x in slopes]


@pytest.mark.parametrize(("a", "b"), [(-1.7, 0.2), (0.31, 1.9), (2.9, 2.05), (-1.05, 3.05)])
def test_values_and_derivatives_are_those_of_scipy(a: float, b: float, exported: Callable[..., Fmu]) -> None:
    with Stepping(exported(LOOKUPS).path, "ModelExchange") as host:
        host.start()
        host.set({"a": a, "b": b})
        values, slopes = by_scipy(a, b)
        assert host.get(NAMES) == pytest.approx(values, rel=1e-14, abs=1e-14)
        assert host.derivative(NAMES, {"a": 1.0}) == pytest.approx(slopes, rel=1e-13, abs=1e-14)


def test_beyond_the_data_a_value_is_held_or_continued(exported: Callable[..., Fmu]) -> None:
    with Stepping(exported(LOOKUPS).path, "ModelExchange") as host:
        host.start()
        host.set({"a": 3.5, "b": 1.0})
        assert host.get(NAMES[:3]) == pytest.approx([0.9, float(CubicSpline(X, LINE)(3.5)), 0.9], rel=1e-14)
        slopes = host.derivative(NAMES, {"a": 1.0})
        assert slopes[:3] == pytest.approx([0.0, float(CubicSpline(X, LINE)(3.5, 1)), 0.0], rel=1e-13)
        corner = RectBivariateSpline(X, Y, GRID, kx=1, ky=1)
        last, before = (float(corner.ev(x, 1.0)) for x in (3.0, 2.2))
        assert host.get(["of_grid"]) == pytest.approx([last + 0.5 * (last - before) / 0.8], rel=1e-13)
        assert slopes[4] == 0.0


def fan(outside: str = "hold", kind: str = "pchip") -> Mechanism:
    """A wheel on a motor of a measured torque curve."""
    theta = coordinate("theta", "rad", velocity=1.0)
    torque = Table("torque", columns=[SPEED, TORQUE], interpolation=kind, outside=outside, units=["rad/s", "N.m"])
    return Mechanism(
        "fan",
        coordinates=[theta],
        tables=[torque],
        energy=Energy(kinetic=theta.dot**2 / 100),
        forces={theta: torque(theta.dot)},
    )


SPEED, TORQUE = [0.0, 10.0, 20.0, 40.0, 60.0], [1.0, 1.4, 1.5, 1.1, 0.6]


@pytest.mark.parametrize("solver", ["dopri5", "radau5", "gauss4"])
def test_a_motor_runs_up_as_its_torque_curve_says(solver: str, exported: Callable[..., Fmu]) -> None:
    """J dw/dt = M(w): the time to a speed is the integral of J/M(w), and the energy the integral of J w."""
    run = simulate(exported(FAN, solver=solver), stop_time=0.4, step=0.1, tolerance=1e-10, values=SETTINGS.get(solver))
    curve, reached = PchipInterpolator(SPEED, TORQUE), float(run["theta_dot"][-1])
    time, _ = quad(lambda w: 0.02 / float(curve(w)), 1.0, reached, points=SPEED[1:3], epsabs=1e-13)
    angle, _ = quad(lambda w: 0.02 * w / float(curve(w)), 1.0, reached, points=SPEED[1:3], epsabs=1e-13)
    assert time == pytest.approx(0.4, abs=1e-8)
    assert run["theta"][-1] == pytest.approx(angle, rel=1e-8)


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_linear_table_is_followed_from_knot_to_knot(kind: str, exported: Callable[..., Fmu]) -> None:
    """Between knots dw/dt = a + b w; a step that passed over a knot would be off by 1e-5 at this tolerance."""
    run = simulate(
        exported(BROKEN), stop_time=1.4, step=0.1, tolerance=1e-7 if kind == "co-simulation" else 1e-10, kind=kind
    )
    assert run["theta_dot"] == pytest.approx([run_up(t) for t in run.time], rel=1e-7)
    assert run["theta_dot"][-1] > 60


def run_up(t: float) -> float:
    """The speed after ``t``, torque linear between the knots and held beyond the last one."""
    w, inertia = 1.0, 0.02
    for i in range(4):
        slope = (TORQUE[i + 1] - TORQUE[i]) / (SPEED[i + 1] - SPEED[i])
        torque = TORQUE[i] + slope * (w - SPEED[i])
        needed = inertia / slope * float(np.log(TORQUE[i + 1] / torque))
        if needed > t:
            return w + torque / slope * float(np.expm1(slope * t / inertia))
        w, t = SPEED[i + 1], t - needed
    return w + TORQUE[-1] * t / inertia


def test_kinks_are_event_indicators(exported: Callable[..., Fmu]) -> None:
    """A linear table: those inside and the ends where the value is held; smooth(...) has none."""
    assert fmpy.read_model_description(exported(BROKEN).path).numberOfEventIndicators == 5
    theta = coordinate("theta", "rad", velocity=1.0)
    smooth = Mechanism(
        "smooth_fan",
        coordinates=[theta],
        tables=BROKEN.tables,
        energy=Energy(kinetic=theta.dot**2 / 100),
        forces={theta: Smooth(BROKEN.tables[0](theta.dot))},
    )
    assert lower(derive(smooth)).switches == 0


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_ball_leaves_a_track_where_its_curvature_jumps(kind: str, exported: Callable[..., Fmu]) -> None:
    """Monotone pieces, at t = 1 s: from -0.8 to -17.4 m/s2; the ball falls freely from y = -2 m with -3.2 m/s.

    The force of the contact has no root there, and the run ended with the word that it grows beyond all bounds.
    """
    y, t = coordinate("y", "m"), sp.Symbol("t", real=True)
    track = Table("track", columns=[[0, 1, 2, 3, 4], [0, -2, -10, -20, -30]], interpolation="pchip")
    ball = Mechanism(
        "track",
        coordinates=[y],
        tables=[track],
        bodies=[Body("ball", 1, (0, y))],
        gravity=sp.Rational(981, 100),
        contacts=[Contact("floor", gap=y - track(t))],
    )
    outputs = ["y", "floor_force", "floor_impacts", "floor_mode"]
    run = simulate(exported(ball), stop_time=1.5, step=0.25, outputs=outputs, kind=kind)
    on, off = run.time < 1, run.time >= 1
    curve = PchipInterpolator([0, 1, 2, 3, 4], [0, -2, -10, -20, -30])
    fall = run.time[off] - 1
    assert run["y"][on] == pytest.approx(curve(run.time[on]), abs=1e-5)
    assert run["y"][off] == pytest.approx(-2 - 3.2 * fall - 9.81 / 2 * fall**2, abs=1e-5)
    assert run["floor_force"][on] == pytest.approx(9.81 + curve(run.time[on], 2), abs=1e-3)
    assert run["floor_impacts"][-1] == 0
    assert run["floor_mode"][-1] == 1


@pytest.mark.parametrize("outside", ["hold", "extrapolate"])
@pytest.mark.parametrize("kind", ["linear", "cubic"])
def test_lines_of_a_grid_are_switches(kind: str, outside: str) -> None:
    """Between them the force is one polynomial, that of the table."""
    x, y = coordinate("x"), coordinate("y")
    table = Table("grid", columns=[X, Y, GRID], interpolation=kind, outside=outside)
    energy = Energy(kinetic=(x.dot**2 + y.dot**2) / 2)
    mechanism = Mechanism("patches", coordinates=[x, y], tables=[table], energy=energy, forces={x: table(x, y)})
    program = lower(derive(mechanism))
    assert program.switches == (4 + 3 if kind == "linear" else 0) + (4 if outside == "hold" else 0)
    functions = {f.name: f for f in program.functions}
    force = next(node for array, i, node in functions["mechanism_dynamics"].results if (array, i) == ("f", 0))
    margins = [node for *_, node in functions["mechanism_switches"].results] if program.switches else []
    for at in np.random.default_rng(5).uniform((-3.0, -1.0), (4.0, 4.0), (40, 2)):
        values = {"x": at[0], "y": at[1], "x_dot": 0.0, "y_dot": 0.0, "Q_x": 0.0, "Q_y": 0.0}
        values |= {f"switch {k}": float(np.sign(m)) for k, m in enumerate(program.graph.evaluate(margins, values))}
        expected = float(interpolant(mechanism.tables[0])((0, 0), *at))
        assert program.graph.evaluate([force], values) == pytest.approx([expected], rel=1e-12, abs=1e-12)


def test_a_linear_grid_is_followed_from_line_to_line(exported: Callable[..., Fmu]) -> None:
    """A spring that is four times as stiff on one side: half periods of pi/2 and pi s, while y passes lines, too."""
    x, y = coordinate("x", "m", start=1.0), coordinate("y", "m", velocity=1.0)
    table = Table("pull", columns=[[-9.0, 0.0, 9.0], [0.5, 2.5, 4.2], [[36.0] * 3, [0.0] * 3, [-9.0] * 3]])
    energy = Energy(kinetic=(x.dot**2 + y.dot**2) / 2)
    mechanism = Mechanism("uneven", coordinates=[x, y], tables=[table], energy=energy, forces={x: table(x, y)})
    run = simulate(exported(mechanism), stop_time=1.5 * np.pi, step=np.pi / 8, tolerance=1e-8)
    t = run.time
    sides = [np.cos(t), -np.sin(2 * (t - np.pi / 2)) / 2, np.sin(t - np.pi)]
    assert run["x"] == pytest.approx(np.select([t < np.pi / 2, t < np.pi], sides[:2], sides[2]), abs=1e-7)


FAN, BROKEN = fan(), fan(kind="linear")
SETTINGS = {"gauss4": {"solver_step": 1e-4}}


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_outside_the_data_table_argument_value_and_range_are_named(kind: str, exported: Callable[..., Fmu]) -> None:
    with Stepping(exported(fan("error")).path, kind) as host:
        host.start()
        with pytest.raises(FMICallException):
            host.step(2.0) if kind == "CoSimulation" else leave(host)
        assert "argument 1 of the table torque is 6" in host.sentences[-1]
        assert "outside its data from 0 to 60 (SI)" in host.sentences[-1]
        assert host.sentences[-1].count("extend the table") == 1


def leave(host: Stepping) -> None:
    host.set({"theta_dot": 61.0})
    host.rates()


def test_the_python_backend_has_the_same_tables(exported: Callable[..., Fmu], tmp_path: Path) -> None:
    path = export(LOOKUPS, tmp_path / "lookups.fmu", backend="python").path
    for point in ({"a": 0.31, "b": 1.9}, {"a": -2.5, "b": 3.3}, {"a": 3.0, "b": 0.0}):
        found = []
        for model in (path, exported(LOOKUPS).path):
            with Stepping(model) as host:
                found.append(host.start(point).get(NAMES))
        assert found[0] == pytest.approx(found[1], rel=1e-14, abs=1e-15)
