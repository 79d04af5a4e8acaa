"""Batches in lanes agree with the FMU's own engine and with the FMU, whatever the neighbours and the threads."""

from __future__ import annotations

import os
import pickle
import signal
import threading
import time
from functools import cache

import numpy as np
import pytest
from scipy.special import ellipk

import lag2fmu
from lag2fmu.ensemble import Ensemble, Runs
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.formats.text import read

pytestmark = pytest.mark.fmu
N = 11  # no multiple of the lanes
BLOCK = """
[mechanism]
name = "block"
title = "A free mass"
[coordinates]
x = { unit = "m" }
[bodies.block]
mass = 2.0
position = ["x", 0]
[inputs]
F = { unit = "N" }
[forces]
x = "F"
[experiment]
stop_time = 1.0
"""


@cache
def ensemble(model: str, solver: str = "dopri5", lanes: int | None = None) -> Ensemble:
    return Ensemble(model, solver=solver, lanes=lanes)


def spread(low: float, high: float, count: int = N) -> np.ndarray:
    return np.linspace(low, high, count)


def farthest(a: Runs, b: Runs) -> float:
    return max(float(np.abs(a[name] - b[name]).max()) for name in a.samples)


def test_period_of_the_pendulum() -> None:
    """From elliptic integrals: T = 4 K(sin(a/2)) sqrt(l/g); at T/4 the pendulum hangs, at T/2 it is at -a."""
    a = spread(0.1, 3.0)
    quarter = ellipk(np.sin(0.5 * a) ** 2) * np.sqrt(1.0 / 9.81)
    runs = ensemble("pendulum").run(
        starts={"theta": a}, parameters={"l": 1.0, "g": 9.81}, stop_time=2.0 * quarter, crossings=["theta"],
        extremes=["theta"], outputs=["theta", "total_energy"], tolerance=1e-10,
    )  # fmt: skip
    assert runs.in_lanes.all()
    assert np.allclose(runs.final["theta"], -a, rtol=0, atol=2e-8)
    assert np.allclose(runs.crossings["theta"][:, 0], quarter, rtol=1e-9)
    assert (runs.crossing_counts["theta"] == 1).all()
    assert np.allclose(runs.maximum["theta"], a)
    assert np.allclose(runs.minimum["theta"], -a, rtol=2e-6)


def test_a_measured_spring() -> None:
    """A table whose kinks steps may pass is a force of -4 N/m; a mass of 2 kg has the zero pi/2 sqrt(2/4) s."""
    table = "[tables.pull]\ncolumns = [[-1, 0, 1], [4, 0, -4]]\n"
    spring = read(BLOCK.replace('"F"\n', '"F + smooth(pull(x))"\n') + table, "spring")
    runs = Ensemble(spring).run(starts={"x": spread(0.1, 0.9)}, crossings=["x"], tolerance=1e-10, stop_time=1.5)
    assert runs.in_lanes.all()
    assert np.allclose(runs.final["x"], spread(0.1, 0.9) * np.cos(np.sqrt(2.0) * 1.5), rtol=0, atol=1e-9)
    assert np.allclose(runs.crossings["x"][:, 0], np.pi / np.sqrt(8.0), rtol=1e-9)


def test_a_run_gives_the_same_bits_whatever_runs_beside_it() -> None:
    starts, stops = spread(-2.0, 2.0, 40), spread(1.0, 4.0, 40)
    model = ensemble("double_pendulum")
    together = model.run(starts={"theta1": starts}, stop_time=stops, samples=[0.0, 0.5, 1.0], threads=1)
    threads = model.run(starts={"theta1": starts}, stop_time=stops, samples=[0.0, 0.5, 1.0], threads=3)
    order = np.random.default_rng(0).permutation(40)
    mixed = model.run(starts={"theta1": starts[order]}, stop_time=stops[order], samples=[0.0, 0.5, 1.0])
    for name in together.samples:
        assert np.array_equal(together[name], threads[name])
        assert np.array_equal(together[name][order], mixed[name])
        assert np.array_equal(together.final[name][order], mixed.final[name])
    for i in (0, 17, 39):
        alone = model.run(starts={"theta1": starts[i]}, stop_time=stops[i], samples=[0.0, 0.5, 1.0])
        assert alone.final["theta2"][0] == together.final["theta2"][i]


SLOW = pytest.mark.slow  # each compiles the whole engine


@SLOW
@pytest.mark.parametrize(
    ("model", "solver", "varied", "low", "high"),
    [
        ("four_bar_linkage", "dopri5", "l2", 0.24, 0.26),
        ("double_pendulum", "verlet", "l1", 0.5, 1.0),
        ("bouncing_ball", "dopri5", "e", 0.5, 0.9),  # leaves its lanes
    ],
)
def test_everything_has_the_same_bits_in_any_order(
    model: str, solver: str, varied: str, low: float, high: float
) -> None:
    chosen, values, stops = ensemble(model, solver), spread(low, high, 21), spread(0.5, 1.0, 21)
    names = chosen.names[:4]

    def run(order: np.ndarray, threads: int) -> list[np.ndarray]:
        runs = chosen.run(
            parameters={varied: values[order]}, stop_time=stops[order], samples=[0.1, 0.3], outputs=names,
            extremes=names, crossings=names, events=chosen.events, threads=threads,
        )  # fmt: skip
        kinds = (runs.samples, runs.final, runs.minimum, runs.maximum, runs.crossings, runs.event_counts)
        assert not runs.reasons
        ragged = [np.array([times.sum() for times in runs.events[name]]) for name in chosen.events]
        return [array for kind in kinds for array in kind.values()] + ragged

    order = np.random.default_rng(0).permutation(21)
    straight, mixed, alone = run(np.arange(21), 1), run(order, 3), run(np.array([7]), 1)
    for a, b, c in zip(straight, mixed, alone, strict=True):
        assert np.array_equal(a[order], b, equal_nan=True)
        assert np.array_equal(a[7:8], c, equal_nan=True)


def test_another_process_gets_an_ensemble() -> None:
    model = ensemble("double_pendulum")
    again = pickle.loads(pickle.dumps(model)).run(stop_time=1.0)
    assert np.array_equal(again.final["theta1"], model.run(stop_time=1.0).final["theta1"])


@SLOW
@pytest.mark.skipif(os.name != "posix", reason="a process interrupts itself by a signal")
def test_an_interrupted_batch_ends_at_once() -> None:
    """It would take minutes; afterwards the ensemble goes on."""
    model = ensemble("double_pendulum")
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell lets its background jobs ignore it
    try:
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
        begun = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            model.run(starts={"theta1": spread(0.1, 1.0, 40)}, stop_time=1e6, threads=2)
        assert time.monotonic() - begun < 20.0
    finally:
        signal.signal(signal.SIGINT, before)
    assert model.run(stop_time=1.0).in_lanes.all()


@pytest.mark.parametrize(
    "solver", ["dopri5", *(pytest.param(other, marks=SLOW) for other in ("dop853", "rk4", "verlet", "gauss4"))]
)
def test_lanes_agree_with_the_runtime_of_the_fmu(solver: str) -> None:
    asked = {
        "starts": {"theta1": spread(0.2, 0.6)},
        "parameters": {"m2": spread(0.5, 2.0), "l1": 1.2},
        "inputs": {"Q_theta1": np.array([0.0, 1.0, -1.0, 0.0])},
        "input_times": [0.0, 0.7, 1.1, 3.0],
        "stop_time": 2.0,
        "samples": 9,
        "outputs": ["theta1", "theta2_dot", "theta1_ddot", "x2", "Q_theta1", "total_energy"],
        "tolerance": 1e-9,
    }
    lanes, scalar = ensemble("double_pendulum", solver), ensemble("double_pendulum", solver, 0)
    a, b = lanes.run(**asked), scalar.run(**asked)
    assert a.in_lanes.all()
    assert not b.in_lanes.any()
    assert farthest(a, b) < 2e-7


def test_an_ensemble_agrees_with_the_fmu(exported) -> None:
    fmu = exported("double_pendulum")
    run = lag2fmu.simulate(fmu, stop_time=2.0, step=0.5, tolerance=1e-9, values={"l1": 0.7, "theta1": 1.0})
    runs = ensemble("double_pendulum").run(
        starts={"theta1": 1.0}, parameters={"l1": 0.7}, stop_time=2.0, samples=run.time, tolerance=1e-9
    )
    for name in ("theta1", "theta2", "theta1_dot"):
        assert np.allclose(runs[name][0], run[name], rtol=0, atol=3e-7)


@SLOW
@pytest.mark.parametrize(("model", "parameter"), [("four_bar_linkage", "l2"), ("rolling_disc", "m")])
def test_constrained_mechanisms_run_in_lanes(model: str, parameter: str) -> None:
    free = next(p for p in ensemble(model).mechanism.parameters if p.name == parameter)
    values = float(free.value) * spread(0.9, 1.1)
    residuals = [name for name in ensemble(model).names if name.startswith("residual_")]
    energy = ["total_energy", *residuals]
    asked = {"parameters": {parameter: values}, "samples": 5, "stop_time": 2.0, "tolerance": 1e-9, "outputs": energy}
    a, b = ensemble(model).run(**asked), ensemble(model, lanes=0).run(**asked)
    assert a.in_lanes.all()
    assert farthest(a, b) < 1e-6
    assert all(np.abs(a[name]).max() < 1e-9 for name in residuals)


def test_both_zeros_of_a_quantity_that_turns_just_beyond_0() -> None:
    """From rest at a, a little over a right angle, the potential energy -m g l cos(theta) is positive at both ends.

    It is zero at d, T/2 - d, T/2 + d, ... with the period T of elliptic integrals, the last two within one solver step.
    """
    a = 0.5 * np.pi + np.array([1e-1, 1e-2, 1e-3, 1e-4])
    half = 2.0 * ellipk(np.sin(0.5 * a) ** 2) * np.sqrt(1.0 / 9.81)
    runs = ensemble("pendulum").run(
        starts={"theta": a}, parameters={"l": 1.0, "g": 9.81}, stop_time=1.5 * half,
        crossings=["potential_energy"], tolerance=1e-10,
    )  # fmt: skip
    assert (runs.crossing_counts["potential_energy"] == 3).all()
    first, second, third = runs.crossings["potential_energy"][:, :3].T
    assert np.allclose(0.5 * (second + third), half, rtol=1e-8)
    assert np.allclose(third - second, 2.0 * first, rtol=1e-4)


@SLOW
def test_zeros_and_extremes_of_scalar_runs() -> None:
    """The same in the scalar engine, and a vibration that is fast beside the run."""
    a = 0.5 * np.pi + np.array([1e-2, 1e-4])
    scalar = ensemble("pendulum", lanes=0)
    asked = {"starts": {"theta": a}, "parameters": {"l": 1.0}, "tolerance": 1e-10, "extremes": ["theta", "theta_dot"]}
    wanted = {"stop_time": 1.2, "crossings": ["potential_energy", "theta_dot"]}
    one, other = ensemble("pendulum").run(**asked, **wanted), scalar.run(**asked, **wanted)
    for name in ("potential_energy", "theta_dot"):
        assert np.array_equal(one.crossing_counts[name], other.crossing_counts[name])
        assert np.allclose(one.crossings[name], other.crossings[name], rtol=0, atol=1e-6, equal_nan=True)
    for name in asked["extremes"]:
        assert np.allclose(one.maximum[name], other.maximum[name], rtol=0, atol=1e-6)
        assert np.allclose(one.minimum[name], other.minimum[name], rtol=0, atol=1e-6)
    sampled = scalar.run(**asked, **wanted, samples=240)
    for name in wanted["crossings"]:
        assert np.array_equal(sampled.crossing_counts[name], other.crossing_counts[name])
        assert np.allclose(sampled.crossings[name], other.crossings[name], rtol=0, atol=1e-6, equal_nan=True)
    stiff = {"l": 1.0, "g": 1e5}
    fast = scalar.run(
        starts={"theta": 0.01}, parameters=stiff, crossings=["theta"], most_crossings=2000, stop_time=10.0
    )
    assert fast.crossing_counts["theta"][0] == round(10.0 * np.sqrt(1e5) / np.pi)


@SLOW
@pytest.mark.parametrize("lanes", [None, 0])
def test_zeros_and_extremes_where_an_input_jumps(lanes: int | None) -> None:
    """A force that is held: the acceleration F / m of a free mass jumps with it, and comes to no value in between."""
    mass = Ensemble(read(BLOCK, "block"), lanes=lanes)
    runs = mass.run(
        inputs={"F": [4.0, -6.0, 2.0]}, input_times=[0.0, 0.3, 0.6], hold=True, samples=7,
        crossings=["x_ddot", "x_dot"], extremes=["x_ddot"],
    )  # fmt: skip
    assert np.allclose(runs.crossings["x_ddot"][0, :3], [0.3, 0.6, np.nan], rtol=0, atol=1e-12, equal_nan=True)
    assert np.allclose(runs.crossings["x_dot"][0, :3], [0.5, 0.9, np.nan], rtol=0, atol=1e-9, equal_nan=True)
    assert (runs.minimum["x_ddot"][0], runs.maximum["x_ddot"][0]) == (-3.0, 2.0)


@SLOW
def test_events_of_scalar_runs() -> None:
    """A ball from height h falls for t1 = sqrt(2 h / g) and flies for 2 t1 e^k after its impact k."""
    model = ensemble("bouncing_ball")
    heights = spread(0.5, 2.0, 3)
    runs = model.run(starts={"y": heights}, stop_time=3.0, outputs=["y"], events=["floor_impact", "indicator(floor)"])
    first = np.sqrt(2.0 * heights / 9.81)
    assert not runs.in_lanes.any()
    for found, t1 in zip(runs.events["floor_impact"], first, strict=True):
        expected = t1 + 2.0 * t1 * np.concatenate([[0.0], np.cumsum(0.8 ** np.arange(1, 60))])
        count = min(len(found), 20)
        assert count == min(int((expected < 3.0).sum()), 20)
        assert np.allclose(found[:count], expected[:count], rtol=0, atol=1e-6)
        assert (np.diff(found) > 0).all()
    assert (runs.event_counts["indicator(floor)"] >= runs.event_counts["floor_impact"]).all()
    short = model.run(starts={"y": heights}, stop_time=3.0, events=["floor_impact"], most_events=2)
    assert [len(times) for times in short.events["floor_impact"]] == [2, 2, 2]
    assert np.array_equal(short.event_counts["floor_impact"], runs.event_counts["floor_impact"])
    with pytest.raises(LoadError, match=r"there is no event 'floor'; known are indicator\(floor\)"):
        model.run(events=["floor"])


def test_a_run_that_fails_has_a_reason_and_stops_no_other() -> None:
    """Accelerations beyond the range of double."""
    runs = ensemble("double_pendulum").run(
        starts={"theta1_dot": [0.0, 1e200, 1.0]}, stop_time=1.0, outputs=["theta1"], extremes=["theta1"]
    )
    assert set(runs.reasons) == {1}
    assert "time 0 the equations of motion give no finite acceleration" in runs.reasons[1]
    assert np.isnan(runs.final["theta1"]).tolist() == np.isnan(runs.maximum["theta1"]).tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"starts": {"theta9": 1.0}}, "there is no start 'theta9'; known are theta2, theta1"),
        ({"outputs": ["thet1"]}, "output 'thet1'"),
        ({"starts": {"theta1": [1, 2]}, "parameters": {"m1": [1, 2, 3]}}, "parameter 'm1' has 3 values"),
        ({"samples": [1.0, 0.5]}, "do not ascend"),
        ({"samples": [0.0, 99.0], "stop_time": 1.0}, "expected times from 0 s to 1 s"),
        ({"stop_time": -1.0}, "stop_time is -1"),
        ({"start_time": np.nan}, "start_time is nan; expected a finite time"),
        ({"tolerance": 2.0}, "tolerance is 2; expected 2e-15 to below 1"),
        ({"step": np.nan}, "step is nan"),
        ({"samples": True}, "samples is True; expected a whole number"),
        ({"samples": "all"}, "samples is 'all'; expected numbers"),
        ({"samples": [0.0, np.nan]}, "times of samples do not ascend"),
        ({"outputs": "theta1"}, "outputs is 'theta1'; expected a list of names"),
        ({"events": ["impact"]}, "there is no event 'impact'; known are none"),
        ({"crossings": ["theta1"], "most_crossings": -1}, "most_crossings is -1"),
        ({"inputs": {"Q_theta1": "much"}}, "input 'Q_theta1' is 'much'; expected numbers"),
        ({"threads": 0}, "threads = 0; expected at least 1"),
        ({"inputs": {"Q_theta1": [1.0, 2.0, 3.0]}, "input_times": [0.0, 1.0]}, r"expected \(\), \(2,\) or \(runs, 2\)"),
    ],
)
def test_what_does_not_fit_is_named(asked: dict[str, object], words: str) -> None:
    with pytest.raises(LoadError, match=words):
        ensemble("double_pendulum").run(**asked)


def test_an_unknown_solver_is_named() -> None:
    with pytest.raises(SimulationError, match="unknown solver 'euler'; known are dopri5"):
        Ensemble("pendulum", solver="euler")


RANGED = BLOCK.replace("mass = 2.0", 'mass = "m"').replace(
    'F = { unit = "N" }', 'F = { unit = "N", min = -1, max = 2 }'
)
RANGED = RANGED.replace("[bodies", '[parameters]\nm = { value = 2.0, unit = "kg", min = 0.5 }\n[bodies')


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"inputs": {"F": [0.0, 3.0]}}, "input 'F' is 3; expected values in its range, -1 to 2"),
        ({"inputs": {"F": [0.0, -4.0]}, "input_times": [0.0, 1.0]}, "input 'F' is -4; expected"),
        ({"parameters": {"m": 0.1}}, "parameter 'm' is 0.1; expected values in its range, 0.5 to inf"),
    ],
)
def test_values_beyond_a_declared_range_are_refused_as_by_the_fmu(given: dict, words: str) -> None:
    ranged = Ensemble(read(RANGED, "text"))
    with pytest.raises(LoadError, match=words):
        ranged.run(**given)
    assert ranged.run(inputs={"F": [-1.0, 2.0]}).final["x"] == pytest.approx([-0.25, 0.5])
