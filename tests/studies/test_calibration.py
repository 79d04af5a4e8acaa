"""Calibration on synthetic data: confidence, gaps, several experiments, what is not determined."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import LoadError
from lag2fmu.studies import calibration, measured_runs
from lag2fmu.studies.library import Study, compiled

pytestmark = pytest.mark.fmu

TIMES = np.linspace(0, 4, 41)
TRUE = {"l": 1.1, "theta": 0.8}
NOISE = {"theta": 0.01, "theta_dot": 0.05}


def measured(seed: int, values: dict[str, float] | None = None) -> dict[str, Any]:
    """Noisy angles and velocities of the pendulum."""
    library = compiled("pendulum")
    given = {library.settable(name): value for name, value in (values or TRUE).items()}
    found, _, _ = Study(library).run(given, TIMES, library.readable(list(NOISE)), tolerance=1e-11)
    noise = np.random.default_rng(seed).standard_normal(found.shape) * list(NOISE.values())
    return {"time": TIMES, **dict(zip(NOISE, (found + noise).T, strict=True))}


@pytest.mark.slow
def test_estimates_lie_within_their_confidence() -> None:
    """As often as 95 % say, within what chance allows in 40 repetitions; the bench takes 200."""
    from scipy.stats import binom

    repetitions = 40
    hits = dict.fromkeys(TRUE, 0)
    for seed in range(repetitions):
        found = lag2fmu.calibrate("pendulum", measured(seed), free=["l", "theta"])
        for name, value in TRUE.items():
            low, high = found.confidence(name)
            hits[name] += low <= value <= high
    assert min(hits.values()) >= binom.ppf(1e-4, repetitions, 0.95)
    assert found.noise["theta"] == pytest.approx(0.01, rel=0.4)
    assert found.noise["theta_dot"] == pytest.approx(0.05, rel=0.4)
    assert found.warnings == ()


def test_standard_errors_are_those_of_the_linearized_problem() -> None:
    """With known noise the covariance is (J' J)^-1, J by differences of runs."""
    found = lag2fmu.calibrate("pendulum", measured(3), free=["l", "theta"], noise=NOISE)
    columns = []
    for name in TRUE:
        for h in (1e-4,):
            at = {n: found[n] for n in TRUE}
            ahead, behind = (
                measured_without_noise(at | {name: at[name] + h}),
                measured_without_noise(at | {name: at[name] - h}),
            )
            columns.append(((ahead - behind) / (2 * h) / list(NOISE.values())).ravel())
    jacobian = np.stack(columns, axis=1)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    np.testing.assert_allclose(found.standard_errors, np.sqrt(np.diag(covariance)), rtol=1e-4)
    expected = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert found.correlations[0, 1] == pytest.approx(expected, abs=1e-4)


def measured_without_noise(values: dict[str, float]) -> Any:
    library = compiled("pendulum")
    given = {library.settable(name): value for name, value in values.items()}
    return Study(library).run(given, TIMES, library.readable(list(NOISE)), tolerance=1e-12)[0]


def test_experiments_have_own_starts_and_gaps() -> None:
    first, second = measured(1), measured(2, {"l": 1.1, "theta": 0.3})
    first["theta"][5:9] = np.nan
    second["theta_dot"][:] = np.nan
    runs: list[int] = []
    found = lag2fmu.calibrate("pendulum", [first, second], free=["l", "theta"], progress=runs.append)
    assert runs == [*range(1, len(runs) + 1)]
    assert found.names == ("l", "theta[1]", "theta[2]")
    assert (abs(found.estimates - [1.1, 0.8, 0.3]) < 4 * found.standard_errors).all()
    assert found.degrees_of_freedom == 3 * len(TIMES) - 4 - 3
    assert found.fits[0].fitted.shape == (len(TIMES), 2)


def test_what_is_not_determined_is_named_and_stays() -> None:
    """Only l/g is seen: l and g share what it asks for, each in parts of its size, and m does not move."""
    alone, found = (lag2fmu.calibrate("pendulum", measured(1), free=free) for free in (["l"], ["l", "g", "m"]))
    assert found["l"] * 9.81 / found["g"] == pytest.approx(alone["l"], rel=1e-5)
    assert [found["m"], found["l"] * found["g"] / 9.81] == pytest.approx([1.0, 1.0], rel=0.05)
    said = " ".join(found.warnings)
    assert "not identifiable: m changes nothing" in said
    assert "+1 l" in said
    assert " g), in parts of their sizes, changes nothing" in said
    assert np.isinf(found.standard_errors).all()


def test_many_values_are_found_by_gradients(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two experiments with gaps, noise unknown; adjoints end where the derivatives of all values do."""
    first, second = measured(1), measured(2, {"l": 1.1, "theta": 0.3})
    first["theta"][5:9] = np.nan
    free = ["l", "theta", "theta_dot"]
    expected = lag2fmu.calibrate("pendulum", [first, second], free=free)
    monkeypatch.setattr(measured_runs, "MANY", 2)
    monkeypatch.setattr(calibration, "_by_slopes", None)
    found = lag2fmu.calibrate("pendulum", [first, second], free=free)
    assert found.names == expected.names
    assert (abs(found.estimates - expected.estimates) < 1e-3 * expected.standard_errors).all()
    assert found.standard_errors == pytest.approx(expected.standard_errors, rel=1e-3)
    assert found.chi_squared == pytest.approx(expected.chi_squared, rel=1e-6)


def test_a_bound_that_binds_is_met_with_many_values_too(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = {"free": ["l", "theta", "theta_dot"], "bounds": {"l": (0.5, 1.05)}}
    expected = lag2fmu.calibrate("pendulum", measured(1), **asked)
    monkeypatch.setattr(measured_runs, "MANY", 2)
    found = lag2fmu.calibrate("pendulum", measured(1), **asked)
    assert found["l"] == pytest.approx(1.05, abs=1e-6)
    assert found.estimates == pytest.approx(expected.estimates, rel=1e-5)


def test_bad_data_get_sentences(tmp_path: Path) -> None:
    data = measured(1)
    with pytest.raises(LoadError, match=r"experiment 1: 'pendulum' has no variable 'phi'.*remove the column"):
        lag2fmu.calibrate("pendulum", {"time": TIMES, "phi": data["theta"]}, free=["l"])
    with pytest.raises(LoadError, match="without a column 'time'"):
        lag2fmu.calibrate("pendulum", {"theta": data["theta"]}, free=["l"])
    with pytest.raises(LoadError, match="the noise of 'x' is given, but it was not measured"):
        lag2fmu.calibrate("pendulum", data, free=["l"], noise={"x": 1.0})
    with pytest.raises(LoadError, match="out of its bounds, 2 to 3"):
        lag2fmu.calibrate("pendulum", data, free=["l"], bounds={"l": (2.0, 3.0)})
    with pytest.raises(LoadError, match="the bounds of 'l', nan to 3, are no numbers"):
        lag2fmu.calibrate("pendulum", data, free=["l"], bounds={"l": (np.nan, 3.0)})
    with pytest.raises(LoadError, match=r"over: 'l' is one text; give a list of names, such as \['l'\]"):
        lag2fmu.calibrate("pendulum", data, free="l")
    with pytest.raises(LoadError, match=r"'theta' is infinite at 0\.5 s; a missing value is NaN"):
        lag2fmu.calibrate("pendulum", {**data, "theta": np.where(TIMES == 0.5, np.inf, 0.0)}, free=["l"])
    with pytest.raises(LoadError, match=r"no value at 0\.5 s; inputs may have no gaps"):
        lag2fmu.calibrate("pendulum", {**data, "Q_theta": np.where(TIMES == 0.5, np.nan, 0.0)}, free=["l"])


def test_the_command_line_writes_mechanism_and_picture(tmp_path: Path) -> None:
    data = measured(7)
    rows = [f"{t!r},{float(np.degrees(x))!r}," for t, x in zip(TIMES.tolist(), data["theta"].tolist(), strict=True)]
    file, out, plot = (tmp_path / name for name in ("data.csv", "found.toml", "fit.png"))
    file.write_text("\n".join(["time,theta [deg],theta_dot", *rows]))
    arguments = ["calibrate", "pendulum", str(file), "--free", "l,theta", "-o", str(out), "--plot", str(plot)]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    assert "standard error" in done.output
    found = {p.name: p.value for p in lag2fmu.load(out).parameters}
    assert found["l"] == pytest.approx(1.1, abs=0.01)
    assert plot.stat().st_size > 10_000
    kept = CliRunner().invoke(main, ["calibrate", str(out), str(file), "--free", "l", "-o", str(out)])
    assert (kept.exit_code, "found.toml' exists; overwrite it with --force" in kept.output) == (2, True)
    failed = CliRunner().invoke(main, ["calibrate", "pendulum", str(tmp_path / "none.csv"), "--free", "l"])
    assert failed.exit_code == 2
    assert "none.csv" in failed.output
