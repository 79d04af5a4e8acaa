"""Stepping an FMU: ``lag2fmu.start``, and ``simulate`` with a sampled controller."""

from __future__ import annotations

import gc
import math
import re
import time
import zipfile
from ctypes import c_double, c_int, c_void_p
from pathlib import Path

import numpy as np
import pytest

import lag2fmu
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.verify.channels import direct

pytestmark = pytest.mark.fmu

FMI = pytest.mark.parametrize("fmi", ["2.0", "3.0"])


@FMI
def test_steps_are_those_of_a_run_with_held_inputs(fmi: str, exported) -> None:
    fmu = exported("cart_pole", fmi=fmi)
    forces = [1.0, -2.0, 0.5, 0.0]
    inputs = {"time": [0.0, 0.25, 0.5, 0.75], "F": forces}
    same = {"values": {"theta": 0.3, "F": forces[0]}, "tolerance": 1e-11}
    run = lag2fmu.simulate(fmu, stop_time=1.0, step=0.25, inputs=inputs, hold=True, **same)
    with lag2fmu.start(fmu, **same) as sim:
        rows = [sim[run.names]]
        for force in forces:
            sim.step(0.25, {"F": force})
            rows.append(sim[run.names])
        assert sim.time == 1.0
    assert np.array(rows) == pytest.approx(run.values, rel=1e-9, abs=1e-9)


@FMI
def test_a_saved_state_is_gone_back_to_as_often_as_wanted(fmi: str, exported) -> None:
    with lag2fmu.start(exported("cart_pole", fmi=fmi)) as sim:
        sim.step(0.1, {"F": 3.0})
        saved, ends = sim.save(), []
        for _ in range(3):
            sim.restore(saved)
            assert sim.time == saved.time == 0.1
            sim.step(0.4)
            ends.append((sim.time, *sim[sim.outputs]))
    assert ends[0] == ends[1] == ends[2]


def test_the_time_of_equal_steps_is_their_number_times_their_length(exported) -> None:
    """Sums of 1e-3 s would miss 3 s by 2e-13 s."""
    with lag2fmu.start(exported("pendulum")) as sim:
        for _ in range(2500):
            sim.step(1e-3)
        sim.step(0.5)
        assert sim.time == 3.0


def test_states_that_nobody_holds_are_freed(exported, monkeypatch) -> None:
    with lag2fmu.start(exported("pendulum")) as sim:
        fmu, freed = sim._instance.fmu, []
        monkeypatch.setattr(
            fmu, "freeFMUState", lambda state: freed.append(state) or type(fmu).freeFMUState(fmu, state)
        )
        for _ in range(5):
            sim.save()
        gc.collect()
        assert len(freed) == 5
        kept = sim.save()
    assert len(freed) == 6  # those that are held are freed when the simulation is closed
    with pytest.raises(SimulationError, match="closed"):
        sim.restore(kept)


def test_names_together_take_an_array(exported) -> None:
    """The same bits as one by one, alone and beside others, in any order of the variables."""
    forces, angles = ("Q_theta2", "Q_theta1"), ("theta1", "theta2")
    runs = []
    for command in (
        {forces: np.array([0.5, 2.0]), "m1": 1.5},
        {forces: [0.5, 2.0], ("m1",): 1.5},
        {"Q_theta1": 2.0, "Q_theta2": 0.5, "m1": 1.5},
    ):
        with lag2fmu.start(exported("double_pendulum")) as sim:
            sim.step(0.1, command)
            sim.step(0.1, {forces: (0.1, 0.2)})
            runs.append(tuple(sim[angles]))
    assert len(set(runs)) == 1
    with lag2fmu.start(exported("double_pendulum")) as sim:
        for numbers, said in (([1.0], "has 1 numbers; give 2"), ([1.0, math.nan], "not finite"), ("ab", "no number")):
            with pytest.raises(LoadError, match=f"the input '?Q_theta2, Q_theta1.*{said}"):
                sim.step(0.1, {forces: numbers})
        with pytest.raises(LoadError, match="Q_nothing"):
            sim.step(0.1, {("Q_theta1", "Q_nothing"): [1.0, 2.0]})


def test_arrays_of_any_kind_are_taken_and_a_list_of_names_may_grow(exported) -> None:
    forces, names, found = ("Q_theta1", "Q_theta2"), ["theta1"], set()
    kinds = (np.array([1.0, 2.0]), np.array([1, 2]), np.array([1, 2], np.float32), np.array([1.0, 0.0, 2.0])[::2])
    for numbers in (*kinds, kinds[0].astype(">f8"), kinds[0][:, None]):
        with lag2fmu.start(exported("double_pendulum")) as sim:
            sim.step(0.1, {forces: numbers})
            with pytest.raises(LoadError, match="not finite"):
                sim.step(0.1, {forces: np.array([math.inf, -math.inf])})
            sim.step(np.float64(0.1))
            found.add(tuple(sim[["theta1", "theta2"]]))
            assert len(sim[names]) == len(sim[names]) == 1
            assert sim.time == 0.2
    assert len(found) == 1
    with lag2fmu.start(exported("double_pendulum")) as sim:
        assert len(sim[names]) == 1
        names.append("theta2")
        assert len(sim[names]) == 2
        assert (sim[np.array(names)] == sim[tuple(names)]).all()


def test_arrays_are_set_and_read_as_a_whole(exported) -> None:
    fmu = exported("double_pendulum", fmi="3.0", arrays=True)
    with lag2fmu.start(fmu) as sim, lag2fmu.start(fmu) as other:
        assert sim["q"] == pytest.approx(sim[["q"]])
        assert sim["q"].shape == (2,)
        sim.step(0.1, {"Q": [0.2, -0.1]})
        other.step(0.1, dict(zip(other.inputs, [0.2, -0.1], strict=False)))
        assert (sim["q"] == other["q"]).all()
        with pytest.raises(LoadError, match="input 'Q' has 3 numbers; give 2 numbers"):
            sim.set({"Q": [1.0, 2.0, 3.0]})


def test_a_parameter_that_is_tunable_can_be_set(exported) -> None:
    with lag2fmu.start(exported("pendulum")) as sim:
        sim.step(0.1, {"g": 0.0})
        before = sim["theta_dot"]
        sim.step(0.5)
        assert sim["theta_dot"] == pytest.approx(before, abs=1e-9)


def test_it_begins_at_the_start_time_and_takes_models_without_an_fmu() -> None:
    with lag2fmu.start("cart_pole", start_time=2.0, solver="rk4") as sim:
        sim.step(0.5)
        assert sim.time == 2.5
        assert sim["solver_step"] >= 0.0


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda sim: sim.step(0.0), "step h = 0.0 s is not positive and finite"),
        (lambda sim: sim.step(-1e-3), "step h = -0.001 s is not positive"),
        (lambda sim: sim.step(math.nan), "step h = nan s is not positive"),
        (lambda sim: sim.step("1"), "step h = '1' s is not positive"),
        (lambda sim: sim.step(1e-3, [1.0]), r"the inputs are \[1.0\]; give a mapping {name: value}"),
        (lambda sim: sim[3], "no variable '3'"),
        (lambda sim: sim.step(1e-3, {"f": 1.0}), "no input 'f'; did you mean 'F'"),
        (lambda sim: sim.step(1e-3, {"theta": 1.0}), "no input 'theta'"),
        (lambda sim: sim.step(1e-3, {"F": math.nan}), "input F = nan is not finite; check what computes it"),
        (lambda sim: sim.step(1e-3, {"F": "much"}), "input F = 'much' is no number"),
        (lambda sim: sim.step(1e-3, {"F": [1.0, 2.0]}), "input 'F' has 2 numbers; give one number"),
        (lambda sim: sim["thetta"], "no variable 'thetta'; did you mean 'theta'"),
        (lambda sim: sim.restore(object()), "not saved by this simulation"),
    ],
)
def test_what_cannot_be_is_a_sentence_and_the_simulation_goes_on(call, sentence: str, exported) -> None:
    with lag2fmu.start(exported("cart_pole")) as sim:
        with pytest.raises(LoadError, match=f"(?s){sentence}"):
            call(sim)
        sim.step(0.1, {"F": np.float32(1)})
        assert sim.time == 0.1


def test_an_input_beyond_its_range_is_refused_in_the_words_of_the_fmu(tmp_path: Path) -> None:
    text = tmp_path / "ranged.toml"
    text.write_text(
        "[mechanism]\nname = 'ranged'\n[coordinates]\nx = {}\n[inputs]\nu = { min = -1, max = 2 }\n"
        "[energy]\nkinetic = 'x_dot**2/2'\n[forces]\nx = 'u'\n"
    )
    with lag2fmu.start(text) as sim:
        with pytest.raises(LoadError, match="u cannot be set to 5; expected a value from -1 to 2"):
            sim.step(0.1, {"u": 5.0})
        sim.step(0.1, {"u": 2.0})
        assert sim["x"] == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"values": {"thetta": 1.0}}, "no settable variable 'thetta'"),
        ({"values": {"theta": math.nan}}, "theta = nan is not finite"),
        ({"tolerance": 2.0}, "no relative tolerance"),
        ({"start_time": math.inf}, "start time inf s is not finite"),
    ],
)
def test_wrong_starts(settings: dict, sentence: str, exported) -> None:
    with pytest.raises(LoadError, match=sentence):
        lag2fmu.start(exported("cart_pole"), **settings)


def test_nothing_can_be_done_after_closing(exported) -> None:
    sim = lag2fmu.start(exported("pendulum"))
    saved = sim.save()
    sim.close()
    sim.close()
    calls = (lambda: sim.step(0.1), lambda: sim["theta"], sim.save, lambda: sim.restore(saved), lambda: sim.set({}))
    for call in calls:
        with pytest.raises(SimulationError, match=r"closed; start another one by lag2fmu\.start"):
            call()


def test_a_motion_that_ends_tells_the_time_and_can_be_gone_back_from(tmp_path: Path) -> None:
    """x_ddot = 2 x^3 from x = 1, x_dot = 1: x = 1/(1 - t) is infinite at 1 s."""
    text = tmp_path / "runaway.toml"
    text.write_text(
        "[mechanism]\nname = 'runaway'\n[coordinates]\nx = { start = 1.0, velocity = 1.0 }\n"
        "[energy]\nkinetic = 'x_dot**2/2'\npotential = '-x**4/2'\n"
    )
    with lag2fmu.start(text) as sim:
        sim.step(0.5)
        saved = sim.save()
        with pytest.raises(SimulationError, match=r"(?s)cannot step by 2 s at t = 0\.5 s: .*x"):
            sim.step(2.0)
        sim.restore(saved)
        sim.step(0.25)
        assert sim["x"] == pytest.approx(4.0, rel=1e-4)


def test_what_an_fmu_refuses_is_a_sentence_with_the_time(exported, monkeypatch) -> None:
    """An FMU of another tool may fail in any call."""

    def refusing(*_: object) -> None:
        raise RuntimeError("status 3")

    with lag2fmu.start(exported("pendulum")) as sim:
        saved = sim.save()
        sim.step(0.5)
        monkeypatch.setattr("lag2fmu.verify.channels.direct", lambda *_: refusing)
        for call in ("getFMUState", "setFMUState"):
            monkeypatch.setattr(sim._instance.fmu, call, refusing)
        with pytest.raises(SimulationError, match=r"cannot give l at t = 0\.5 s: status 3; "):
            sim["l"]
        with pytest.raises(SimulationError, match=r"cannot save its state at t = 0\.5 s: status 3"):
            sim.save()
        with pytest.raises(SimulationError, match=r"cannot go back to t = 0 s at t = 0\.5 s: status 3"):
            sim.restore(saved)
        monkeypatch.undo()


def test_a_call_that_the_fmu_refuses_is_told_by_its_status(exported) -> None:
    with lag2fmu.start(exported("pendulum")) as sim:
        h = c_double(0.1)
        call = direct(sim._instance.fmu, "fmi2DoStep", (c_void_p(sim._instance.fmu.component), c_double(), h, c_int(1)))
        call()
        h.value = -0.1
        with pytest.raises(RuntimeError, match="fmi2DoStep returned status 3"):
            call()


def test_an_fmu_without_co_simulation_is_told(exported, tmp_path: Path) -> None:
    path = tmp_path / "exchange.fmu"
    with zipfile.ZipFile(exported("pendulum").path) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                content = re.sub(rb"(?s)<CoSimulation.*?</CoSimulation>|<CoSimulation[^>]*/>", b"", content)
            new.writestr(name, content)
    with pytest.raises(LoadError, match="offers no co-simulation, which alone can be stepped"):
        lag2fmu.start(path)


def test_there_are_thousands_of_steps_a_second(exported) -> None:
    count, names = 3000, ("x", "theta", "x_dot", "theta_dot")
    with lag2fmu.start(exported("cart_pole")) as sim:
        begun = time.process_time()
        for _ in range(count):
            x, _, v, _ = sim[names]
            sim.step(1e-3, {"F": -x - v})
        assert count / (time.process_time() - begun) > 5000


# ------------------------------------------------------------------------------------------------- sampled controllers


@FMI
@pytest.mark.parametrize("sample_time", [0.02, 0.013, 0.5])
def test_a_sampled_controller_is_the_loop_written_by_hand(fmi: str, sample_time: float, exported) -> None:
    fmu, asked = exported("cart_pole", fmi=fmi), []

    def law(t: float, y: dict[str, float]) -> dict[str, float]:
        asked.append(t)
        return {"F": -3.0 * y["x"] - 2.0 * y["x_dot"] + 5.0 * y["theta_dot"]}

    run = lag2fmu.simulate(
        fmu, stop_time=1.3, step=0.1, tolerance=1e-11, inputs=law, sample_time=sample_time, outputs=["theta", "F"]
    )
    count = len(asked)
    assert asked == pytest.approx(np.arange(math.floor(1.3 / sample_time + 1e-9) + 1) * sample_time)
    assert run.time == pytest.approx(np.arange(14) * 0.1)
    times = sorted({*np.round(run.time, 9), *np.round(asked, 9)})
    with lag2fmu.start(fmu, tolerance=1e-11) as sim:
        for t in times[1:]:
            if np.isclose(asked[:count], sim.time, atol=1e-8, rtol=0).any():
                sim.set(law(sim.time, {name: sim[name] for name in sim.outputs}))
            sim.step(t - sim.time)
        assert run["theta"][-1] == pytest.approx(sim["theta"], abs=1e-9)


def test_a_controller_sees_what_is_recorded_and_keeps_what_it_meets(exported) -> None:
    seen = []

    def law(t: float, y: dict[str, float]) -> dict[str, float]:
        seen.append(y["total_energy"])
        return {"F": 0.0}

    run = lag2fmu.simulate(
        exported("cart_pole"), stop_time=0.2, step=0.1, inputs=law, sample_time=0.1, outputs=["total_energy"]
    )
    assert seen == run["total_energy"].tolist()


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"inputs": lambda t, y: {"F": math.nan}}, "input F = nan is not finite"),
        ({"inputs": lambda t, y: {"G": 0.0}}, "no input 'G'"),
        ({"inputs": lambda t, y: 1.0}, "gave 1.0 at t = 0 s; it must give {name: value}"),
        ({"inputs": lambda t, y: {"F": y["phi"]}}, "failed at t = 0 s: KeyError: 'phi'"),
        ({"sample_time": 0.0}, "sample time 0.0 s is not positive"),
        ({"sample_time": math.nan}, "sample time nan s is not positive"),
        ({"inputs": {"time": [0.0], "F": [0.0]}}, "inputs are a function of t and y, not a dict"),
        ({"inputs": None}, "inputs are a function of t and y, not a NoneType"),
        ({"kind": "model-exchange"}, "need co-simulation, not model-exchange"),
    ],
)
def test_wrong_controllers(settings: dict, sentence: str, exported) -> None:
    usual = {"inputs": lambda t, y: {"F": 0.0}, "sample_time": 0.1, "stop_time": 0.2}
    with pytest.raises((LoadError, SimulationError), match=sentence):
        lag2fmu.simulate(exported("cart_pole"), **{**usual, **settings})


def test_a_system_has_no_sample_time(tmp_path: Path) -> None:
    with pytest.raises(LoadError, match="a system has no sample_time"):
        lag2fmu.simulate(tmp_path / "two.ssp", sample_time=0.1)
