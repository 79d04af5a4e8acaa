"""Runs of FMUs by fmpy: what comes back, inputs, and errors that say what is wrong."""

from __future__ import annotations

import math
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import lag2fmu
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.fmu import export
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Energy, Mechanism, coordinate
from lag2fmu.reference import Trajectory, held, integrate, read_csv
from lag2fmu.verify.instances import instance_of
from lag2fmu.verify.simulate import Run, simulate_fmu

pytestmark = pytest.mark.fmu


def test_all_stands_for_every_output_and_local_variable(exported) -> None:
    """In any place of the list, once each, the outputs first; "time" is the column of times."""
    own = lag2fmu.simulate(exported("pendulum"), stop_time=0.1, step=0.1)
    run = lag2fmu.simulate(exported("pendulum"), stop_time=0.1, step=0.1, outputs=["total_energy", "all"])
    assert run.names[: len(own.names)] == own.names
    assert {"theta_ddot", "total_energy", "kinetic_energy"} < set(run.names)
    assert run["time"].tolist() == [0, 0.1]


def test_outputs_and_times_by_default(exported) -> None:
    run = lag2fmu.simulate(exported("cart_pole"))
    assert run.names == ("x", "theta", "x_dot", "theta_dot", "x_tip", "y_tip")
    assert run.time == pytest.approx(np.arange(1001) * 0.01, abs=1e-9)


def test_what_a_run_needs_of_an_fmu_is_unpacked(exported) -> None:
    fmu = exported("pendulum")
    with instance_of(fmu.path, "CoSimulation") as instance:
        unpacked = {path.relative_to(instance.folder).as_posix() for path in Path(instance.folder).rglob("*")}
    assert "modelDescription.xml" in unpacked
    assert len([name for name in unpacked if name.startswith("binaries/")]) == 2  # the library in its folder
    assert not unpacked & {"sources", "documentation"}


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_values_step_and_stop_time(kind, exported) -> None:
    values = {"theta": 1.2, "l": 0.5, "Q_theta": 0.3}
    run = lag2fmu.simulate(
        exported("pendulum"), stop_time=2.0, step=0.05, tolerance=1e-9, values=values, outputs=["theta"], kind=kind
    )
    assert run.names == ("theta",)
    assert len(run) == 41
    expected = integrate(
        load("pendulum"), run.time, starts={"theta": 1.2}, parameters={"l": 0.5}, inputs={"Q_theta": 0.3}
    )
    assert run["theta"] == pytest.approx(expected.trajectory["theta"], abs=1e-6)


def test_a_name_a_record_a_path_and_an_fmu_are_the_same(exported) -> None:
    fmu = exported("pendulum")
    runs = [
        lag2fmu.simulate(model, stop_time=0.5) for model in (fmu, fmu.path, str(fmu.path), "pendulum", load("pendulum"))
    ]
    assert all((run.values == runs[0].values).all() for run in runs)


def test_progress_is_told(exported) -> None:
    times: list[float] = []
    lag2fmu.simulate(exported("pendulum"), stop_time=0.5, step=0.1, progress=times.append)
    assert times == sorted(times)
    assert times[-1] == pytest.approx(0.5)
    assert len(times) >= 5


@pytest.mark.parametrize("step", [0.3, 0.07, 0.011, 1 / 3])
def test_the_last_step_ends_at_the_stop_time(step: float, exported) -> None:
    """Also where the step does not divide it."""
    run = lag2fmu.simulate(exported("pendulum"), stop_time=1.0, step=step, tolerance=1e-9, outputs=["theta"])
    assert run.time[-1] == pytest.approx(1.0, abs=1e-9)
    expected = integrate(load("pendulum"), run.time).trajectory
    assert run["theta"] == pytest.approx(expected["theta"], abs=1e-6)


# ------------------------------------------------------------------------------------------------------------ inputs


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_inputs_from_csv_are_linear_or_held_during_a_step(kind, exported, tmp_path: Path) -> None:
    """F = 10 t in steps of 0.5 s: a ramp by itself, stairs where it is held during a communication step."""
    path = tmp_path / "push.csv"
    path.write_text("time,F\n0,0\n2,20\n", encoding="utf-8")
    inputs = read_csv(path)
    settings = {"stop_time": 2.0, "step": 0.5, "tolerance": 1e-9, "inputs": inputs, "kind": kind}
    run = lag2fmu.simulate(exported("cart_pole"), **settings)
    stepped = lag2fmu.simulate(exported("cart_pole"), hold=True, **settings)
    steps = Trajectory.of([0.0, 0.5, 1.0, 1.5, 2.0], {"F": [0.0, 5.0, 10.0, 15.0, 20.0]})
    names = ["x", "theta", "x_dot", "theta_dot"]
    stairs = integrate(load("cart_pole"), run.time, inputs=held(steps)).trajectory
    ramp = integrate(load("cart_pole"), run.time, inputs=inputs).trajectory
    assert run.columns(names) == pytest.approx(ramp.columns(names), abs=1e-5)
    assert stepped.columns(names) == pytest.approx(stairs.columns(names), abs=1e-5)
    assert np.abs(run["x"] - stepped["x"]).max() > 0.5


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_kinks_between_communication_points_are_met(kind, exported) -> None:
    """A push of 0.02 s inside of one communication step of 1 s: F dt = (M + m) x_dot + m l theta_dot cos(theta)."""
    push = Trajectory.of([0.0, 0.3, 0.31, 0.32, 1.0], {"F": [0.0, 0.0, 100.0, 0.0, 0.0]})
    run = lag2fmu.simulate(exported("cart_pole"), stop_time=1.0, step=1.0, tolerance=1e-9, inputs=push, kind=kind)
    expected = integrate(load("cart_pole"), [0.0, 1.0], inputs=push).trajectory
    assert run["x_dot"][-1] == pytest.approx(expected["x_dot"][-1], abs=1e-6)
    assert abs(lag2fmu.simulate(exported("cart_pole"), stop_time=1.0, step=1.0)["x_dot"][-1] - run["x_dot"][-1]) > 0.1


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_motion_by_position_alone_gets_its_derivatives(kind, exported) -> None:
    """y0 = sin(5 t) / 10 at 121 points, against the direct integration with its exact derivatives."""
    times = np.linspace(0, 1.2, 121)
    inputs = Trajectory.of(times, {"y0": np.sin(5 * times) / 10})
    run = lag2fmu.simulate(
        exported("motion_driven_pendulum"), stop_time=1.2, step=0.1, tolerance=1e-9, inputs=inputs, kind=kind
    )
    exact = integrate(load("motion_driven_pendulum"), run.time, inputs={"y0": sp.sin(5 * TIME) / 10}).trajectory
    assert run["theta"] == pytest.approx(exact["theta"], abs=2e-6)


def test_inputs_in_every_form(exported, tmp_path: Path) -> None:
    times = np.linspace(0, 1, 11)
    push = np.cos(3 * times)
    trajectory = Trajectory.of(times, {"F": push})
    trajectory.write_csv(tmp_path / "push.csv")
    table = np.array(list(zip(times, push, strict=True)), dtype=[("time", float), ("F", float)])
    forms = [trajectory, tmp_path / "push.csv", str(tmp_path / "push.csv"), {"time": times, "F": push}, table]
    runs = [lag2fmu.simulate(exported("cart_pole"), stop_time=1.0, inputs=form) for form in forms]
    assert all((run.values == runs[0].values).all() for run in runs)
    function = lag2fmu.simulate(exported("cart_pole"), stop_time=1.0, inputs=lambda t: {"F": math.cos(3 * t)})
    exact = integrate(load("cart_pole"), function.time, inputs={"F": sp.cos(3 * TIME)}).trajectory
    assert function["x"] == pytest.approx(exact["x"], abs=1e-5)
    with pytest.raises(LoadError, match="no column 'time'; there are F"):
        lag2fmu.simulate(exported("cart_pole"), inputs={"F": push})
    with pytest.raises(LoadError, match="the inputs are a float; give a Trajectory"):
        lag2fmu.simulate(exported("cart_pole"), inputs=3.0)


def test_an_fmu_that_was_run_is_as_new(exported) -> None:
    """Other parameters, starts and inputs between leave nothing behind; so does a run that fails."""
    fmu = exported("cart_pole")
    first = lag2fmu.simulate(fmu, stop_time=1.0)
    push = Trajectory.of([0.0, 1.0], {"F": [0.0, 9.0]})
    values = {"m": 3.0, "theta": 0.2, "solver_step": 0.01}
    assert (lag2fmu.simulate(fmu, stop_time=1.0, values=values, inputs=push).values != first.values).any()
    assert (lag2fmu.simulate(fmu, stop_time=1.0).values == first.values).all()
    with pytest.raises(SimulationError):
        lag2fmu.simulate(fmu, stop_time=1.0, values={"m": 0.0, "M": 0.0})
    assert (lag2fmu.simulate(fmu, stop_time=1.0).values == first.values).all()


def test_nothing_is_left_to_be_cleaned_up_when_python_ends(exported) -> None:
    """Python warns of folders that it has to remove; with a library that is loaded Windows would keep them."""
    start = "import pathlib, sys; from lag2fmu.verify.instances import instance_of"
    program = f"{start}\nwith instance_of(pathlib.Path(sys.argv[1]), 'CoSimulation'): pass"
    command = [sys.executable, "-W", "error::ResourceWarning", "-c", program, str(exported("pendulum").path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_inputs_without_a_signal_keep_their_values_and_nothing_is_printed(kind, exported, capfd) -> None:
    inputs = Trajectory.of([0.0, 1.0], {"F": [1.0, 1.0]})
    run = lag2fmu.simulate(
        exported("cart_pole"), stop_time=1.0, tolerance=1e-9, inputs=inputs, values={"Q_theta": 0.2}, kind=kind
    )
    expected = integrate(load("cart_pole"), run.time, inputs={"F": 1.0, "Q_theta": 0.2}).trajectory
    assert run["theta"] == pytest.approx(expected["theta"], abs=1e-6)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_inputs_that_end_early_keep_their_last_value_and_it_is_said(kind, exported, caplog) -> None:
    inputs = Trajectory.of([0.0, 0.5], {"F": [0.0, 5.0]})
    run = lag2fmu.simulate(exported("cart_pole"), stop_time=1.0, step=0.25, tolerance=1e-9, inputs=inputs, kind=kind)
    expected = integrate(load("cart_pole"), run.time, inputs=inputs).trajectory
    assert run["x"] == pytest.approx(expected["x"], abs=1e-6)
    (sentence,) = caplog.messages
    assert sentence.endswith(
        "the inputs F end at 0.5 s and keep their last values until 1 s; give them to the end, or an earlier stop time"
    )


def test_inputs_that_begin_late_have_their_first_value_and_it_is_said(exported, caplog) -> None:
    inputs = Trajectory.of([0.5, 1.0], {"F": [2.0, 5.0]})
    run = lag2fmu.simulate(exported("cart_pole"), stop_time=1.0, step=0.25, tolerance=1e-9, inputs=inputs)
    whole = Trajectory.of([0.0, 0.5, 1.0], {"F": [2.0, 2.0, 5.0]})
    assert run["x"] == pytest.approx(integrate(load("cart_pole"), run.time, inputs=whole).trajectory["x"], abs=1e-6)
    (sentence,) = caplog.messages
    assert sentence.endswith("the inputs F begin at 0.5 s and have their first values before; give them from 0 s on")


def test_inputs_to_the_end_and_constants_are_not_remarked_upon(exported, caplog) -> None:
    for times in ([0.0], [0.0, 1.0], [0.0, 1.0 - 1e-12], [0.0, 2.0]):
        inputs = Trajectory.of(times, {"F": np.ones(len(times))})
        lag2fmu.simulate(exported("cart_pole"), stop_time=1.0, step=0.25, inputs=inputs)
    assert not caplog.messages


# ------------------------------------------------------------------------------------------------- warnings, errors


def test_one_step_may_be_a_rounding_longer_than_the_run(exported) -> None:
    run = simulate_fmu(exported("pendulum").path, Run(start_time=0.07, stop_time=0.08, step=0.01))
    assert run.time == pytest.approx([0.07, 0.08], abs=1e-15)


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_run_ends_at_the_stop_time_that_is_no_multiple_of_the_step(exported, kind) -> None:
    run = lag2fmu.simulate(
        exported("pendulum"), stop_time=1.03, step=0.05, tolerance=1e-9, outputs=["theta"], kind=kind
    )
    whole = lag2fmu.simulate(exported("pendulum"), stop_time=1.03, step=1.03, tolerance=1e-9, outputs=["theta"])
    assert run.time[-1] == pytest.approx(1.03, abs=1e-12)
    assert len(run) == 22
    assert run["theta"][-1] == pytest.approx(whole["theta"][-1], abs=1e-6)


def test_a_guess_that_was_set_and_is_moved_is_said(exported, caplog) -> None:
    run = lag2fmu.simulate(exported("four_bar_linkage"), stop_time=0.01, values={"b": 2.0, "a_dot": 3.0})
    assert run["a_dot"][0] == 3.0
    assert len(caplog.messages) == 1
    assert f"b from 2 to {run['b'][0]:.6g}; what the mechanism gives as 'start'" in caplog.messages[0]


def test_what_the_fmu_warns_of_is_said(exported, caplog) -> None:
    fmu = exported("spring_mass_damper")
    lag2fmu.simulate(fmu, stop_time=1.0, step=0.1)
    assert not caplog.messages
    lag2fmu.simulate(fmu, stop_time=1.0, step=0.1, values={"k": 1e6, "c": 1e4})
    (sentence,) = caplog.messages
    assert sentence.startswith("warning: 'spring_mass_damper.fmu': fmi2DoStep: the mechanism is stiff at time 0.")


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"outputs": ["thetta"]}, "no variable 'thetta'"),
        ({"outputs": "theta"}, r"'theta' is one text; give a list of names, such as \['theta'\]"),
        ({"values": {"l": "1"}}, "l = '1' is no number; give one in SI units"),
        ({"values": [("l", 1.0)]}, "is no mapping"),
        ({"stop_time": "5"}, "stop time '5' is no number; give it in s"),
        ({"values": {"thetta": 1.0}}, "no settable variable 'thetta'"),
        ({"values": {"p_theta": 1.0}}, "no settable variable 'p_theta'"),
        ({"values": {"theta": math.nan}}, "theta = nan is not finite"),
        ({"values": {"g": math.inf}}, "g = inf is not finite"),
        ({"values": {"solver_step": -1.0}}, "solver_step = -1.0 is below 0, the least"),
        ({"inputs": Trajectory.of([0.0, 1.0], {"F": [0.0, 1.0]})}, "no input 'F'"),
        ({"inputs": Trajectory.of([0.0, 1.0], {"theta": [0.0, 1.0]})}, "no input 'theta'"),
        ({"kind": "model exchange"}, "no simulation of kind 'model exchange'; expected 'co-simulation' or"),
        ({"stop_time": 0.0}, "stop time 0.0 s is not positive"),
        ({"stop_time": -1.0}, "stop time -1.0 s is not positive"),
        ({"stop_time": math.nan}, "stop time nan s is not positive"),
        ({"stop_time": math.inf}, "stop time inf s is not positive"),
        ({"step": 0.0}, "step 0.0 s is not positive"),
        ({"step": math.nan}, "step nan s is not positive"),
        ({"tolerance": 2.0}, "tolerance 2.0 is no relative tolerance; give one of at least 2e-15 and below 1"),
        ({"tolerance": math.nan}, "tolerance nan is no relative tolerance"),
        ({"step": 1e-12}, "steps of 1e-12 s in 10 s are too many"),
        ({"stop_time": 1e12}, "steps of 0.01 s in 1e\\+12 s are too many"),
        ({"inputs": Trajectory.of([0.0, 1.0], {})}, "no signal beside the time"),
        ({"stop_time": 1.0, "step": 2.0}, "step 2.0 s is longer than the stop time 1.0 s"),
    ],
)
def test_wrong_settings(settings: dict, sentence: str, exported) -> None:
    with pytest.raises(LoadError, match=sentence):
        lag2fmu.simulate(exported("pendulum"), **settings)


@pytest.mark.parametrize("stop_time", [0.0, -1.0, 1e12, math.nan, math.inf])
def test_a_validation_takes_no_other_stop_times(stop_time: float, exported) -> None:
    with pytest.raises(LoadError, match=r"is not positive and finite|are too many"):
        lag2fmu.validate(exported("pendulum"), stop_time=stop_time)


def test_a_model_is_not_exported_for_times_that_cannot_be(monkeypatch) -> None:
    monkeypatch.setattr("lag2fmu.verify.entry_points.as_fmu", None)
    with pytest.raises(LoadError, match=r"stop time 0\.0 s is not positive"):
        lag2fmu.simulate("pendulum", stop_time=0.0)
    with pytest.raises(LoadError, match=r"step -1\.0 s is not positive"):
        lag2fmu.simulate("pendulum", step=-1.0)


SINGULAR = """
[mechanism]
name = "singular"
[coordinates]
x = {}
[bodies]
block = { mass = 1, position = ["x", 0] }
[forces]
x = "1/(0.5 - t)**3"
"""


def test_a_failed_run_of_a_model_names_no_temporary_folder() -> None:
    with pytest.raises(SimulationError, match=r"^'singular\.fmu': the simulation failed: "):
        lag2fmu.simulate(read(SINGULAR, "singular.toml"), stop_time=1.0)


@pytest.mark.parametrize("given", [["y0", "y0_dot"], ["y0_ddot"], ["y0", "y0_ddot"]])
def test_a_motion_needs_its_derivatives(given: list[str], exported) -> None:
    missing = ", ".join(name for name in ("y0", "y0_dot", "y0_ddot") if name not in given)
    inputs = Trajectory.of([0.0, 1.0], {name: [0.0, 1.0] for name in given})
    with pytest.raises(LoadError, match=f"but not {missing}; a motion input needs all three columns"):
        lag2fmu.simulate(exported("motion_driven_pendulum"), inputs=inputs)


def test_values_of_inputs_that_are_not_finite() -> None:
    with pytest.raises(SimulationError, match=r"'F' is nan at time 1\.0 s"):
        Trajectory.of([0.0, 1.0], {"F": [0.0, math.nan]})


@pytest.mark.parametrize(("content", "sentence"), [(None, "there is no such file"), (b"text", "is no archive")])
def test_files_that_are_no_fmus(content: bytes | None, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "other.fmu"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(LoadError, match=sentence):
        lag2fmu.simulate(path)


def runaway() -> Mechanism:
    """x_ddot = 2 x^3 from x = 1, x_dot = 1: x = 1/(1 - t) is infinite at 1 s."""
    x = coordinate("x", start=1.0, velocity=1.0)
    return Mechanism("runaway", coordinates=[x], energy=Energy(kinetic=x.dot**2 / 2, potential=-(x**4) / 2))


def test_an_fmu_for_other_machines(exported, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere.fmu"
    with zipfile.ZipFile(exported("pendulum").path) as archive, zipfile.ZipFile(elsewhere, "w") as other:
        other.writestr("modelDescription.xml", archive.read("modelDescription.xml"))
        other.writestr("binaries/elsewhere/pendulum.so", b"")
    with pytest.raises(SimulationError, match=r"no library for this machine .*, only for elsewhere; compile"):
        lag2fmu.simulate(elsewhere)


def test_a_motion_that_ends_is_an_error_in_the_words_of_the_fmu(tmp_path: Path) -> None:
    fmu = export(runaway(), tmp_path / "runaway.fmu")
    with pytest.raises(SimulationError, match=r"(?s)runaway\.fmu.*fmi2DoStep: at time (1\.0|0\.99)\d* .*x"):
        lag2fmu.simulate(fmu, stop_time=2.0, step=0.1)
    before = lag2fmu.simulate(fmu, stop_time=0.9, step=0.1, tolerance=1e-9)
    assert before["x"] == pytest.approx(1 / (1 - before.time), rel=1e-6)
