"""FMUs of a system on the workers of an executor: the same run, and what is lost is told and leaves nothing."""

from __future__ import annotations

import os
import re
import signal
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from train import CAR, WAGON_ALONE

import lag2fmu
from lag2fmu.errors import SimulationError
from lag2fmu.systems import fmu_worker

pytestmark = pytest.mark.fmu

CONNECT = ("wagon.x:cart.y", "cart.f:wagon.F")
VALUES = {f"wagon.{name}": value for name, value in WAGON_ALONE.items()}
CHOSEN = {"connect": CONNECT, "values": VALUES, "stop_time": 0.2}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of temporary files, in which nothing is left."""
    folder = tmp_path / "t"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    yield folder
    assert not [*folder.iterdir()]


@pytest.mark.parametrize("executor", [ProcessPoolExecutor, ThreadPoolExecutor])
@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_the_run_is_the_same_to_the_bit(fmi: str, executor: type, exported, place: Path) -> None:
    """Also inputs that an FMU of FMI 3.0 asks for within a step. Workers are free again for the second run."""
    car = exported(CAR, fmi=fmi)
    with executor(2) as workers:
        runs = [lag2fmu.simulate({"cart": car, "wagon": car}, apart=x, **CHOSEN) for x in (False, workers, workers)]
    for run in runs[1:]:
        assert np.array_equal(runs[0].values, run.values)
        assert runs[0].coupling == run.coupling


@pytest.mark.toolchain
def test_a_cluster_of_dask(exported, tmp_path: Path) -> None:
    """Its workers are daemons. Components run there, and whole systems as tasks of a sweep."""
    distributed = pytest.importorskip("distributed", reason='the extra "sweeps" is not installed')
    car, path = exported(CAR), tmp_path / "train.ssp"
    lag2fmu.ssp({"cart": car, "wagon": car}, path, connect=CONNECT, values=VALUES)
    here = lag2fmu.simulate(path, stop_time=0.2)
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster,
        distributed.Client(cluster) as client,
    ):
        executor = client.get_executor()
        assert np.array_equal(lag2fmu.simulate(path, stop_time=0.2, apart=executor).values, here.values)
        found = lag2fmu.sweep(path, {"wagon.m": [2.0, 3.0]}, stop_time=0.2, at_end=True, executor=executor)
    assert found["cart.x"].values[0] == pytest.approx(here["cart.x"][-1], rel=1e-6)
    assert not found["failed"].values.any()


def hosts(executor: ProcessPoolExecutor) -> list[tuple[int, int]]:
    """(worker, process of an FMU on it) of all."""
    found = []
    for worker in executor._processes:
        for task in Path(f"/proc/{worker}/task").iterdir():
            found += [(worker, int(x)) for x in (task / "children").read_text("utf-8").split()]
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="/proc tells of processes")
@pytest.mark.parametrize(("victim", "how"), [(0, "its worker ends"), (1, "it crashes (SIGKILL)")])
def test_what_is_killed(victim: int, how: str, exported, place: Path) -> None:
    """A worker, or the process of an FMU on it: the component and the last good time are told, and nothing is left."""
    car, reached = exported(CAR), threading.Event()
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as executor:

        def kill() -> None:
            reached.wait(20.0)
            os.kill(hosts(executor)[0][victim], signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        with pytest.raises(SimulationError, match=f"component '(cart|wagon)', .* is lost: {re.escape(how)}") as caught:
            lag2fmu.simulate(
                {"cart": car, "wagon": car}, connect=CONNECT, values=VALUES, stop_time=1000.0, step=0.01,
                apart=executor, progress=lambda t: reached.set() if t > 0 else None,
            )  # fmt: skip
        killer.join()
        last = float(caught.value.reached.time[-1])
        assert f"until t = {last:g} s is kept" in str(caught.value)
        ended = time.monotonic() + 5.0
        while hosts_left(str(place)) and time.monotonic() < ended:
            time.sleep(0.01)
        assert not hosts_left(str(place))


def hosts_left(place: str) -> list[str]:
    """The processes that have libraries of a folder open."""
    found = []
    for maps in Path("/proc").glob("[0-9]*/maps"):
        try:
            found += [str(maps)] if place in maps.read_text("utf-8") else []
        except OSError:  # it has ended
            continue
    return found


def test_too_few_workers(exported, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fmu_worker, "_QUEUE", 1.0)
    car = exported(CAR)
    message = "the component 'wagon': no worker of the executor has taken the FMU in 1 s; each FMU .* a free worker"
    with ThreadPoolExecutor(1) as executor, pytest.raises(SimulationError, match=message):
        lag2fmu.simulate({"cart": car, "wagon": car}, apart=executor, **CHOSEN)


def test_an_executor_that_is_shut_down(exported) -> None:
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    with pytest.raises(SimulationError, match="the component 'cart': the executor takes no FMU: cannot schedule new"):
        lag2fmu.simulate({"cart": exported(CAR)}, apart=executor, stop_time=0.1)


def test_an_fmu_that_no_worker_can_load(exported, place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the worker says is told by the name of the component."""
    monkeypatch.setattr("lag2fmu.verify.instances._refuse_without_library", _refuse)
    with (
        ProcessPoolExecutor(1, mp_context=get_context("fork")) as executor,
        pytest.raises(SimulationError, match=r"the component 'cart': .* has no library for this machine"),
    ):
        lag2fmu.simulate({"cart": exported(CAR)}, apart=executor, stop_time=0.1)


def _refuse(path: Path, description: object) -> None:
    raise SimulationError(f"'{path}': has no library for this machine")


class _Strange(Executor):
    """An executor that leaves its tasks to others who connect, and do not know the key, or say nothing."""

    def submit(self, function, addresses, *args) -> Future:  # type: ignore[no-untyped-def,override]
        self.callers = [socket.create_connection(addresses[0]) for _ in range(2)]
        self.callers[0].sendall(bytes(64))
        return Future()


def test_who_does_not_know_the_key_is_nobody(exported, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fmu_worker, "_QUEUE", 0.5)
    monkeypatch.setattr(fmu_worker, "PATIENCE", 0.3)
    executor = _Strange()
    with pytest.raises(SimulationError, match="no worker of the executor has taken the FMU"):
        lag2fmu.simulate({"cart": exported(CAR)}, apart=executor, stop_time=0.1)
    for caller in executor.callers:
        caller.close()
