"""Sweeps: what is run, what comes out, what is kept after an interruption, executors, FMUs, bad input."""

from __future__ import annotations

from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.mechanism import Body, Mechanism, Spring, coordinate, parameter
from lag2fmu.studies import engines
from lag2fmu.studies.design import Axis, axes_of, grid, sampled

xarray = pytest.importorskip("xarray", reason='the extra "sweeps" is not installed')
pytest.importorskip("h5netcdf", reason='the extra "sweeps" is not installed')
pytest.importorskip("pyarrow", reason='the extra "sweeps" is not installed')
pytestmark = [pytest.mark.fmu, pytest.mark.slow]


def oscillator() -> Mechanism:
    """m x'' + k x = 0 from x = 1: x = cos(sqrt(k/m) t)."""
    m, k = parameter("m", 1.0, "kg", minimum=0.1), parameter("k", 4.0, "N/m")
    x = coordinate("x", "m", start=1.0)
    return Mechanism(
        "swept",
        coordinates=[x],
        parameters=[m, k],
        bodies=[Body("block", m, (x, 0))],
        springs=[Spring("spring", stiffness=k, elongation=x)],
    )


K = np.linspace(1.0, 9.0, 5)
STARTS = np.array([[0.5, 1.0], [2.0, -1.0]])  # x, x_dot


def exact(k: Any, t: Any, x: Any = 1.0, v: Any = 0.0) -> Any:
    w = np.sqrt(k)
    return x * np.cos(w * t) + v / w * np.sin(w * t)


def test_a_grid_is_all_combinations(tmp_path: Path) -> None:
    """Two axes, one of them a table of two columns; the file is what was returned, with units."""
    path = tmp_path / "out.nc"
    found = lag2fmu.sweep(
        oscillator(), {"k": K, ("x", "x_dot"): STARTS}, outputs=["x"], times=[0.5, 3.0], tolerance=1e-10, path=path
    )
    assert found["x"].dims == ("k", "x_start_x_dot", "time")
    expected = exact(K[:, None, None], np.array([0.5, 3.0]), *(STARTS.T[:, None, :, None]))
    np.testing.assert_allclose(found["x"].values, expected, atol=1e-8)
    assert not found["failed"].any()
    with xarray.open_dataset(path) as read:
        xarray.testing.assert_identical(read.load(), found)
        assert (read["x"].attrs["units"], read["k"].attrs["units"]) == ("m", "N/m")
    assert not path.with_name("out.nc.parts").exists()


def test_a_sweep_that_cannot_begin_leaves_nothing(tmp_path: Path) -> None:
    for name, message in (("z", "there is no output 'z'"), ("m", "the output 'm' has no values .* it is a parameter")):
        with pytest.raises(LoadError, match=message):
            lag2fmu.sweep(oscillator(), {"k": K}, outputs=[name], at_end=True, path=tmp_path / "out.nc")
    assert not any(tmp_path.iterdir())


def test_a_sample_is_drawn_anew_with_its_seed(tmp_path: Path) -> None:
    vary = {"k": (1.0, 9.0), "x": [0.5, 2.0]}
    first, again, other = (
        lag2fmu.sweep(oscillator(), vary, sample=64, seed=seed, sampling="sobol", at_end=True, stop_time=2.0,
                      outputs=["x", "total_energy"], tolerance=1e-10, path=tmp_path / "out.parquet")
        for seed in (1, 1, 2)
    )  # fmt: skip
    xarray.testing.assert_identical(first, again)
    assert not np.array_equal(first["k"], other["k"])
    np.testing.assert_allclose(first["x"], exact(first["k"], 2.0, first["x_start"]), atol=1e-8)
    assert set(np.unique(first["x_start"])) == {0.5, 2.0}
    from pyarrow import parquet

    table = parquet.read_table(tmp_path / "out.parquet")
    assert table.num_rows == 64
    assert table.schema.field("x").metadata == {b"units": b"m"}
    np.testing.assert_array_equal(table["total_energy"].to_numpy(), other["total_energy"])


@pytest.mark.parametrize("sampling", ["random", "sobol", "halton", "latin"])
def test_samples_fill_their_ranges(sampling: str) -> None:
    axes = axes_of({"a": (2.0, 4.0), ("b", "c"): np.arange(8.0).reshape(4, 2)})
    design = sampled(axes, 256, sampling, seed=3)
    assert design.values.shape == (256, 3)
    a, b, c = design.values.T
    assert (a >= 2.0).all()
    assert (a <= 4.0).all()
    assert a.mean() == pytest.approx(3.0, abs=0.15)
    np.testing.assert_array_equal(c, b + 1)
    assert np.bincount((b / 2).astype(int), minlength=4).min() > 40


class Breaking(Executor):
    """Runs at once, and fails after ``good`` parts."""

    def __init__(self, good: int) -> None:
        self.good, self.runs = good, 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.runs == self.good:
            future.set_exception(OSError("the worker is gone"))
        else:
            self.runs += 1
            future.set_result(fn(*args, **kwargs))
        return future


def test_an_interrupted_sweep_goes_on_without_running_twice(tmp_path: Path) -> None:
    path = tmp_path / "out.nc"
    arguments: dict[str, Any] = {"outputs": ["x"], "at_end": True, "stop_time": 1.0, "path": path, "part": 2}
    first = Breaking(3)
    with pytest.raises(SimulationError, match="3 times: OSError: the worker is gone; what was done is kept"):
        lag2fmu.sweep(oscillator(), {"k": np.linspace(1, 9, 11)}, executor=first, **arguments)
    assert not path.exists()
    with pytest.raises(LoadError, match="parts of another sweep"):
        lag2fmu.sweep(oscillator(), {"k": np.linspace(1, 8, 11)}, **arguments)
    told: list[tuple[int, int]] = []
    second = Breaking(100)
    found = lag2fmu.sweep(
        oscillator(), {"k": np.linspace(1, 9, 11)}, executor=second, progress=lambda *now: told.append(now), **arguments
    )
    assert (first.runs, second.runs) == (3, 3)
    assert told[0] == (6, 11)
    assert told[-1] == (11, 11)
    np.testing.assert_allclose(found["x"], exact(found["k"], 1.0), atol=1e-4)


def test_failed_runs_keep_their_reason() -> None:
    found = lag2fmu.sweep("pendulum", {"l": [0.0, 1.0], "m": [1.0]}, at_end=True)
    assert found["failed"].values.ravel().tolist() == [True, False]
    assert "mass matrix" in str(found["reason"].values[0, 0])
    assert np.isnan(found["theta"].values[0, 0])
    found = lag2fmu.sweep(oscillator(), {"m": [0.05, 1.0]}, at_end=True)
    assert str(found["reason"].values[0]).startswith("m = 0.05 is out of its bounds, 0.1 to inf")
    found = lag2fmu.sweep(oscillator(), {"k": [np.nan, 1.0]}, at_end=True)
    assert found["reason"].values.tolist() == ["k = nan is no finite number", ""]


def test_threads_of_an_executor_give_the_same() -> None:
    vary = {"k": np.linspace(1, 9, 20)}
    with ThreadPoolExecutor(2) as pool:
        found = lag2fmu.sweep(oscillator(), vary, outputs=["x"], at_end=True, executor=pool, part=7)
    xarray.testing.assert_identical(found, lag2fmu.sweep(oscillator(), vary, outputs=["x"], at_end=True))


def test_an_fmu_is_swept_by_fmpy(exported: Any) -> None:
    fmu = exported("pendulum")
    vary = {"l": [0.8, 1.2], "theta": [0.1, 0.5, 1.0]}
    found = lag2fmu.sweep(fmu, vary, outputs=["theta"], times=[0.0, 0.7, 2.0], tolerance=1e-9)
    expected = lag2fmu.sweep("pendulum", vary, outputs=["theta"], times=[0.0, 0.7, 2.0], tolerance=1e-9)
    np.testing.assert_allclose(found["theta"], expected["theta"], atol=1e-5)  # between steps of 0.01 s fmpy's is linear
    with pytest.raises(LoadError, match="has no variable 'lx'"):
        lag2fmu.sweep(fmu, {"lx": [1.0]})


def test_the_command_line(tmp_path: Path) -> None:
    table, out = tmp_path / "starts.csv", tmp_path / "out.nc"
    table.write_text("theta [deg],theta_dot\n10,0\n20,1\n")
    arguments = ["--vary", "l=0.5:2:4", "--vary", f"theta=@{table}", "--vary", f"theta_dot=@{table}"]
    done = CliRunner().invoke(main, ["sweep", "pendulum", *arguments, "--at-end", "-o", str(out)])
    assert done.exit_code == 0, done.output
    assert "8 runs, 0 failed" in done.output
    with xarray.open_dataset(out) as found:
        np.testing.assert_allclose(found["theta_start"], np.radians([10, 20]))
    sample = ["--vary", "l=0.5:2", "--sample", "8", "--seed", "1", "--output", "total_energy"]
    done = CliRunner().invoke(main, ["sweep", "pendulum", *sample, "--at-end", "-o", str(out), "--force"])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(main, ["sweep", "pendulum", "--vary", "l=0,0", "--at-end", "-o", str(out), "--force"])
    assert done.exit_code == 2
    assert "all 2 runs failed; the first one: " in done.output
    for bad, said in (
        (["--vary", "l=1,2"], f"'{out}' exists; overwrite it with --force"),
        (["--force", "--vary", "l=0.5:2"], "only --sample takes A:B"),
        (["--force", "--vary", "l=0.5:2:x"], "'x' is no number of values"),
        (["--force", "--vary", "l=0.5:2:1000000000"], "1000000000 runs are asked for; give at most 10000000"),
        (["--force", "--vary", f"phi=@{table}"], "has no column 'phi'"),
        (["--force", "--vary", "q=1,2"], "'q' is no parameter, start or input of 'pendulum'"),
        (["--force", "--vary", "l=1", "--output", "nothing"], "nothing"),
    ):
        done = CliRunner().invoke(main, ["sweep", "pendulum", *bad, "-o", str(out)])
        assert done.exit_code == 2, done.output
        assert said in done.output


def test_a_missing_package_gets_the_line_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    with pytest.raises(LoadError, match=r'pip install "lag2fmu\[sweeps\]"'):
        lag2fmu.sweep("pendulum", {"l": [1.0]})


def test_bad_arguments_get_sentences() -> None:
    with pytest.raises(LoadError, match="has a range from 1 to 2 and no number of values"):
        grid(axes_of({"l": (1.0, 2.0)}))
    with pytest.raises(LoadError, match="varies twice"):
        axes_of({"l": [1.0], ("l", "g"): [[1.0, 2.0]]})
    with pytest.raises(LoadError, match="give \\(n,\\), or \\(n, k\\) for k names"):
        axes_of({("l", "g"): [1.0, 2.0]})
    with pytest.raises(LoadError, match="unknown sampling 'grid'"):
        sampled([Axis(("l",), None, 0.0, 1.0)], 4, "grid")
    with pytest.raises(LoadError, match="the seed of a sample is -1; give a whole number of at least 0"):
        sampled([Axis(("l",), None, 0.0, 1.0)], 4, seed=-1)
    with pytest.raises(LoadError, match="choose one of them"):
        lag2fmu.sweep("pendulum", {"l": [1.0]}, at_end=True, times=[1.0])
    with pytest.raises(LoadError, match="the tolerance 0 is no relative tolerance"):
        lag2fmu.sweep("pendulum", {"l": [1.0]}, tolerance=0)
    with pytest.raises(LoadError, match=r"such as \['theta'\]"):
        lag2fmu.sweep("pendulum", {"l": [1.0]}, outputs="theta")


@pytest.mark.toolchain
def test_a_dask_cluster_loses_a_worker_and_no_run(tmp_path: Path) -> None:
    """Three processes; one is killed when the first parts are done. Every part comes out once, and right."""
    import os
    import signal

    distributed = pytest.importorskip("distributed", reason='the extra "sweeps" is not installed')
    vary = {"k": np.linspace(1, 9, 600)}
    with (
        distributed.LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=":0") as cluster,
        distributed.Client(cluster) as client,
    ):
        pids = list(client.run(os.getpid).values())
        parts: list[int] = []

        def killing(done: int, total: int) -> None:
            parts.append(done)
            if len(parts) == 3:
                os.kill(pids[0], signal.SIGKILL)

        found = lag2fmu.sweep(
            oscillator(), vary, outputs=["x"], at_end=True, tolerance=1e-9, part=10, path=tmp_path / "out.nc",
            executor=client.get_executor(), progress=killing,
        )  # fmt: skip
        assert len(parts) == 61  # the beginning, and each part once
        assert pids[0] not in client.run(os.getpid).values()
    np.testing.assert_allclose(found["x"], exact(vary["k"], 10.0), atol=1e-5)
    assert engines.run_part.__module__ == "lag2fmu.studies.engines"
