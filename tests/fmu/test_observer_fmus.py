"""FMUs that estimate: against filters written with covariances, against ``observe``, and in the hands of importers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model
from kalman_by_hand import bob, by_hand, exponential
from numpy.typing import NDArray
from stepping import Stepping, bits
from stepping3 import Stepping3

import lag2fmu
from lag2fmu.analysis.observing import Observing
from lag2fmu.checking.check import check_fmu
from lag2fmu.cli import main
from lag2fmu.errors import DerivationError, ExportError, LoadError
from lag2fmu.fmu import Fmu
from lag2fmu.studies.estimates import Estimates

pytestmark = pytest.mark.fmu
Floats = NDArray[np.float64]
H, STEP = 0.05, 0.0125


@pytest.fixture(scope="module")
def observer(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Fmu]:
    """``observer(model, asked, fmi)``: its FMU, built once."""

    @cache
    def build(
        model: str,
        method: str,
        measure: tuple,
        process: tuple = (),
        estimate: tuple = (),
        fmi: str = "2.0",
        delays: tuple = (),
    ):
        asked = Observing(method, dict(measure), dict(process), estimate, delays=dict(delays))
        mechanism = bob() if model == "bob" else model
        folder = tmp_path_factory.mktemp("observers")
        return lag2fmu.export(mechanism, folder / "it.fmu", fmi=fmi, observer=asked)

    return build


PENDULUM = ("bob", "ekf", (("x", 0.1),), (("Q_theta", 0.3),))


def hosted(fmu: Fmu) -> Stepping | Stepping3:
    return Stepping3(fmu.path) if fmu.description.fmi == "3.0" else Stepping(fmu.path)


def advance(host: Stepping | Stepping3, time: float, step: float) -> None:
    host.unit.doStep(time, step)


def followed(host: Stepping | Stepping3, data: Mapping[str, Floats], outputs: list[str], parts: int = 1) -> Floats:
    """The ``outputs`` after each of the steps, as many ``parts`` between samples; NaN is no sample."""
    rows = []
    measured = [name for name in data if f"{name}_measured" in host.references]
    driving = [name for name in data if name in host.references and name not in measured and name != "time"]
    for i, time in enumerate(data["time"][:-1].tolist()):
        host.set({name: data[name][i] for name in driving})
        step = (float(data["time"][i + 1]) - time) / parts
        for part in range(parts):
            there = {name: part == 0 and bool(np.isfinite(data[name][i])) for name in measured}
            host.set({f"{name}_measured": data[name][i] if counts else 0.0 for name, counts in there.items()})
            host.set({f"{name}_valid": float(counts) for name, counts in there.items()})
            advance(host, time + part * step, step)
            rows.append(host.get(outputs))
    return np.array(rows)


def seen(m: int = 40) -> dict[str, Floats]:
    """What is measured of the place of the bob; some samples are missing."""
    t = H * np.arange(m)
    x = np.sin(np.cos(3 * t)) + 0.1 * np.random.default_rng(8).standard_normal(m)
    x[[4, 9, 10]] = np.nan
    return {"time": t, "x": x}


KNOWN = {"theta_start_std": 0.2, "theta_dot_start_std": 0.5, "solver_step": STEP}
STATES = ["theta", "theta_dot", "theta_std", "theta_dot_std"]


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
@pytest.mark.parametrize("method", ["ekf", "ukf", "ukf-simplex"])
def test_a_pendulum_against_covariances(method: str, fmi: str, observer) -> None:
    """The same discrete equations, written with NumPy alone."""
    _, _, measure, process = PENDULUM
    with hosted(observer("bob", method, measure, process, fmi=fmi)) as host:
        host.start(KNOWN)
        assert host.get(STATES) == pytest.approx([1.0, 0.0, 0.2, 0.5], abs=1e-14)
        rows = followed(host, seen(), STATES)
    assert rows == pytest.approx(by_hand(method, seen()["x"], H, round(H / STEP))[1][:-1], abs=1e-9)


def measured(model: str, measure: Mapping[str, float], stop: float) -> dict[str, Floats]:
    """What was measured of a run; every second time is a gap, at which an observer tells what it expects."""
    run = lag2fmu.simulate(model, stop_time=stop, step=0.02, outputs=[*measure])
    generator = np.random.default_rng(1)
    data = {x: run[x] + size * generator.standard_normal(len(run)) for x, size in measure.items()}
    return {"time": run.time, **data}


def between(data: Mapping[str, Floats]) -> dict[str, Floats]:
    """``data`` with gaps in the middle of all intervals."""
    t = data["time"]
    found = {"time": np.sort(np.concatenate([t, (t[1:] + t[:-1]) / 2]))}
    for name, column in data.items():
        if name != "time":
            found[name] = np.full(len(found["time"]), np.nan)
            found[name][::2] = column
    return found


def compared(rows: Floats, expected: Estimates) -> None:
    """Estimates, deviations and innovations in ``rows``, two for each sample, are those of ``observe``."""
    n, p = len(expected.names), len(expected.measured)
    assert rows[::2, :n] == pytest.approx(expected.values[1::2], abs=1e-8)
    assert rows[::2, n : 2 * n] == pytest.approx(expected.deviations[1::2], abs=1e-8)
    samples = [expected.innovations, expected.innovation_deviations, expected.squared[:, None]]
    for columns, wanted in zip(np.split(rows[::2, 2 * n :], [p, 2 * p], axis=1), samples, strict=True):
        assert columns == pytest.approx(np.nan_to_num(wanted[:-1:2]), abs=1e-8)
    assert (rows[1::2, 2 * n :] == 0).all()


def outputs_of(names: tuple[str, ...], measure: Mapping[str, float]) -> list[str]:
    found = [*names, *(f"{name}_std" for name in names), *(f"{name}_innovation" for name in measure)]
    return [*found, *(f"{name}_innovation_std" for name in measure), "innovation_squared"]


@pytest.mark.parametrize(
    ("model", "method", "measure", "process", "estimate"),
    [
        ("cart_pole", "ekf", {"x": 0.005, "theta": 0.02}, {"F": 0.1, "x": 0.01}, ()),
        ("pendulum", "ukf", {"theta": 0.005, "theta_ddot": 0.1}, {"l": 0.001}, ("l",)),
        pytest.param("four_bar_linkage", "ekf", {"a": 0.01}, {"Q_a": 0.01}, (), marks=pytest.mark.slow),
        pytest.param("four_bar_linkage", "ukf", {"a": 0.01}, {"Q_a": 0.01}, (), marks=pytest.mark.slow),
        pytest.param("four_bar_linkage", "ukf-simplex", {"a": 0.01}, {"Q_a": 0.01}, (), marks=pytest.mark.slow),
        pytest.param("heavy_top_quaternion", "ekf", {"e1": 0.01, "e2": 0.01}, {}, (), marks=pytest.mark.slow),
        pytest.param("whipple_bicycle", "ekf", {"phi": 0.01}, {}, (), marks=pytest.mark.slow),
    ],
)
def test_estimates_are_those_of_observe(
    model: str, method: str, measure: dict, process: dict, estimate: tuple, observer
) -> None:
    """Loops are closed, and quaternions have their norm, in every estimate."""
    data = measured(model, measure, 0.3)
    data[next(iter(measure))][4] = np.nan
    expected = lag2fmu.observe(
        model, between(data), measure=measure, process=process, estimate=estimate, method=method, step=0.005
    )
    residuals = [f"residual_{c.name}" for c in lag2fmu.load(model).constraints]
    fmu = observer(model, method, tuple(measure.items()), tuple(process.items()), estimate)
    with hosted(fmu) as host:
        host.start({"solver_step": 0.005})
        outputs = outputs_of(expected.names, measure)
        rows = followed(host, data, [*outputs, *residuals], parts=2)
    compared(rows[:, : len(outputs)], expected)
    left = np.abs(rows[:, len(outputs) :]).max(initial=0.0)
    assert left < 1e-12 * (1 + np.abs(expected.values).max())


def test_forces_act_on_the_estimate(observer) -> None:
    """A force that is held in each step moves it as in ``observe`` with hold."""
    t = 0.02 * np.arange(30)
    data = {"time": t, "x": 0.01 * np.sin(9 * t), "F": np.cos(20 * t)}
    measure, process = {"x": 0.005, "theta": 0.02}, {"F": 0.1, "x": 0.01}
    fine = between({name: column for name, column in data.items() if name != "F"})
    fine["F"], fine["theta"] = np.repeat(data["F"], 2)[:-1], np.full(len(fine["time"]), np.nan)
    expected = lag2fmu.observe("cart_pole", fine, measure=measure, process=process, hold=True, step=0.005)
    fmu = observer("cart_pole", "ekf", tuple(measure.items()), tuple(process.items()))
    with hosted(fmu) as host:
        host.start({"solver_step": 0.005})
        data["theta"] = np.full(len(t), np.nan)
        compared(followed(host, data, outputs_of(expected.names, measure), parts=2), expected)


# ------------------------------------------------------------------------------------------------------- late samples


def late(data: Mapping[str, Floats], steps: Mapping[str, float]) -> dict[str, Floats]:
    """``data`` of which the columns in ``steps`` come that number of steps later, rounded up; before they are NaN."""
    found = dict(data)
    for name, k in steps.items():
        found[name] = np.concatenate([np.full(math.ceil(k), np.nan), data[name][: -math.ceil(k)]])
    return found


@pytest.mark.parametrize(
    ("model", "method", "measure", "process", "steps"),
    [
        ("cart_pole", "ekf", {"x": 0.005, "theta": 0.02}, {"F": 0.1, "x": 0.01}, {"theta": 3, "x": 1}),
        ("cart_pole", "ekf", {"x": 0.005, "theta": 0.02}, {"F": 0.1, "x": 0.01}, {"theta": 2.5, "x": 0.25}),
        pytest.param("cart_pole", "ukf", {"theta": 0.02}, {"F": 0.1}, {"theta": 2}, marks=pytest.mark.slow),
        pytest.param("four_bar_linkage", "ekf", {"a": 0.01}, {"Q_a": 0.01}, {"a": 2.5}, marks=pytest.mark.slow),
        pytest.param("four_bar_linkage", "ekf", {"a": 0.01}, {"Q_a": 0.01}, {"a": 2}, marks=pytest.mark.slow),
        pytest.param("four_bar_linkage", "ukf", {"a": 0.01}, {"Q_a": 0.01}, {"a": 2}, marks=pytest.mark.slow),
    ],
)
def test_late_samples_count_for_their_own_time(
    model: str, method: str, measure: dict, process: dict, steps: dict, observer
) -> None:
    """Whatever has come by then, the estimate is that of ``observe``, which sorts all of it first."""
    data = late(measured(model, measure, 0.3), steps)
    data[next(iter(measure))][7] = np.nan
    if model == "cart_pole":
        data["F"] = np.cos(400 * data["time"])
    delays = {name: 0.02 * k for name, k in steps.items()}
    outputs = [q for name in lag2fmu.function(model).names["x"] for q in (name, f"{name}_std")]
    fmu = observer(model, method, (*measure.items(),), (*process.items(),), delays=(*delays.items(),))
    with hosted(fmu) as host:
        host.start({"solver_step": 0.005})
        rows = followed(host, data, [*outputs, *(f"{name}_innovation" for name in measure)])
    for i in (5, 9, 14):
        come = {name: np.append(column[:i], np.nan if name in measure else column[i]) for name, column in data.items()}
        come["time"] = data["time"][: i + 1]
        found = lag2fmu.observe(
            model, come, measure=measure, process=process, delays=delays, method=method, step=0.005, hold=True
        )
        expected = [column[-1] for name in found.names for column in (found[name], found.deviation(name))]
        own = [np.argmin(abs(found.time - data["time"][i - 1] + delays.get(name, 0.0))) for name in measure]
        expected += np.nan_to_num(found.innovations[own, range(len(own))]).tolist()
        assert rows[i - 1] == pytest.approx(expected, abs=1e-8)


def test_late_samples_against_least_squares(observer) -> None:
    """On a linear model: the unknowns are the start and the noise of each step, and all that has come is one system."""
    m, late_by, size, density = 30, 4, 0.1, 0.4
    values = {p.name: p.value for p in lag2fmu.load("spring_mass_damper").parameters}
    A = np.array([[0, 1], [-values["k"] / values["m"], -values["c"] / values["m"]]])
    nodes = (0.5 - np.sqrt(3) / 6, 0.5 + np.sqrt(3) / 6)
    Phi, parts = np.eye(2), []
    for _ in range(4):
        grown = [exponential(A * (1 - node) * H / 4) @ [0, density / values["m"]] for node in nodes]
        parts = [exponential(A * H / 4) @ part for part in parts] + [np.sqrt(H / 8) * g for g in grown]
        Phi = exponential(A * H / 4) @ Phi
    root = np.array(parts).T
    data = late({"time": H * np.arange(m), "x": np.sin(np.arange(m))}, {"x": late_by})
    fmu = observer("spring_mass_damper", "ekf", (("x", size),), (("Q_x", density),), delays=(("x", late_by * H),))
    with hosted(fmu) as host:
        host.start({"x_start_std": 0.2, "x_dot_start_std": 0.3, "solver_step": H / 4})
        mean = np.array(host.get(["x", "x_dot"]))
        rows = followed(host, data, ["x", "x_dot", "x_std", "x_dot_std"])
    by, k = np.diag([0.2, 0.3]) @ np.eye(2, 2 + root.shape[1] * m), root.shape[1]
    states = [(mean, by)]
    for i in range(m - 1):
        by = Phi @ by
        by[:, 2 + k * i : 2 + k * (i + 1)] = root
        mean = Phi @ mean
        states.append((mean, by))
        come = [(data["x"][j], *states[j - late_by]) for j in range(late_by, i + 1)]
        system = np.concatenate([np.eye(by.shape[1]), *(b[None, 0] / size for _, _, b in come)])
        right = np.concatenate([np.zeros(by.shape[1]), [(x - a[0]) / size for x, a, _ in come]])
        unknowns, inverse = np.linalg.lstsq(system, right)[0], np.linalg.inv(np.linalg.qr(system)[1])
        assert rows[i, :2] == pytest.approx(mean + by @ unknowns, abs=1e-10)
        assert rows[i, 2:] == pytest.approx(np.linalg.norm(by @ inverse, axis=1), abs=1e-10)


LATE = ("bob", "ekf", (("x", 0.1),), (("Q_theta", 0.3),), (), "2.0", (("x", 2.5 * H),))


def test_what_is_late_is_saved_and_restored(observer) -> None:
    """Samples between communication points too; the past is a part of the state."""
    fmu, data = observer(*LATE), seen()
    first, second = ({name: column[part] for name, column in data.items()} for part in (slice(12), slice(11, 30)))
    with Stepping(fmu.path) as host, Stepping(fmu.path) as other:
        host.start(KNOWN)
        followed(host, first, STATES)
        state = host.unit.getFMUState()
        expected = followed(host, second, STATES)
        host.unit.setFMUState(state)
        assert bits(followed(host, second, STATES).ravel()) == bits(expected.ravel())
        other.start(KNOWN)
        other.unit.setFMUstate(other.unit.deSerializeFMUstate(host.unit.serializeFMUstate(state)))
        assert bits(followed(other, second, STATES).ravel()) == bits(expected.ravel())
        host.unit.freeFMUState(state)


def test_a_delay_of_too_many_steps_is_refused(observer) -> None:
    """What is kept has room for 256 communication points; a longer step is taken afterwards."""
    with Stepping(observer(*LATE).path) as host:
        host.start({**KNOWN, "x_delay": 0.26})
        for i in range(256):
            host.unit.doStep(i * 0.001, 0.001)
        before = host.get(STATES)
        with pytest.raises(FMICallException, match="discard"):
            host.unit.doStep(0.256, 0.001)
        assert any("late by 0.26 s, in which there are more communication points" in text for text in host.sentences)
        assert bits(host.get(STATES)) == bits(before)


# ------------------------------------------------------------------------------------------------------- states


@pytest.mark.parametrize("method", ["ekf", "ukf"])
def test_a_run_repeats_bit_for_bit_from_a_saved_state(method: str, observer) -> None:
    """The covariance is a part of the state: also in another instance, and after a reset."""
    fmu, data = observer("bob", method, *PENDULUM[2:]), seen()
    first, second = ({name: column[part] for name, column in data.items()} for part in (slice(12), slice(11, 30)))
    with Stepping(fmu.path) as host, Stepping(fmu.path) as other:
        host.start(KNOWN)
        begun = followed(host, first, STATES)
        state = host.unit.getFMUState()
        expected = followed(host, second, STATES)
        host.unit.setFMUState(state)
        assert bits(followed(host, second, STATES).ravel()) == bits(expected.ravel())
        other.start(KNOWN)
        other.unit.setFMUstate(other.unit.deSerializeFMUstate(host.unit.serializeFMUstate(state)))
        assert bits(followed(other, second, STATES).ravel()) == bits(expected.ravel())
        host.unit.freeFMUState(state)
        host.unit.reset()
        host.start(KNOWN)
        assert bits(followed(host, first, STATES).ravel()) == bits(begun.ravel())


def test_samples_at_their_own_times(observer) -> None:
    """Of samples every 0.1 s those between are not taken; a step that is longer is not, and leaves all as it was."""
    with Stepping(observer(*PENDULUM).path) as host, Stepping(observer(*PENDULUM).path) as every:
        host.start({**KNOWN, "x_sample_time": 2 * H})
        every.start(KNOWN)
        data, rare = seen(20), seen(20)
        rare["x"][1::2] = np.nan
        data["x"] = np.nan_to_num(data["x"])
        rare["x"] = np.where(np.arange(20) % 2, np.nan, data["x"])
        assert bits(followed(host, data, STATES).ravel()) == bits(followed(every, rare, STATES).ravel())
        before = host.get(STATES)
        with pytest.raises(FMICallException, match="discard"):
            host.unit.doStep(float(data["time"][-1]), 0.11)
        assert any("0.11 s is longer than a sample time, 0.1 s" in sentence for sentence in host.sentences)
        assert bits(host.get(STATES)) == bits(before)


def test_noise_can_be_tuned_while_it_runs(observer) -> None:
    with Stepping(observer(*PENDULUM).path) as host, Stepping(observer(*PENDULUM).path) as other:
        host.start(KNOWN)
        other.start(KNOWN)
        host.set({"x_noise": 1e3})
        found, usual = followed(host, seen(), STATES), followed(other, seen(), STATES)
        assert (found[5:, 2] > 1.5 * usual[5:, 2]).all()
        with pytest.raises(FMICallException):
            host.set({"x_noise": -1.0})


# ------------------------------------------------------------------------------------------------------- importers


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_wired_to_the_plant_in_a_system(fmi: str, observer, exported) -> None:
    """The observer starts beside the truth and comes to it, from the plant's own signals alone."""
    fmu = observer("cart_pole", "ekf", (("x", 0.005), ("theta", 0.02)), (("F", 0.1), ("x", 0.01)), fmi=fmi)
    run = lag2fmu.simulate(
        {"plant": exported("cart_pole", fmi=fmi).path, "eye": fmu.path},
        connect=["plant.x:eye.x_measured", "plant.theta:eye.theta_measured"],
        values={"eye.theta_dot": 1.0},
        stop_time=1.5,
        step=0.01,
    )
    error = np.abs(run["eye.theta_dot"] - run["plant.theta_dot"])
    assert error[:20].max() > 0.05
    assert error[-20:].max() < 0.02


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_the_checker_finds_nothing(fmi: str, observer) -> None:
    fmu = observer("cart_pole", "ekf", (("x", 0.005), ("theta", 0.02)), (("F", 0.1), ("x", 0.01)), fmi=fmi)
    assert check_fmu(fmu.path).findings == ()


def test_there_is_no_model_exchange_and_no_derivative_of_outputs(observer) -> None:
    fmu = observer(*PENDULUM, fmi="3.0")
    assert [*fmu.description.interface.capabilities] == ["CoSimulation"]
    with Stepping3(fmu.path) as host:
        host.start()
        with pytest.raises(FMICallException):
            host.unit.getOutputDerivatives([host.references["theta"]], [1])
        assert any("has no derivatives of outputs, such as theta" in text for _, _, text in host.log)
        said: list[str] = []
        unit = FMU3Model(
            guid=fmu.description.guid,
            unzipDirectory=str(fmu.path.with_suffix(".unpacked")),
            modelIdentifier=fmu.description.model_identifier,
            instanceName="it",
        )
        with pytest.raises(Exception, match="Failed to instantiate"):
            unit.instantiate(logMessage=lambda *a: said.append(a[-1].decode()))
        assert "instantiate it for co-simulation" in said[0]


# ------------------------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (Observing("kf", {"x": 1.0}), "there is no observer 'kf'; known are ekf, ukf, ukf-simplex"),
        (Observing("ekf", {}), "nothing is measured"),
        (Observing("ekf", {"x": 0.0}), "measure 'x': 0.0 is no standard deviation"),
        (Observing("ekf", {"x": -1.0}), "measure 'x': -1.0 is no standard deviation"),
        (Observing("ekf", {"y": 1.0}), "has no variable 'y'"),
        (Observing("ekf", {"x": 1.0}, {"y": 1.0}), "process 'y' is no input, state or estimated parameter"),
        (Observing("ekf", {"x": 1.0}, {"F": 0.0}), "process 'F': 0.0 is no density of noise"),
        (Observing("ekf", {"x": 1.0}, {}, ("l", "l")), "estimate: 'l' stands twice; name it once"),
        (Observing("ekf", {"x": 1.0}, {}, ("k",)), "'k' is no parameter that can be estimated"),
        (Observing("ekf", {"x": 1.0}, {}, (), {"x": -1.0}), "sample time of 'x': -1.0 s"),
        (Observing("ekf", {"x": 1.0}, delays={"theta": 0.1}), "delay of 'theta': 0.1 s; give a measured name"),
    ],
)
def test_what_cannot_be_asked(asked: Observing, said: str, tmp_path: Path) -> None:
    with pytest.raises((LoadError, DerivationError), match=said):
        lag2fmu.export("cart_pole", tmp_path / "it.fmu", observer=asked)
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    ("model", "choices", "said"),
    [
        ("cart_pole", {"solver": "radau5"}, "an observer moves its estimate by rk4"),
        ("cart_pole", {"backend": "python"}, "an observer is C code"),
        ("cart_pole", {"profile": "realtime"}, "no bound of its steps"),
        ("cart_pole", {"page": "live"}, "the page of an observer is static"),
        ("bouncing_ball", {}, "their modes have no covariance"),
    ],
)
def test_what_does_not_go_together(model: str, choices: dict, said: str, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=said):
        lag2fmu.export(model, tmp_path / "it.fmu", observer=Observing("ekf", {"x": 1.0}), **choices)


def test_a_word_is_no_observer(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="observer: 'ekf' says not what is measured; give lag2fmu"):
        lag2fmu.export("cart_pole", tmp_path / "it.fmu", observer="ekf")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--measure", "x=1"], "--measure goes with --observer"),
        (["--delay", "x=1"], "--delay goes with --observer"),
        (["--observer", "ekf", "--measure", "x_ddot"], "measure 'x_ddot': it has no nominal value"),
        (["--observer", "ekf", "--measure", "thetta"], "by, as states have: did you mean 'theta'"),
        (["--observer", "ekf", "--measure", "x=1", "--reference"], "observers follow samples"),
    ],
)
def test_bad_options(options: list[str], said: str, tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["export", "cart_pole", "-o", str(tmp_path / "it.fmu"), *options])
    assert done.exit_code == 2
    assert said in done.stderr


def test_the_command_line_and_what_samples_do_not_show(tmp_path: Path) -> None:
    path = tmp_path / "it.fmu"
    asked = [
        "export",
        "cart_pole",
        "-o",
        str(path),
        "--observer",
        "ukf",
        "--measure",
        "theta=2 deg",
        "--process",
        "F=1",
    ]
    for _ in range(2):  # the second time it is its own file that is overwritten
        more = ["--estimate", "l", "--sample-time", "theta=20 ms", "--delay", "theta=40 ms"]
        done = CliRunner().invoke(main, [*asked, *more])
        assert done.exit_code == 0, done.stderr
        assert "what is measured does not show x;" in done.stderr
    with Stepping(path) as host:
        host.start()
        assert host.get(["theta_noise", "F_density", "theta_sample_time", "theta_delay"]) == pytest.approx(
            [np.radians(2), 1.0, 0.02, 0.04], rel=1e-12
        )
        assert host.get(["l_std"])[0] == pytest.approx(0.1 * host.get(["l"])[0])
