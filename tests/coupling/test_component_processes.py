"""Each FMU of a system in a process of its own: the same run, and the loss of a process keeps the motion."""

from __future__ import annotations

import os
import re
import signal
import sys
import tempfile
import threading
import time
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


FAILS = """    (void)no_set;
    if (self->value[2] == -1.0 && time > 0.45) *(volatile int *)0 = 1;
    if (self->value[2] == -5.0 && time > 0.45) return fmi2Error;
    while (self->value[2] == -7.0 && time > 0.45) *(volatile double *)&time += 0.0;
"""


@pytest.mark.parametrize(
    ("k", "message"),
    [
        (-1.0, "the component 'b', in the step from t = 0.5 s: the process of the FMU is lost: it crashes (SIGSEGV)"),
        (-5.0, "the component 'b', in the step from t = 0.5 s: "),
    ],
)
@pytest.mark.skipif(sys.platform == "win32", reason="processes have no signals there")
def test_a_crash_keeps_the_motion(k: float, message: str, tmp_path) -> None:
    other = by_hand(tmp_path / "other.fmu", SOURCE.replace("    (void)no_set;\n", FAILS, 1))
    path = lag2fmu.ssp({"a": other, "b": other}, tmp_path / "s.ssp", values={"b.k": k})
    with pytest.raises(SimulationError, match=re.escape(message)) as caught:
        lag2fmu.simulate(path, stop_time=1.0, step=0.1, apart=True)
    assert caught.value.reached.time == pytest.approx(np.arange(0, 0.55, 0.1))
    assert "what was recorded until t = 0.5 s is kept" in str(caught.value)
    words = ["simulate", str(path), "--stop-time", "1", "--step", "0.1", "--apart", "-o", str(tmp_path / "o.csv")]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 2
    assert len((tmp_path / "o.csv").read_text("utf-8").splitlines()) == 7


def test_a_call_that_takes_too_long_ends_the_process(tmp_path, monkeypatch) -> None:
    """The FMU hangs for good: its name, the time, and what was recorded until then."""
    other = by_hand(tmp_path / "other.fmu", SOURCE.replace("    (void)no_set;\n", FAILS, 1))
    path = lag2fmu.ssp({"a": other, "b": other}, tmp_path / "s.ssp", values={"b.k": -7.0})
    (tmp_path / "t").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "t"))
    message = "the component 'b', in the step from t = 0.5 s: the FMU does not come back from a call within 0.5 s"
    with pytest.raises(SimulationError, match=re.escape(message)) as caught:
        lag2fmu.simulate(path, stop_time=1.0, step=0.1, apart=0.5)
    assert caught.value.reached.time == pytest.approx(np.arange(0, 0.55, 0.1))
    assert not [*(tmp_path / "t").iterdir()]
    if sys.platform == "linux":
        assert children(os.getpid()) == []


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
            found = children(os.getpid())[:-1]  # the last one is the process of the run
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
        assert children(os.getpid()) == []
        assert [*tmp_path.iterdir()] == []
