"""FMUs of FMI 3.0 against those of FMI 2.0, bit for bit, and against closed forms; events as an importer meets them."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Iterator
from ctypes import byref, c_double, c_int, c_size_t, c_uint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chosen import models
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model, FMU3Slave

import lag2fmu
from lag2fmu.checking.schema import problems
from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import load
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

pytestmark = pytest.mark.fmu

CRADLE = "newtons_cradle"
GRAVITY = 9.81


@pytest.fixture(scope="module")
def cradle(exported) -> Fmu:
    """The FMU of a hybrid mechanism with arrays."""
    return exported(CRADLE, fmi="3.0", arrays=True)


@pytest.fixture(scope="module")
def unpacked(cradle: Fmu, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Its files."""
    folder = Path(extract(str(cradle.path), str(tmp_path_factory.mktemp("unpacked"))))
    yield folder
    shutil.rmtree(folder, ignore_errors=True)


def instance(folder: Path, kind: type = FMU3Model, **arguments: Any) -> Any:
    """An instance of the unpacked FMU, initialized."""
    description = read_model_description(str(folder))
    unit = kind(
        guid=description.guid,
        unzipDirectory=str(folder),
        instanceName="unit",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )
    unit.instantiate(**arguments)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    return unit


def assert_same_runs(two: Fmu, three: Fmu, stop_time: float) -> None:
    """Co-simulation, with and without event mode, and model exchange give the bits that FMI 2.0 gives."""
    names = [v.name for v in two.description.variables if v.causality == "output"]
    for kind, with_events in (("co-simulation", (False, True)), ("model-exchange", (False,))):
        chosen = {"stop_time": stop_time, "outputs": names, "kind": kind}
        of_two = simulate_fmu(two.path, Run(**chosen))  # type: ignore[arg-type]
        assert np.isfinite(of_two.values).all()
        for events in with_events:
            of_three = simulate_fmu(three.path, Run(**chosen, events=events))  # type: ignore[arg-type]
            assert np.array_equal(of_two.time, of_three.time)
            assert np.array_equal(of_two.columns(names), of_three.columns(names)), (kind, events)


def test_event_mode_and_early_return_change_nothing(cradle: Fmu) -> None:
    """The first ball strikes the others at about 0.28 s."""
    runs = [simulate_fmu(cradle.path, Run(stop_time=0.6, events=events)) for events in (False, True)]
    assert np.array_equal(runs[0].values, runs[1].values)
    assert np.ptp(runs[0]["c"]) > 0.1


@pytest.mark.slow
def test_an_event_within_the_first_step_changes_nothing(exported) -> None:
    """The woodpecker, who amplifies differences, slides from 5e-5 s on; what is left of the step ends where it ends."""
    path = exported("woodpecker", fmi="3.0").path
    runs = [simulate_fmu(path, Run(stop_time=0.5, step=0.01, events=events)) for events in (False, True)]
    assert np.array_equal(runs[0].values, runs[1].values)


@pytest.mark.slow
def test_trajectories_with_arrays_are_those_of_fmi_2(cradle: Fmu, exported) -> None:
    assert_same_runs(exported(CRADLE), cradle, 0.6)


@pytest.mark.all_models
@pytest.mark.parametrize("model", models())
def test_trajectories_of_the_gallery_are_those_of_fmi_2(model: str, exported) -> None:
    """One model of each kind, with all variables as outputs, whose values are numbers in both."""
    two, three = (exported(model, outputs=("all",), fmi=fmi, optimised=False) for fmi in ("2.0", "3.0"))
    assert problems(three.path) == []
    assert_same_runs(two, three, min(1.0, load(model).experiment.stop_time))


def test_elements_of_arrays_are_set_and_read_by_their_names(cradle: Fmu) -> None:
    run = simulate_fmu(cradle.path, Run(stop_time=0.1, values={"b_dot": -0.25}, outputs=["a", "der_b", "der_a_dot"]))
    assert (run["a"][0], run["der_b"][0]) == (-0.6, -0.25)
    assert run["der_a_dot"][0] == pytest.approx(GRAVITY / 0.3 * np.sin(0.6), rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("arrays", [False, True], ids=["flat", "arrays"])
def test_inputs_go_on_within_steps(arrays: bool, exported) -> None:
    """FMI 2.0 has derivatives of inputs, an FMU of FMI 3.0 asks for values; elements without a signal keep theirs."""
    times = np.linspace(0.0, 1.0, 11)
    signals = {"time": times, "Q_x": np.sin(5 * times), "F": np.cos(3 * times)}
    fmus = exported("cart_pole"), exported("cart_pole", fmi="3.0", arrays=arrays)
    chosen: dict[str, Any] = {"stop_time": 1.0, "step": 0.05, "values": {"Q_theta": 0.5}}
    two, three = (lag2fmu.simulate(fmu, inputs=signals, **chosen) for fmu in fmus)
    assert three.columns(two.names) == pytest.approx(two.values, rel=1e-12, abs=1e-12)
    held = lag2fmu.simulate(fmus[1], inputs=signals, hold=True, **chosen)
    assert np.abs(held.columns(two.names) - two.values).max() > 1e-3


def test_dependencies_of_the_library_are_those_of_the_description(unpacked: Path) -> None:
    unit, description = instance(unpacked), read_model_description(str(unpacked))
    for unknown in (*description.outputs, *description.derivatives, *description.eventIndicators):
        reference, count = c_uint(unknown.variable.valueReference), c_size_t()
        unit.fmi3GetNumberOfVariableDependencies(unit.component, reference, byref(count))
        ours, theirs = ((c_size_t * count.value)() for _ in range(2))
        found, kinds = (c_uint * count.value)(), (c_int * count.value)()
        unit.fmi3GetVariableDependencies(unit.component, reference, ours, found, theirs, kinds, count)
        assert [*found] == [known.valueReference for known in unknown.dependencies]
    unit.freeInstance()


def test_what_is_not_listed_has_no_influence(unpacked: Path) -> None:
    """By directional derivatives of all unknowns along each known, at a point where nothing is zero by chance."""
    unit, description = instance(unpacked), read_model_description(str(unpacked))
    unit.updateDiscreteStates()
    unit.enterContinuousTimeMode()
    n = description.numberOfContinuousStates
    x = (c_double * n)()
    unit.getContinuousStates(x, n)
    x[:] = [value - 0.1 * (i + 1) for i, value in enumerate(x)]
    unit.setContinuousStates(x, n)
    unknowns = [*description.outputs, *description.derivatives]
    sizes = [int(np.prod(u.variable.shape)) for u in unknowns]
    settings = ("solver_tolerance", "solver_step", "solver_max_step")
    knowns = [v for v in description.modelVariables if v.causality in ("input", "parameter") and v.name not in settings]
    knowns += [d.variable.derivative for d in description.derivatives]
    for known in knowns:
        listed = [known in unknown.dependencies for unknown in unknowns]
        for seed in np.eye(int(np.prod(known.shape))):
            references = [u.variable.valueReference for u in unknowns]
            found = unit.getDirectionalDerivative(references, [known.valueReference], seed, sum(sizes))
            parts = np.split(np.array(found), np.cumsum(sizes)[:-1])
            assert all(is_listed or not part.any() for is_listed, part in zip(listed, parts, strict=True)), known.name
    unit.freeInstance()


def test_the_derivative_of_a_state_cannot_be_set(unpacked: Path) -> None:
    """Its value is that of the velocity, which can be."""
    description = read_model_description(str(unpacked))
    references = {v.name: v.valueReference for v in description.modelVariables}
    unit = FMU3Slave(
        guid=description.guid,
        unzipDirectory=str(unpacked),
        instanceName="unit",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )
    unit.instantiate()
    size = len(load(CRADLE).coordinates)
    unit.setFloat64([references["qd"]], [0.5] * size)
    assert unit.getFloat64([references["der_q"]], size) == [0.5] * size
    with pytest.raises(FMICallException):
        unit.setFloat64([references["der_q"]], [0.5] * size)
    unit.freeInstance()


@pytest.mark.slow
def test_steps_end_at_impacts_and_clocks_tick_there(exported, tmp_path: Path) -> None:
    """A ball that falls from 1 m meets the floor at sqrt(2/g), and again 2 e sqrt(2/g) later."""
    folder = Path(extract(str(exported("bouncing_ball", fmi="3.0").path), str(tmp_path)))
    references = {v.name: v.valueReference for v in read_model_description(str(folder)).modelVariables}
    unit = instance(folder, FMU3Slave, eventModeUsed=True, earlyReturnAllowed=True)
    unit.updateDiscreteStates()
    unit.enterStepMode()
    met, t = [], 0.0
    while t < 1.4:
        event, _, early, t = unit.doStep(t, 1.4 - t)
        assert early == event or t == 1.4
        if event:
            unit.enterEventMode()
            assert unit.getClock([references["floor_impact"]]) == [False]
            again, *_ = unit.updateDiscreteStates()
            assert (again, unit.getClock([references["floor_impact"]])) == (True, [True])
            assert unit.getInt32([references["floor_impacts"]]) == [len(met) + 1]
            again, *_ = unit.updateDiscreteStates()
            assert (again, unit.getClock([references["floor_impact"]])) == (False, [False])
            unit.enterStepMode()
            met.append(t)
    unit.freeInstance()
    falling = (2.0 / GRAVITY) ** 0.5
    assert met == pytest.approx([falling, falling * (1 + 2 * 0.8)], abs=1e-12)


def test_the_archive_is_laid_out_as_the_standard_says(cradle: Fmu) -> None:
    with zipfile.ZipFile(cradle.path) as archive:
        names = archive.namelist()
    folders = {name.split("/")[0] for name in names if "/" in name}
    assert folders == {"binaries", "documentation", "extra", "sources", "terminalsAndIcons"}
    assert [name for name in names if "/" not in name] == ["modelDescription.xml"]
    assert "terminalsAndIcons/icon.png" in names
    assert {name.split("/")[1] for name in names if name.startswith("binaries/")} <= {
        *("x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin")
    }


@pytest.mark.slow
def test_clocks_can_be_left_out(exported, tmp_path: Path) -> None:
    """For importers that do not know them: no variable of type Clock, a clean check, and the same bits."""
    path = tmp_path / "ball.fmu"
    lag2fmu.export("bouncing_ball", path, fmi="3.0", without=["clocks"], page="static")
    found = read_model_description(path)
    assert "Clock" not in {v.type for v in found.modelVariables}
    assert "Clock" not in zipfile.ZipFile(path).read("modelDescription.xml").decode()
    assert problems(path) == []
    for events in (False, True):
        options = Run(stop_time=1.5, step=0.1, outputs=["y", "floor_impacts"], events=events)
        ours = simulate_fmu(path, options)
        with_clocks = simulate_fmu(exported("bouncing_ball", fmi="3.0", optimised=True).path, options)
        assert np.array_equal(ours.values, with_clocks.values)
        assert ours["floor_impacts"][-1] >= 2
