"""Each FMU of a system in a process of its own: the same run, and the loss of a process keeps the motion."""

from __future__ import annotations

import os
import re
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from by_hand import SOURCE, by_hand
from click.testing import CliRunner
from train import CAR, WAGON_ALONE

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import SimulationError
from lag2fmu.systems.controller import Controller
from lag2fmu.systems.fmu_process import Apart

pytestmark = pytest.mark.fmu

CONNECT = ("wagon.x:cart.y", "cart.f:wagon.F")
VALUES = {f"wagon.{name}": value for name, value in WAGON_ALONE.items()}


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
@pytest.mark.parametrize("chosen", [{}, {"step": 0.01}, {"step": 0.01, "hold": True}], ids=str)
def test_the_run_is_the_same_to_the_bit(fmi: str, chosen: dict, exported) -> None:
    """States, derivatives, and inputs for which an FMU of FMI 3.0 asks within a step, go to and fro."""
    car = exported(CAR, fmi=fmi)
    runs = [
        lag2fmu.simulate(
            {"cart": car, "wagon": car}, connect=CONNECT, values=VALUES, stop_time=0.2, apart=apart, **chosen
        )
        for apart in (False, True)
    ]
    assert np.array_equal(runs[0].values, runs[1].values)
    assert runs[0].coupling == runs[1].coupling


_LATE = "if (((Instance *)c)->time > 0.45) "
FAULTS = {
    "hangs": ("fmi2Status fmi2DoStep", _LATE + "for (volatile int i = 0;; i = !i) {}"),
    "starts others and hangs": ("fmi2Status fmi2DoStep", _LATE + "if (fork() >= 0) for (;;) pause();"),
    "crashes": ("fmi2Status fmi2DoStep", _LATE + "*(volatile int *)0 = 1;"),
    "ends": ("fmi2Status fmi2DoStep", _LATE + "exit(3);"),
    "fatal": ("fmi2Status fmi2DoStep", _LATE + "return fmi2Fatal;"),
    "discards": ("fmi2Status fmi2DoStep", _LATE + "return fmi2Discard;"),
    "discards long steps": ("fmi2Status fmi2DoStep", _LATE + "if (h > 2e-3) return fmi2Discard;"),
    "tells nothing": ("fmi2Status fmi2GetReal", _LATE + "return fmi2Error;"),
    "hangs at once": ("fmi2Component fmi2Instantiate", "for (volatile int i = 0;; i = !i) {}"),
    "hangs before": ("fmi2Status fmi2SetupExperiment", "for (volatile int i = 0;; i = !i) {}"),
    "crashes behind": ("void fmi2FreeInstance", "*(volatile int *)0 = 1;"),
    "hangs behind": ("void fmi2FreeInstance", "for (volatile int i = 0;; i = !i) {}"),
}
"""{what an FMU does: (function of FMI, what it begins with)}"""
ENDED = "the FMU does not come back from a call within 1 s and is ended"
STEP = "the component 'b', in the step from t = 0.5 s: "


def faulty(folder: Path, fault: str) -> Path:
    """An FMU written by hand that does what FAULTS say."""
    function, line = FAULTS[fault]
    before, rest = SOURCE.split(f"EXPORT {function}(", 1)
    head, body = rest.split("{", 1)
    return by_hand(folder / "faulty.fmu", f"{before}EXPORT {function}({head}{{\n    {line}\n{body}")


@pytest.fixture
def alone(tmp_path, monkeypatch) -> Iterator[None]:
    """No file and no process is left by the test, those neither that FMUs have started."""
    (tmp_path / "t").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "t"))
    others = children(os.getpid()) if sys.platform == "linux" else []
    yield
    assert not [*(tmp_path / "t").iterdir()]
    if sys.platform == "linux":
        assert [child for child in children(os.getpid()) if child not in others] == []
        assert running(str(tmp_path)) == []


def running(place: str) -> list[str]:
    """The processes that have files in a folder open as libraries."""
    found = []
    for maps in Path("/proc").glob("[0-9]*/maps"):
        with suppress(OSError):
            found += [str(maps)] if place in maps.read_text("utf-8") else []
    return found


@pytest.mark.parametrize(
    ("fault", "apart", "message", "until"),
    [
        ("hangs", 1.0, STEP + ENDED, 0.5),
        ("starts others and hangs", 1.0, STEP + ENDED, 0.5),
        ("crashes", 60.0, STEP + "the process of the FMU is lost: it crashes (SIGSEGV)", 0.5),
        ("crashes", False, "while the component 'b' is simulated, it crashes (SIGSEGV)", 0.5),
        ("ends", True, STEP + "the process of the FMU is lost: it ends the process with exit code 0x3", 0.5),
        ("ends", False, "while the component 'b' is simulated, it ends the process with exit code 0x3", 0.5),
        ("fatal", False, STEP + "fmi2DoStep failed with status 4 (fatal)", 0.5),
        ("fatal", True, STEP + "fmi2DoStep failed with status 4 (fatal)", 0.5),
        ("discards", True, "status 2 (discard); the FMU gave no reason; it may make a shorter --step", 0.5),
        ("tells nothing", False, "the component 'b', called by getReal: fmi2GetReal failed with status 3", 0.4),
        ("hangs at once", 1.0, "the component 'b': " + ENDED, None),
        ("hangs before", 1.0, "the component 'b', while it is initialized: " + ENDED, None),
        ("crashes behind", False, "while the component 'b' is simulated, it crashes (SIGSEGV)", 1.0),
    ],
    ids=lambda value: str(value) if value in FAULTS or not isinstance(value, str) else "said",
)
@pytest.mark.skipif(sys.platform != "linux", reason="processes have other signals, or none, there")
def test_a_component_that_fails(fault: str, apart: Apart, message: str, until: float | None, tmp_path, alone) -> None:
    """A sentence with its name, what was recorded until then, and nothing else."""
    parts = {"a": by_hand(tmp_path / "good.fmu"), "b": faulty(tmp_path, fault)}
    with pytest.raises(SimulationError, match=re.escape(message)) as caught:
        lag2fmu.simulate(parts, connect=["a.x:b.u"], stop_time=1.0, step=0.1, apart=apart)
    if until is None:
        assert caught.value.reached is None
    else:
        found = caught.value.reached
        assert found.time == pytest.approx(np.arange(0, until + 0.05, 0.1))
        assert found["a.x"] == pytest.approx(1.0 + 2.0 * found.time)
        assert f"what was recorded until t = {until:g} s is kept" in str(caught.value)


@pytest.mark.parametrize("fault", ["crashes behind", "hangs behind"])
def test_an_end_that_fails_costs_nothing(fault: str, tmp_path, alone) -> None:
    """An FMU with a process of its own that fails when it is freed."""
    parts = {"a": by_hand(tmp_path / "good.fmu"), "b": faulty(tmp_path, fault)}
    run = lag2fmu.simulate(parts, stop_time=1.0, step=0.1, apart=1.0)
    assert run["b.x"] == pytest.approx(1.0 + 2.0 * run.time)


@pytest.mark.parametrize("apart", [False, True])
def test_a_step_that_is_discarded_is_made_shorter(apart: Apart, tmp_path, exported) -> None:
    """Under error control: from 0.45 s on the FMU makes steps of 2 ms at most, and its state is that of all steps."""
    parts = {"a": faulty(tmp_path, "discards long steps"), "b": exported(CAR)}
    run = lag2fmu.simulate(parts, connect=["a.x:b.y"], stop_time=1.0, apart=apart)
    assert run["a.x"] == pytest.approx(1.0 + 2.0 * run.time)
    assert run.coupling.shortest <= 2e-3 < run.coupling.longest
    assert run.coupling.repeated > 0


def test_what_a_crash_leaves_is_written(tmp_path) -> None:
    """The command line writes the rows until then, and ends with 2."""
    words = ["simulate", f"a={by_hand(tmp_path / 'good.fmu')}", f"b={faulty(tmp_path, 'crashes')}"]
    out = tmp_path / "o.csv"
    done = CliRunner().invoke(main, [*words, "--stop-time", "1", "--step", "0.1", "-o", str(out)])
    assert done.exit_code == 2
    assert len(out.read_text("utf-8").splitlines()) == 7


@pytest.mark.parametrize("patience", ["0", "-1", "nan", "inf"])
def test_a_patience_that_is_none(patience: str, exported) -> None:
    words = ["simulate", f"a={exported(CAR).path}", f"b={exported(CAR).path}", "--patience", patience]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 2
    assert "give a positive time" in done.output


LOST = re.compile(r"the component '(cart|wagon|third)', .* the process of the FMU is lost: it crashes \(SIGKILL\)")


def children(of: int) -> list[int]:
    """The processes that descend from one, the deepest first."""
    found = []
    for text in Path(f"/proc/{of}/task/{of}/children").read_text("utf-8").split():
        found += [*children(int(text)), int(text)]
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="/proc tells of processes")
def test_processes_killed_at_random(exported, tmp_path, monkeypatch) -> None:
    """Twenty times one of three FMUs is killed at some time: the run ends by its name, and nothing is left."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    car, random = exported(CAR), np.random.default_rng(1)
    others = children(os.getpid())

    def slow(t: float, inputs: dict[str, float]) -> dict[str, float]:
        time.sleep(1e-3)
        return {"F": 0.0}

    parts = {"cart": car, "wagon": car, "third": car, "slow": Controller(slow, 0.001)}
    connect = [*CONNECT, "slow.F:third.F"]
    for _ in range(20):
        reached, killed = threading.Event(), []
        share = float(random.uniform(0.0, 0.1))

        def kill(share: float = share, reached: threading.Event = reached, killed: list = killed) -> None:
            reached.wait(20.0)
            time.sleep(share)
            own = [child for child in children(os.getpid()) if child not in others]
            found = own[:-1]  # the last one is the process of the run
            killed.append(found[int(random.integers(len(found)))])
            os.kill(killed[0], signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        with pytest.raises(SimulationError, match=LOST) as caught:
            lag2fmu.simulate(
                parts, connect=connect, values=VALUES, stop_time=2.0, step=0.002, apart=True,
                progress=lambda t, reached=reached: reached.set() if t > 0 else None,
            )  # fmt: skip
        killer.join()
        last = float(caught.value.reached.time[-1])
        assert 0 < last < 2.0
        assert f"until t = {last:g} s is kept" in str(caught.value)
        assert [child for child in children(os.getpid()) if child not in others] == []
        assert [*tmp_path.iterdir()] == []
