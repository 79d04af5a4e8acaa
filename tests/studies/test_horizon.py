"""Moving-horizon estimates: against batch least squares and Kalman's filter on linear models, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from scipy.linalg import expm

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import LoadError
from lag2fmu.studies import measured_runs
from lag2fmu.studies.observer import observe

pytestmark = pytest.mark.fmu
Floats = NDArray[np.float64]
MASS, DAMPING, STIFFNESS = (
    {p.name: p.value for p in lag2fmu.load("spring_mass_damper").parameters}[name] for name in ("m", "c", "k")
)
A = np.array([[0, 1], [-STIFFNESS / MASS, -DAMPING / MASS]])
H, SIZE, START = 0.05, 0.02, {"x": 0.1, "x_dot": 0.4}


def seen(m: int = 25) -> dict[str, Floats]:
    t = H * np.arange(m)
    x = 0.1 * np.cos(9 * t) + SIZE * np.random.default_rng(4).standard_normal(m)
    x[[3, 9, 10]] = np.nan
    return {"time": t, "x": x}


def least_squares(data: dict[str, Floats], last: int, mean: Floats, root: Floats) -> tuple[Floats, Floats]:
    """The state and its deviations at the ``last`` sample, by all samples up to it and a first belief."""
    rows, right = [np.linalg.inv(root)], [np.linalg.solve(root, mean)]
    for i in np.flatnonzero(np.isfinite(data["x"][: last + 1])):
        rows.append(expm(A * data["time"][i])[:1] / SIZE)
        right.append(data["x"][i : i + 1] / SIZE)
    J, at = np.concatenate(rows), expm(A * data["time"][last])
    start = np.linalg.lstsq(J, np.concatenate(right), rcond=None)[0]
    return at @ start, np.sqrt(np.diag(at @ np.linalg.inv(J.T @ J) @ at.T))


def test_a_linear_model_against_batch_least_squares() -> None:
    """All samples are in the window: the unknowns are two, and the flow is a matrix exponential."""
    data, begin = seen(), lag2fmu.function("spring_mass_damper").start["x"]
    found = observe("spring_mass_damper", data, measure={"x": SIZE}, start=START, method="mhe", horizon=len(data["x"]))
    for last in (0, 3, 10, 24):
        x, deviations = least_squares(data, last, begin, np.diag([*START.values()]))
        assert found.values[last] == pytest.approx(x, abs=1e-8)
        assert found.deviations[last] == pytest.approx(deviations, abs=1e-8)


def test_a_short_window_on_a_linear_model_is_kalmans_filter() -> None:
    """Without noise along the way the arrival cost holds all that came before."""
    asked = {"measure": {"x": SIZE}, "start": START}
    expected = observe("spring_mass_damper", seen(), **asked, step=0.0005)
    found = observe("spring_mass_damper", seen(), **asked, step=0.0005, method="mhe", horizon=4)
    assert found.values == pytest.approx(expected.values, abs=1e-8)
    assert found.deviations == pytest.approx(expected.deviations, abs=1e-8)


def test_inputs_and_parameters_in_a_window() -> None:
    """The length of a pole is found with the motion; the force is a column of the data."""
    t = np.linspace(0, 2, 41)
    force = np.sin(3 * t)
    run = lag2fmu.simulate("cart_pole", stop_time=2, step=0.05, values={"l": 0.55}, inputs={"time": t, "F": force})
    noise = np.random.default_rng(2)
    measure = {"x": 0.002, "theta": 0.004}
    data = {"time": t, "F": force, **{n: run[n] + s * noise.standard_normal(41) for n, s in measure.items()}}
    found = observe("cart_pole", data, measure=measure, estimate=["l"], start={"l": 0.1}, method="mhe", horizon=41)
    assert found["l"][-1] == pytest.approx(0.55, abs=4 * found.deviation("l")[-1])
    assert found.deviation("l")[-1] < 0.02
    assert abs(found["theta_dot"] - run["theta_dot"])[-1] < 4 * found.deviation("theta_dot")[-1]


def test_many_unknowns_go_back_by_adjoints(monkeypatch: pytest.MonkeyPatch) -> None:
    """The derivatives of few samples by many unknowns are rows of ways back; the estimates are the same."""
    asked = {"measure": {"x": SIZE}, "start": START, "method": "mhe", "horizon": 6}
    asked["estimate"] = ["k", "c", "m"]
    expected = observe("spring_mass_damper", seen(12), **asked)
    monkeypatch.setattr(measured_runs, "MANY", 4)
    monkeypatch.setattr(measured_runs, "_PASS", 0)
    found = observe("spring_mass_damper", seen(12), **asked)
    assert found.values == pytest.approx(expected.values, rel=1e-7, abs=1e-9)
    assert found.deviations == pytest.approx(expected.deviations, rel=1e-7, abs=1e-9)


@pytest.mark.slow
def test_a_loop_is_closed() -> None:
    run = lag2fmu.simulate("four_bar_linkage", stop_time=0.4, step=0.02)
    noise = np.random.default_rng(1)
    data = {"time": run.time, "a": run["a"] + 0.01 * noise.standard_normal(len(run.time))}
    found = observe("four_bar_linkage", data, measure={"a": 0.01}, process={"Q_a": 0.01}, method="mhe", horizon=5)
    f = lag2fmu.function("four_bar_linkage", outputs=["residual_loop_x", "residual_loop_y"])
    assert np.abs(f.outputs(found.values)).max() < 1e-12
    for name in ("a", "b", "b_dot"):
        error = (found[name] - run[name]) / found.deviation(name)
        assert np.abs(error[5:]).max() < 4


@pytest.mark.parametrize(
    ("model", "changes", "said"),
    [
        ("spring_mass_damper", {"horizon": 0}, "horizon: 0; give the number of samples"),
        ("spring_mass_damper", {"smooth": True}, "leave out smooth, or take ekf"),
        ("heavy_top_quaternion", {}, "depend on each other"),
    ],
)
def test_what_cannot_be(model: str, changes: dict, said: str) -> None:
    name = "x" if model == "spring_mass_damper" else "e1"
    data = {"time": [0.0, 0.1], name: [0.1, 0.1]}
    with pytest.raises(LoadError, match=said):
        observe(model, data, measure={name: 0.01}, method="mhe", **changes)


def test_the_command_line(tmp_path: Path) -> None:
    data = seen()
    path = tmp_path / "seen.csv"
    rows = [
        f"{t!r},{'' if np.isnan(x) else repr(float(x))}" for t, x in zip(data["time"].tolist(), data["x"], strict=True)
    ]
    path.write_text("\n".join(["time,x", *rows]), "utf-8")
    asked = ["observe", "spring_mass_damper", str(path), "--measure", "x=0.02", "--horizon", "5"]
    done = CliRunner().invoke(main, [*asked, "--method", "mhe"])
    assert done.exit_code == 0, done.stderr
    assert "x_dot" in done.stdout
    refused = CliRunner().invoke(main, asked)
    assert refused.exit_code == 2
    assert "--horizon 5: ekf looks at one sample after the other" in refused.stderr
