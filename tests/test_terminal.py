"""What a terminal gets, completion, formulas in Unicode, bars with the time left; and what a pipe gets."""

from __future__ import annotations

import io
import sys
import time
from multiprocessing import get_context

import pytest
from click.testing import CliRunner
from rich.console import Console

from lag2fmu import progress
from lag2fmu.cli import main
from lag2fmu.cli.terminal import console, knows_unicode
from lag2fmu.formats.loading import load
from lag2fmu.language.vocabulary import symbol
from lag2fmu.procedure.drawn import drawn
from lag2fmu.procedure.steps import procedure
from lag2fmu.progress import QUIET, progress_bar, reached, telling
from lag2fmu.verify.report import Check, Report


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    encoding = "UTF-8"

    def isatty(self) -> bool:
        return True


@pytest.fixture(autouse=True)
def shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """Progress is shown, which other tests switch off."""
    monkeypatch.delenv(QUIET, raising=False)


def completed(words: str, shell: str = "bash") -> list[str]:
    """What the shell offers for the last of ``words``, by click's protocol."""
    asked = {
        "COMP_WORDS": words,
        "COMP_CWORD": words.rsplit(" ", maxsplit=1)[-1] if shell == "fish" else str(words.count(" ")),
    }
    done = CliRunner().invoke(main, env={"_LAG2FMU_COMPLETE": f"{shell}_complete", **asked}, prog_name="lag2fmu")
    return done.output.splitlines()


def test_verbs_are_completed_in_each_shell() -> None:
    assert completed("lag2fmu simu") == ["plain,simulate"]
    assert completed("lag2fmu simu", "zsh")[:2] == ["plain", "simulate"]
    assert completed("lag2fmu simu", "fish")[0].startswith("plain")
    assert "simulate" in "\n".join(completed("lag2fmu simu", "fish"))


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell_names_the_program(shell: str) -> None:
    done = CliRunner().invoke(main, env={"_LAG2FMU_COMPLETE": f"{shell}_source"}, prog_name="lag2fmu")
    if shell == "bash" and not done.output:
        pytest.skip("there is no bash to ask for its version")
    assert f"_LAG2FMU_COMPLETE={shell}_complete" in done.output


def test_models_solvers_and_options_are_completed() -> None:
    assert set(completed("lag2fmu export double_")) >= {"plain,double_pendulum", "plain,double_atwood", "file,double_"}
    assert completed("lag2fmu export pendulum --solver rad") == ["plain,radau5"]
    assert "plain,--animate" in completed("lag2fmu simulate pendulum --")
    assert completed("lag2fmu show pendulum --format u") == ["plain,unicode"]


def test_formulas_have_fractions_and_dots() -> None:
    notation = drawn(100)
    m, length, rate = (symbol(name) for name in ("m", "l", "theta1_ddot"))
    text = notation.formula(notation.name("T"), notation.expression(m * length**2 * rate / 2))
    assert text.splitlines() == ["           2", "          l ⋅m⋅θ̈₁", "      T = ───────", "             2"]
    assert notation.name("Q^np_x") == "Qⁿᵖ_x"
    assert notation.name("lower_x_dot") == "lower_x_dot"


def test_a_formula_that_is_too_wide_stays_a_line_of_text() -> None:
    notation = drawn(12)
    text = notation.formula(notation.name("x_dot"), notation.expression(symbol("l") ** 2 / symbol("theta_dot")))
    assert text == "      x_dot = l**2/theta_dot"


def test_show_draws_on_a_terminal_and_writes_lines_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    pendulum = load("pendulum")
    assert "θ̈" in procedure(pendulum, "unicode")
    assert procedure(pendulum) == CliRunner().invoke(main, ["show", "pendulum"]).output
    monkeypatch.setattr("sys.stdout", Terminal())
    monkeypatch.setenv("TERM", "xterm")
    assert knows_unicode()
    monkeypatch.setenv("TERM", "dumb")
    assert not knows_unicode()


def test_a_bar_tells_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    with progress_bar("simulating", 2.0) as update:
        assert update is not None
        for done in (0.5, 1.0):
            time.sleep(0.06)
            update(done)
    assert "simulating" in stream.getvalue()
    assert "left" in stream.getvalue()


def test_a_bar_moves_before_the_first_word_of_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """While an FMU is built nothing is counted yet; the bar pulses, and does not stand at 0."""
    stream = Terminal()
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setenv("TERM", "xterm-256color")
    with progress_bar("validating", 1.0):
        time.sleep(0.3)
    bars = {frame.partition("validating")[2].partition("0:00")[0] for frame in stream.getvalue().split("\r")}
    assert len(bars - {""}) > 1


def test_a_narrow_terminal_shows_all_digits() -> None:
    stream = Terminal()
    check = Check("co-simulation, model exchange", 1.23e-7, 1e-4, "largest error at t = 3")
    Console(file=stream, width=52).print(Report("narrow", (check,), (), (), {}).table())
    assert "…" not in stream.getvalue()
    assert "1.23e-07" in stream.getvalue()


def test_without_a_terminal_there_is_no_bar_and_no_colour(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.StringIO()
    monkeypatch.setattr("sys.stderr", stream)
    with progress_bar("simulating", 2.0) as update:
        assert update is None
    assert not stream.getvalue()
    terminal = Terminal()
    monkeypatch.setattr("sys.stdout", terminal)
    monkeypatch.setenv("NO_COLOR", "1")
    console().print("[red]FAILED[/red]")
    assert "\x1b[31m" not in terminal.getvalue()
    table = CliRunner().invoke(main, ["models"]).output
    assert "\x1b" not in table
    assert max(map(len, table.splitlines())) <= 110


def test_without_a_terminal_lines_tell_what_takes_long(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "EVERY", 0.1)
    with progress_bar("building", None):
        time.sleep(0.35)
    told = capsys.readouterr().err.splitlines()
    assert 2 <= len(told) <= 3
    assert set(told) == {"building: 0 s"}
    time.sleep(0.2)
    assert capsys.readouterr().err == ""


@telling("thinking")
def think(seconds: float, progress: object = None) -> str:
    """A public function that takes ``seconds`` (s)."""
    reached(0.5)
    time.sleep(seconds)
    return "done"


@telling("thinking twice")
def think_twice() -> None:
    """A public function that calls another one."""
    think(0.2)


def test_a_function_called_from_python_tells_how_long_it_takes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "AFTER", 0.1)
    assert think(0.2) == "done"
    assert capsys.readouterr().err == "thinking: 0 s\n"
    think(0.02)
    think(0.2, progress=print)
    assert capsys.readouterr().err == ""
    think_twice()
    assert capsys.readouterr().err == "thinking twice: 0 s\n"
    monkeypatch.setenv(QUIET, "1")
    think(0.2)
    assert capsys.readouterr().err == ""


def test_a_function_called_from_python_draws_a_bar_where_it_takes_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "AFTER", 0.1)
    monkeypatch.setenv("TERM", "xterm")
    for seconds, drawn_ in ((0.3, True), (0.0, False)):
        stream = Terminal()
        monkeypatch.setattr("sys.stderr", stream)
        think(seconds)
        assert ("thinking" in stream.getvalue()) is drawn_
        assert not progress._tell


def test_a_worker_shows_nothing() -> None:
    with get_context("spawn").Pool(1) as pool:
        assert pool.apply(progress._in_worker)
    assert not progress._in_worker()


def test_a_notebook_gets_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    class ZMQInteractiveShell:
        """The name of the shell in a kernel of Jupyter."""

    class Notebook:
        """What IPython offers there."""

        get_ipython = ZMQInteractiveShell

    stream = io.StringIO()
    monkeypatch.setattr(progress, "AFTER", 0.05)
    monkeypatch.setitem(sys.modules, "IPython", Notebook)
    monkeypatch.setattr("sys.stderr", stream)
    think(0.2)
    assert "thinking" in stream.getvalue()
    assert "\r" in stream.getvalue()
