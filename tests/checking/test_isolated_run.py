"""Running FMUs that are wrong in one way each: a finding, never a crash or a hang of the checker."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from by_hand import SOURCE, by_hand
from click.testing import CliRunner
from faults import files_of, spoiled, variable, written

from lag2fmu.checking import Findings, check_fmu, contents, isolated_run
from lag2fmu.checking.rulebooks import RULEBOOKS
from lag2fmu.cli import main
from lag2fmu.errors import SimulationError

pytestmark = pytest.mark.fmu

Make = Callable[[str], Path]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """``make(fault)``: the FMU with the macro ``fault`` defined ('' for the one that is right)."""

    def build(fault: str) -> Path:
        return by_hand(tmp_path / "faulty.fmu", f"#define {fault} 1\n{SOURCE}" if fault else SOURCE)

    return build


def only(monkeypatch: pytest.MonkeyPatch, *trials: str) -> None:
    """Ask for these trials of FMI 2.0 alone."""
    few = replace(RULEBOOKS["2"], trials=lambda kind: dict.fromkeys(trials))
    monkeypatch.setattr(contents, "rulebook_of", lambda document: few)


def rules(found: Findings) -> set[tuple[str, str]]:
    return {(f.rule, f.severity) for f in found.findings}


def test_the_fmu_that_is_right(make: Make) -> None:
    shares: list[float] = []
    assert check_fmu(make(""), progress=shares.append).findings == ()
    assert shares == sorted(shares)
    assert shares[0] >= 0.0  # how many shares are told depends on how often the machine looks
    assert shares[-1] == 1.0


FAULTS = {
    "OTHER_START": {("start-value", "error")},
    "NOT_A_NUMBER": {("value-finite", "error"), ("no-effect", "warning")},
    "HALF_RESET": {("reset", "error")},
    "HALF_STATE": {("state", "error"), ("serialize", "error")},
    "HALF_BLOCK": {("serialize", "error")},
    "DANGLING_STATE": {("state-free", "warning")},
    "WRONG_DERIVATIVE": {("directional", "error")},
    "OTHER_CATEGORY": {("log-category", "warning")},
    "PRINT": {("prints", "warning")},
    "MISSING_FUNCTION": {("binary-functions", "error")},
    "OTHER_FUNCTION": {("binary-exports", "warning")},
    "REFUSE": {("refused", "error")},
    "NO_INSTANCE": {("refused", "error")},
    "CRASH": {("crash", "error")},
    "EXIT": {("crash", "error")},
    "CRASH_ON_WRONG_REFERENCE": {("crash", "error")},
    "REALTIME_SIGNAL": {("crash", "error")},
    "MUCH_MEMORY": {("crash", "error")},
    "WRITE_EVERYWHERE": set(),
    "DELETE_ALL": {("environment", "error"), ("prints", "warning")},
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_a_library(fault: str, make: Make) -> None:
    assert rules(check_fmu(make(fault))) == FAULTS[fault]


def test_state_outside_of_the_instance(make: Make) -> None:
    """It shows in repeated runs; where it hides from these, in two instances at a time."""
    found = {rule for rule, _ in rules(check_fmu(make("SHARED_STATE")))}
    assert {"repeat", "instances"} <= found


def test_the_words_of_the_fmu_are_passed_on(make: Make) -> None:
    (finding,) = check_fmu(make("NO_INSTANCE")).findings
    assert "there is no licence" in finding.problem


def test_a_crash_does_not_hide_what_comes_later(make: Make) -> None:
    """The trial in which it crashes is named, and those after it are done."""
    (finding,) = check_fmu(make("CRASH_ON_WRONG_REFERENCE")).findings
    assert "reading a value reference that does not exist" in finding.problem
    (finding,) = check_fmu(make("CRASH")).findings
    assert "in the trial 'run'" in finding.problem


def test_a_hang_ends(make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "temporary"
    folder.mkdir()
    path = make("HANG")
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    begun = time.monotonic()
    (finding,) = check_fmu(path, time_limit=2.0).findings
    assert finding.rule == "hang"
    assert "does not come back within 2 s" in finding.problem
    assert "time limit" in finding.remedy
    assert time.monotonic() - begun < 75
    assert list(folder.iterdir()) == [], "nothing is left behind"


def test_the_time_limit_is_told_and_settable(make: Make) -> None:
    """By the verb: it ends long before the usual limit, and names the limit; what is no limit is a sentence."""
    path, begun = str(make("HANG")), time.monotonic()
    done = CliRunner().invoke(main, ["check", "--time-limit", "1", path])
    assert done.exit_code == 1
    assert "within 1 s" in done.output
    assert "of 1 s at most (--time-limit)" in " ".join(done.output.split())
    assert time.monotonic() - begun < isolated_run.TIME_LIMIT
    (default,) = [option.default for option in main.commands["check"].params if option.name == "time_limit"]
    assert default == isolated_run.TIME_LIMIT
    for limit in ("0", "-1", "nan", "inf"):
        refused = CliRunner().invoke(main, ["check", "--time-limit", limit, path])
        assert refused.exit_code == 2
        assert "give a positive number" in refused.output


def test_an_fmu_that_takes_everything(make: Make) -> None:
    """Warnings for what is forbidden, errors where the standard knows no doubt."""
    found = check_fmu(make("ACCEPT_ALL"))
    assert ("wrong-guid", "error") in rules(found)
    problems = {f.problem: f.severity for f in found.findings if f.rule == "illegal-call"}
    expected = {
        "reading a value reference that does not exist": "error",
        "setting a value reference that does not exist": "error",
        "a step back in time": "warning",
        "a step past the stop time": "warning",
        "a step before initialization": "warning",
        "terminating twice": "warning",
        "a serialized state that is none": "warning",
    }
    for what, severity in expected.items():
        assert problems[f"{what} is answered as if it were right"] == severity


def test_only_one_instance_in_a_process(make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What cannot be instantiated twice gets a new process for each trial, so that shared state stays alone."""

    def once(root) -> None:
        root.find("CoSimulation").set("canBeInstantiatedOnlyOncePerProcess", "true")

    only(monkeypatch, "run", "several instances", "FMU state")
    assert check_fmu(spoiled(make(""), tmp_path / "y.fmu", once)).findings == ()
    path = make("SHARED_STATE")
    assert {rule for rule, _ in rules(check_fmu(path))} == {"instances", "state"}
    assert {rule for rule, _ in rules(check_fmu(spoiled(path, tmp_path / "x.fmu", once)))} == {"state"}


def test_an_fmu_that_needs_a_tool(make: Make, tmp_path: Path) -> None:
    def tool(root) -> None:
        root.find("CoSimulation").set("needsExecutionTool", "true")

    found = check_fmu(spoiled(make("NO_INSTANCE"), tmp_path / "x.fmu", tool))
    assert rules(found) == {("execution-tool", "warning"), ("refused", "warning")}


def test_a_library_that_cannot_be_loaded(make: Make, tmp_path: Path) -> None:
    files = files_of(make(""))
    for name in files:
        if name.startswith("binaries/"):
            files[name] = files[name][: len(files[name]) // 2]
    found = check_fmu(written(files, tmp_path / "x.fmu"))
    assert {"load", "crash"} & {f.rule for f in found.findings}


def test_start_values_of_other_digits(make: Make, tmp_path: Path) -> None:
    """A value that was rounded on the way is a warning, another one an error."""
    for text, severity in (("2.0000000000000004", "warning"), ("2.1", "error")):
        path = spoiled(make(""), tmp_path / "x.fmu", lambda root, t=text: variable(root, "k")[0].set("start", t))
        (finding,) = check_fmu(path).findings
        assert (finding.rule, finding.severity) == ("start-value", severity)


def test_a_process_that_cannot_start_is_said(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    path = make("")
    monkeypatch.setattr(isolated_run, "_CHILD", "lag2fmu.absent")
    with pytest.raises(SimulationError, match=r"could not start.*No module named lag2fmu.absent"):
        check_fmu(path)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="processes are looked for in /proc")
@pytest.mark.parametrize("fault", ["LEAVE_PROCESS", "LEAVE_SESSION"])
def test_processes_that_it_leaves_are_ended(
    fault: str, make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    note = tmp_path / "process"
    monkeypatch.setenv("LAG2FMU_TEST_NOTE", str(note))
    only(monkeypatch, "run")
    assert check_fmu(make(fault)).findings == ()
    left = [Path("/proc", number, "status") for number in note.read_text("utf-8").split()]
    ends = time.monotonic() + 10
    assert left
    while alive := [p for p in left if p.exists() and "(zombie)" not in p.read_text("utf-8")]:
        assert time.monotonic() < ends, alive


OURS = [
    *["double_pendulum", "cart_pole", "motion_driven_pendulum", "heavy_top", "six_axis_arm"],
    *["bouncing_ball", "woodpecker", "gripper", "sliding_sphere", "heavy_top_quaternion", "dc_motor"],
]


@pytest.mark.parametrize("model", OURS)
def test_nothing_is_found_in_ours(model: str, exported) -> None:
    found = check_fmu(exported(model).path)
    assert found.findings == (), str(found)
    assert any("trials" in note for note in found.notes)


def test_nothing_is_found_with_all_outputs(exported) -> None:
    found = check_fmu(exported("cart_pole", outputs=("all",)).path)
    assert found.findings == (), str(found)
