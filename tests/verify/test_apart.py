"""FMUs that are no builds of ours run in a process of their own: a crash is a sentence, all else as in this one."""

from __future__ import annotations

import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from by_hand import SOURCE, by_hand
from click.testing import CliRunner

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.reference import Trajectory
from lag2fmu.verify import apart
from lag2fmu.verify.run import Run
from lag2fmu.verify.simulate import simulate_fmu

pytestmark = [pytest.mark.fmu, pytest.mark.skipif(not apart.FORKS, reason="no process is a fork of another one here")]

ENDS = """    (void)no_set;
    if (self->value[2] == -1.0) *(volatile int *)0 = 1;
    if (self->value[2] == -2.0) exit(3);
    if (self->value[2] == -3.0) exit(0);
    if (self->value[2] == -4.0) raise(35);
    if (self->value[2] == -5.0) return fmi2Error;
"""


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMU of another tool: x(t + h) = x + h (u + k) from 1; a negative k ends the first step in some way."""
    return by_hand(tmp_path_factory.mktemp("other") / "other.fmu", SOURCE.replace("    (void)no_set;\n", ENDS, 1))


def test_the_same_as_in_this_process(other: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same bits, and all that is told on the way."""
    assert apart.runs_apart(other)
    told: list[float] = []
    away = simulate_fmu(other, Run(values={"k": 0.3}, progress=told.append))
    monkeypatch.setattr(apart, "FORKS", False)
    near_told: list[float] = []
    near = simulate_fmu(other, Run(values={"k": 0.3}, progress=near_told.append))
    assert away.names == near.names
    np.testing.assert_array_equal(away.time, near.time)
    np.testing.assert_array_equal(away.values, near.values)
    assert told == near_told != []


def test_warnings_and_refusals_arrive(other: Path) -> None:
    warned: list[str] = []
    inputs = Trajectory(np.array([0.0, 1.0]), ("u",), np.array([[0.0], [1.0]]))
    simulate_fmu(other, Run(inputs=inputs, warned=warned.append))
    assert any("inputs" in sentence for sentence in warned)
    with pytest.raises(LoadError, match="K"):
        simulate_fmu(other, Run(values={"K": 1.0}))
    with pytest.raises(SimulationError, match="fmi2DoStep"):
        simulate_fmu(other, Run(values={"k": -5.0}))


@pytest.mark.parametrize(
    ("k", "how"),
    [
        (-1.0, r"it crashes \(SIG(SEGV|ILL|TRAP)\)"),
        (-2.0, "it ends the process with exit code 0x3"),
        (-3.0, "it ends the process"),
        (-4.0, r"it crashes \(signal 35\)"),
    ],
)
def test_a_crash_is_a_sentence(
    k: float, how: str, other: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(SimulationError, match=f"other.fmu': while it is simulated, {how}.*; 'lag2fmu check' tells"):
        lag2fmu.simulate(other, values={"k": k})
    assert list(tmp_path.iterdir()) == [], "nothing is left behind"
    assert lag2fmu.simulate(other).values[-1, 0] == pytest.approx(3.0)
    done = CliRunner().invoke(main, ["simulate", str(other), "--set", f"k={k}"])
    assert done.exit_code == 2
    assert "while it is simulated" in done.output


DAMAGED = {
    "cut": lambda data, share: data[: int(share * len(data))],
    "empty from there": lambda data, share: data[: int(share * len(data))].ljust(len(data), b"\0"),
    "breakpoints from there": lambda data, share: data[: int(share * len(data))].ljust(len(data), b"\xcc"),
}


@pytest.mark.parametrize("share", [0.02, 0.2, 0.5])
@pytest.mark.parametrize("how", DAMAGED)
def test_a_damaged_library_is_a_sentence(how: str, share: float, exported, other: Path, tmp_path: Path) -> None:
    """Of our own build, and of another tool; whatever is damaged, this process lives."""
    for whole in (exported("pendulum").path, other):
        path = tmp_path / whole.name
        with zipfile.ZipFile(whole) as archive, zipfile.ZipFile(path, "w") as damaged:
            for name in archive.namelist():
                data = archive.read(name)
                damaged.writestr(name, DAMAGED[how](data, share) if name.endswith(host_platform().suffix) else data)
        with pytest.raises(SimulationError, match=r"it crashes \(SIG|cannot be instantiated|it ends the process"):
            lag2fmu.simulate(path)


def test_our_builds_run_in_this_process_after_a_first_run(exported, other: Path) -> None:
    own = exported("cart_pole").path
    apart._proven.clear()
    for path in (own, other):
        assert apart.runs_apart(path)
        lag2fmu.simulate(path)
    assert not apart.runs_apart(own)
    assert apart.runs_apart(other)


def test_whoever_stops_waiting_leaves_no_process(other: Path) -> None:
    """An error in a listener comes through, and the process is ended."""
    import multiprocessing

    def stop(time: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate_fmu(other, Run(stop_time=1e4, progress=stop))
    assert multiprocessing.active_children() == []
