"""Observers: against filters written with covariances, batch least squares, and the noise that was put in."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from kalman_by_hand import bob, by_hand, exponential
from numpy.typing import NDArray

import lag2fmu
from lag2fmu.analysis.inverse import inverse
from lag2fmu.cli import main
from lag2fmu.errors import DerivationError, LoadError
from lag2fmu.mechanism import Body, Mechanism, Spring, coordinate, signal
from lag2fmu.reference import Trajectory
from lag2fmu.studies.estimates import Estimates
from lag2fmu.studies.observer import observe

pytestmark = pytest.mark.fmu
Floats = NDArray[np.float64]
H = 0.05


@cache
def pair() -> Mechanism:
    """Two masses with a spring between them and one to the wall; F pushes the first one."""
    a, b, F = coordinate("a", "m", start=0.3), coordinate("b", "m"), signal("F", "N")
    return Mechanism(
        "pair",
        coordinates=[a, b],
        inputs=[F],
        bodies=[Body("p", 2.0, (a, 0)), Body("q", 0.5, (b, 0))],
        springs=[Spring("s", 3.0, elongation=a), Spring("t", 1.0, elongation=b - a)],
        forces={a: F - 0.1 * a.dot},
    )


A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-2, 0.5, -0.05, 0], [2, -2, 0, 0]], dtype=float)
B = np.array([0, 0, 0.5, 0])


def discrete(density: float) -> tuple[Floats, Floats]:
    """The map of a sample, and a root of the covariance that it adds; from A and B alone."""
    steps = int(np.ceil(H * np.abs(np.linalg.eigvals(A)).max() / 0.1))
    h = H / steps
    one, root, whole = exponential(A * h), np.zeros((4, 0)), np.eye(4)
    nodes = (0.5 - np.sqrt(3) / 6, 0.5 + np.sqrt(3) / 6)
    for _ in range(steps):
        fresh = [np.sqrt(h / 2) * density * exponential(A * (1 - node) * h) @ B for node in nodes]
        root, whole = np.column_stack([one @ root, *fresh]), one @ whole
    return whole, root


def data(m: int = 40) -> dict[str, Floats]:
    generator = np.random.default_rng(5)
    t = H * np.arange(m)
    found = {"time": t, "a": np.cos(t) + 0.1 * generator.standard_normal(m), "b": generator.standard_normal(m)}
    found["a"][[3, 7, 8]] = np.nan
    found["b"][8] = np.nan
    return found


NOISE, DENSITY = {"a": 0.1, "b": 0.3}, 0.4
START = {"a": 0.5, "b": 0.6, "a_dot": 0.7, "b_dot": 0.8}


@cache
def found(method: str, *, smooth: bool = False) -> Estimates:
    return observe(pair(), data(), measure=NOISE, process={"F": DENSITY}, start=START, method=method, smooth=smooth)


@pytest.mark.parametrize("method", ["ekf", "ukf", "ukf-simplex"])
def test_a_linear_model_against_covariances(method: str) -> None:
    """Kalman's equations as they stand in textbooks, with P and its inverse; both filters are exact here."""
    columns, estimates = data(), found(method)
    Phi, root = discrete(DENSITY)
    x, P = np.array([0.3, 0, 0, 0]), np.diag(np.square([*START.values()]))
    for i in range(len(columns["time"])):
        if i:
            x, P = Phi @ x, Phi @ P @ Phi.T + root @ root.T
        for j, name in enumerate(NOISE):
            if np.isfinite(columns[name][i]):
                K = P[:, j] / (P[j, j] + NOISE[name] ** 2)
                x, P = x + K * (columns[name][i] - x[j]), P - np.outer(K, P[j])
        assert estimates.values[i] == pytest.approx(x, abs=1e-9)
        assert estimates.deviations[i] == pytest.approx(np.sqrt(np.diag(P)), abs=1e-9)


@pytest.mark.parametrize("method", ["ekf", "ukf", "ukf-simplex"])
def test_the_smoother_against_least_squares_over_all_samples(method: str) -> None:
    """The start and the noise of each sample are the unknowns of one least squares problem."""
    columns, estimates = data(), found(method, smooth=True)
    Phi, root = discrete(DENSITY)
    m, k = len(columns["time"]), root.shape[1]
    size = 4 + k * (m - 1)
    by_unknowns, states = np.eye(4, size), []
    rows, right = [np.eye(size)], [np.zeros(size)]  # all unknowns have the size 1
    by_unknowns[:, :4] = np.diag([*START.values()])
    mean = np.array([0.3, 0, 0, 0])
    for i in range(m):
        if i:
            by_unknowns, mean = Phi @ by_unknowns, Phi @ mean
            by_unknowns[:, 4 + k * (i - 1) : 4 + k * i] = root
        states.append((mean, by_unknowns.copy()))
        for j, name in enumerate(NOISE):
            if np.isfinite(columns[name][i]):
                rows.append(by_unknowns[None, j] / NOISE[name])
                right.append(np.array([(columns[name][i] - mean[j]) / NOISE[name]]))
    orthogonal, upper = np.linalg.qr(np.concatenate(rows))
    unknowns, inverse = np.linalg.solve(upper, orthogonal.T @ np.concatenate(right)), np.linalg.inv(upper)
    for i, (mean, by) in enumerate(states):
        assert estimates.values[i] == pytest.approx(mean + by @ unknowns, abs=1e-10)
        assert estimates.deviations[i] == pytest.approx(np.linalg.norm(by @ inverse, axis=1), abs=1e-10)


def noisy(model: str, measure: dict[str, float], *, seed: int, stop: float = 1.0) -> tuple[Trajectory, dict]:
    """A run of ``model``, and what was measured of it."""
    run, generator = lag2fmu.simulate(model, stop_time=stop, step=0.02), np.random.default_rng(seed)
    columns = {x: run[x] + size * generator.standard_normal(len(run.time)) for x, size in measure.items()}
    return run, {"time": run.time, **columns}


@pytest.mark.parametrize("method", ["ekf", "ukf"])
def test_a_loop_is_closed_by_every_estimate(method: str) -> None:
    """The crank's angle alone is measured; rods and rates follow, and meet the loop to rounding."""
    measure = {"a": 0.01}
    run, columns = noisy("four_bar_linkage", measure, seed=1, stop=0.4)
    estimates = observe("four_bar_linkage", columns, measure=measure, process={"Q_a": 0.01}, method=method)
    f = lag2fmu.function("four_bar_linkage", outputs=["residual_loop_x", "residual_loop_y"])
    assert np.abs(f.outputs(estimates.values)).max() < 1e-12
    for name in ("b", "c", "b_dot"):
        error = (estimates[name] - run[name]) / estimates.deviation(name)
        assert np.abs(error).max() < 4.5
    assert 0.2 < estimates.consistency < 2.5


# ------------------------------------------------------------------------------------------------- a nonlinear model


@pytest.mark.parametrize("method", ["ekf", "ukf", "ukf-simplex"])
def test_a_nonlinear_model_against_covariances(method: str) -> None:
    """A pendulum whose bob is seen from below; the same discrete equations, written with NumPy alone."""
    m = bob()
    t = H * np.arange(40)
    measured = np.sin(np.cos(3 * t)) + 0.1 * np.random.default_rng(8).standard_normal(40)
    start = {"theta": 0.2, "theta_dot": 0.5}
    found = observe(
        m, {"time": t, "x": measured}, measure={"x": 0.1}, process={"Q_theta": 0.3}, start=start, method=method
    )
    after, _ = by_hand(method, measured, H)
    assert np.concatenate([found.values, found.deviations], axis=1) == pytest.approx(after, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "measure"), [("heavy_top_quaternion", {"e1": 0.01, "e2": 0.01}), ("whipple_bicycle", {"phi": 0.01})]
)
def test_quaternions_and_rolling_stay_on_their_manifold(model: str, measure: dict[str, float]) -> None:
    _, columns = noisy(model, measure, seed=7, stop=0.2)
    small = {name: 0.01 for q in lag2fmu.load(model).coordinates for name in (q.name, f"{q.name}_dot")}
    estimates = observe(model, columns, measure=measure, start=small)
    m = lag2fmu.load(model)
    residuals = [f"residual_{c.name}" for c in m.constraints]
    left = lag2fmu.function(model, outputs=residuals).outputs(estimates.values)
    assert np.abs(left).max() < 1e-12 * (1 + np.abs(estimates.values).max())


def test_the_bar_of_two_deviations_holds_what_is_true() -> None:
    """Normalised errors and innovations of a pendulum whose start is noisy, in 12 runs, have the mean square 1."""
    generator, errors, squared, degrees = np.random.default_rng(2), [], 0.0, 0.0
    t = 0.05 * np.arange(21)
    for _ in range(12):
        begin = {"theta": 0.5 + 0.05 * generator.standard_normal(), "theta_dot": 0.05 * generator.standard_normal()}
        run = lag2fmu.simulate("pendulum", values=begin, stop_time=1, step=0.05)
        columns = {"time": t, "theta": run["theta"] + 0.02 * generator.standard_normal(21)}
        start = {"theta": 0.05, "theta_dot": 0.05}
        estimates = observe(
            "pendulum", columns, measure={"theta": 0.02}, start=start, values={"theta": 0.5, "theta_dot": 0.0}
        )
        errors += [(estimates[x] - run[x]) / estimates.deviation(x) for x in ("theta", "theta_dot")]
        squared, degrees = squared + estimates.squared.sum(), degrees + estimates.degrees.sum()
    assert 0.83 < squared / degrees < 1.17  # 252 degrees: 1 +- 1.96 sqrt(2/252)
    ends = np.square([error[-1] for error in errors])
    assert 0.52 < ends.mean() < 1.64  # 24 values, of which two belong to a run: 95 % of chi-squared of 24


def test_a_parameter_is_estimated() -> None:
    """The length of a pendulum from its angle, beginning 10 % beside the truth."""
    measure = {"theta": 0.005}
    _, columns = noisy("pendulum", measure, seed=3, stop=4.0)
    true = next(p.value for p in lag2fmu.load("pendulum").parameters if p.name == "l")
    estimates = observe("pendulum", columns, measure=measure, estimate=["l"], values={"l": 1.1 * true}, smooth=True)
    assert estimates.names == ("theta", "theta_dot", "l")
    assert abs(estimates["l"][-1] - true) < 4 * estimates.deviation("l")[-1]
    assert estimates.deviation("l")[-1] < 0.01 * true


def test_delayed_samples_belong_to_earlier_times() -> None:
    _, columns = noisy("pendulum", {"theta": 1e-6}, seed=4)
    late = {"time": columns["time"][1:], "theta": columns["theta"][:-1]}
    on_time = observe("pendulum", {x: column[1:] for x, column in columns.items()}, measure={"theta": 0.01})
    delayed = observe("pendulum", late, measure={"theta": 0.01}, delays={"theta": 0.02})
    assert delayed.warnings == ("1 samples of theta belong to times before the first one; left out",)
    assert delayed.values[:-1] == pytest.approx(on_time.values[:-1], abs=1e-9)
    assert np.isnan(delayed.samples[-1, 0])


def test_accelerations_and_inputs(tmp_path: Path) -> None:
    """An accelerometer and a force that is known; the estimates go to a file and a figure."""
    t = 0.05 * np.arange(41)
    push = {"time": t, "F": np.sin(3 * t)}
    run = lag2fmu.simulate(pair(), inputs=push, stop_time=2, step=0.05)
    columns = {**push, "a_ddot": slope(run, push), "a": run["a"]}
    estimates = observe(pair(), columns, measure={"a_ddot": 0.01, "a": 0.05}, start=START)
    assert estimates["b"] == pytest.approx(run["b"], abs=0.02)
    estimates.save(tmp_path / "x.csv")
    assert (tmp_path / "x.csv").read_text().startswith("time,a [m],b [m],")
    assert len(estimates.plot().axes) == 4


def slope(run: Trajectory, push: dict[str, Floats]) -> Floats:
    """a_ddot of the pair, from its equation of motion."""
    return np.stack([run[x] for x in ("a", "b", "a_dot", "b_dot")], axis=1) @ A[2] + 0.5 * push["F"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"measure": {}}, "nothing is measured"),
        ({"step": "a"}, "step: 'a' s; give a positive time"),
        ({"method": "mhe", "horizon": 1.5}, "horizon: 1.5; give the number of samples, a whole one of at least 1"),
        ({"estimate": "G"}, r"estimate: 'G' is one text; give a list of parameters, such as \['G'\]"),
        ({"start": {"a": "b"}}, "start 'a': 'b' is no standard deviation"),
        ({"process": {"a": "b"}}, "process 'a': 'b' is no density of noise"),
        ({"delays": {"a": "b"}}, "delay of 'a': 'b' s"),
        ({"start": ["a"]}, r"start: \['a'\] is no mapping; give {name: value}"),
        ({"process": ["a"]}, r"process: \['a'\] is no mapping"),
        ({"delays": ["a"]}, r"delay: \['a'\] is no mapping"),
        ({"estimate": 5}, "estimate: 5 is no list; give a list of parameters"),
        ({"measure": ["a"]}, "nothing is measured; give measure = {variable: standard deviation}"),
        ({"measure": {"a": "x"}}, "measure 'a': 'x' is no standard deviation"),
        ({"data": {"time": [0, np.nan], "a": [1, 1]}}, "the time is nan in row 2; leave that row out"),
        ({"data": {"time": [], "a": []}}, "there is no row"),
        ({"measure": {"a": 0.0}}, "measure 'a': 0.0 is no standard deviation; give a positive one"),
        ({"measure": {"c": 0.1}}, "there is no column 'c' to measure; known are a, b"),
        ({"process": {"a": -1.0}}, "process 'a': -1.0 is no density of noise"),
        ({"process": {"G": 1.0}}, "process 'G' is no input, state or estimated parameter"),
        ({"start": {"G": 1.0}}, "start 'G' is not estimated"),
        ({"estimate": ["k"]}, "'k' is no parameter that can be estimated"),
        ({"method": "kf"}, "there is no observer 'kf'; known are ekf, ukf, ukf-simplex, mhe"),
        ({"delays": {"b": -1.0}}, r"delay of 'b': -1.0 s"),
        ({"data": {"time": [0, 2, 1], "a": [1, 1, 1]}}, "the time goes from 2 s to 1 s in row 3; sort it"),
        ({"data": {"time": [0, 1], "a": [np.nan, np.nan]}}, "there is no measured value in the data"),
        ({"data": {"time": [0, 1], "a": [1, np.inf]}}, "'a' is infinite somewhere"),
        ({"data": {"time": [0, 1], "a": [1, 1], "F": [1, np.nan]}}, "the input 'F' has no value at 1 s"),
    ],
)
def test_what_cannot_be_observed(changes: dict, said: str) -> None:
    given = {"data": data(10), "measure": {"a": 0.1}, **changes}
    with pytest.raises(LoadError, match=said):
        observe(pair(), given.pop("data"), **given)


def test_what_is_not_shown_is_said() -> None:
    """The angle of a pole does not tell where its cart is."""
    _, columns = noisy("cart_pole", {"theta": 0.01}, seed=9, stop=0.2)
    (warning,) = observe("cart_pole", columns, measure={"theta": 0.01}).warnings
    assert warning.startswith("at the start what is measured does not show x; estimates of it rest on")
    assert found("ekf").warnings == ()


def test_a_model_without_states_of_its_own_is_refused() -> None:
    with pytest.raises(LoadError, match="no state moves by itself, so there is nothing to estimate; name parameters"):
        observe(inverse("pendulum", "all"), {"time": [0, 1], "F_theta": [0, 0]}, measure={"F_theta": 0.1})


def test_a_model_with_events_is_refused() -> None:
    with pytest.raises(DerivationError, match="their modes have no covariance, so no observer; leave out what may be"):
        observe("coulomb_oscillator", {"time": [0, 1], "x": [0, 0]}, measure={"x": 0.1})


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (["--measure", "x=nan"], "setting 'x=nan': give a finite number"),
        (["--delay", "x=inf"], "setting 'x=inf': give a finite number"),
        (
            ["--measure", "x=1", "--delay", "x=-50 ms"],
            "delay of 'x': -0.05 s; give a measured",
        ),
    ],
)
def test_the_verb_reads_sizes_and_times_in_units(tmp_path: Path, option: list[str], said: str) -> None:
    (tmp_path / "track.csv").write_text("time,x,theta\n0,0,0\n1,0,0\n")
    done = CliRunner().invoke(
        main, ["observe", "cart_pole", str(tmp_path / "track.csv"), "--measure", "theta=1", *option]
    )
    assert (done.exit_code, said in done.output) == (2, True)


@pytest.mark.slow
def test_the_verb_prints_and_writes_the_estimates(tmp_path: Path) -> None:
    _, columns = noisy("cart_pole", {"x": 0.005, "theta": 0.02}, seed=6)
    table = zip(columns["time"], 1e3 * columns["x"], columns["theta"], strict=True)
    lines = ["time,x [mm],theta", *(",".join(f"{value:.6f}" for value in row) for row in table)]
    (tmp_path / "track.csv").write_text("\n".join(lines))
    out, plot = tmp_path / "estimates.csv", tmp_path / "estimates.png"
    asked = ["observe", "cart_pole", str(tmp_path / "track.csv"), "--measure", "x=5 mm,theta=0.02"]
    done = CliRunner().invoke(main, [*asked, "--process", "F=0.1", "-o", str(out), "--plot", str(plot)])
    assert done.exit_code == 0, done.output
    assert "mean innovation squared by degree: " in done.output
    assert out.read_text().startswith("time,x [m],theta [rad],x_dot [m/s],theta_dot [rad/s],x_std [m],")
    assert plot.stat().st_size > 10_000
    again = CliRunner().invoke(main, [*asked, "-o", str(out)])
    assert again.exit_code == 2
    assert "overwrite it with --force" in again.stderr


@pytest.mark.slow
def test_a_measured_state_needs_no_deviation(tmp_path: Path) -> None:
    """A hundredth of the nominal value is told; a cell with nan is a gap."""
    (tmp_path / "track.csv").write_text("time,x\n0,0\n0.1,nan\n0.2,0.01\n")
    asked = ["observe", "cart_pole", str(tmp_path / "track.csv"), "--measure", "x"]
    done = CliRunner().invoke(main, asked)
    assert done.exit_code == 0, done.output
    assert "measure 'x': standard deviation 0.01 m, a hundredth of its nominal value" in done.stderr
    assert CliRunner().invoke(main, [*asked[:-1], "x=0.01"]).stdout == done.stdout
    twice = CliRunner().invoke(main, [*asked, "--measure", "x=1"])
    assert "measure 'x' is given twice" in twice.stderr
