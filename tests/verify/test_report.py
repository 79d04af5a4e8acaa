"""The record of a comparison: passed or not, as a table, JSON, text and plots."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from lag2fmu.errors import ExportError
from lag2fmu.reference import Trajectory
from lag2fmu.verify import Check, Report

TIMES = np.linspace(0.0, 1.0, 11)


def report(*checks: Check, title: str = "A title", notes: tuple[str, ...] = ("A note.",)) -> Report:
    runs = {
        label: Trajectory.of(TIMES, {"x": np.sin(TIMES) + offset, "x_dot": np.cos(TIMES)})
        for label, offset in (("direct integration", 0.0), ("co-simulation", 1e-9))
    }
    return Report(title, checks or (Check("good", 1e-7, 1e-4, "a detail"),), notes, ("x",), runs)


@pytest.mark.parametrize(
    ("value", "passed"),
    [(0.0, True), (1e-4, True), (math.nextafter(1e-4, 1), False), (math.nan, False), (math.inf, False)],
)
def test_a_check_passes_up_to_its_bar(value: float, passed: bool) -> None:
    assert Check("x", value, 1e-4).passed is passed
    assert report(Check("good", 0.0, 1.0), Check("x", value, 1e-4)).passed is passed


@pytest.mark.parametrize(
    ("others", "outcome"),
    [((), "not judged"), ((Check("bad", 2.0, 1.0),), "FAILED"), ((Check("good", 0.0, 1.0),), "not judged")],
)
def test_what_leaves_much_out_is_not_judged(others: tuple[Check, ...], outcome: str) -> None:
    """It is neither ok nor a failure, unless something else failed."""
    left_out = Check("share not compared", 0.607, 0.2, extent=True)
    found = report(*others, left_out)
    assert (left_out.outcome, found.outcome, found.passed) == ("not judged", outcome, False)
    assert outcome in repr(found)
    assert "not judged" in str(found)
    assert "<b>not judged</b>" in found._repr_html_()
    content = json.loads(found.to_json())
    assert (content["outcome"], content["checks"][-1]["outcome"]) == (outcome, "not judged")
    assert report(Check("share not compared", 0.1, 0.2, extent=True)).passed


def test_the_text_names_every_check() -> None:
    text = str(report(Check("first", 1e-7, 1e-4, "a detail"), Check("second", 2e-3, 1e-4)))
    lines = {line.split("│")[1].strip(): line for line in text.splitlines() if line.count("│") > 4}
    assert "1.00e-07" in lines["first"]
    assert "ok" in lines["first"]
    assert "a detail" in lines["first"]
    assert "2.00e-03" in lines["second"]
    assert "FAILED" in lines["second"]
    assert "A title" in text
    assert "A note." in text
    assert max(map(len, text.splitlines())) <= 110


@pytest.mark.parametrize("text", ["mass [kg]", "[/b] closed", "[bold]loud[/bold]", "50 % of \\[x]"])
def test_brackets_are_text_and_no_markup(text: str) -> None:
    shown = str(report(Check(text, 0.0, 1.0, text), title=text, notes=(text,)))
    assert shown.count(text) == 4


def test_json_holds_the_numbers_exactly() -> None:
    checks = Check("first", 1 / 3, 1e-4, "a detail"), Check("second", 0.0, 0.0)
    content = json.loads(report(*checks).to_json())
    assert content["title"] == "A title"
    assert content["passed"] is False
    assert content["notes"] == ["A note."]
    first = {"name": "first", "value": 1 / 3, "bar": 1e-4, "detail": "a detail", "extent": False}
    first |= {"unit": "", "evidence": "integration"}
    assert content["checks"][0] == first | {"passed": False, "outcome": "FAILED"}
    assert content["checks"][1]["passed"] is True


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_json_stays_json_without_finite_numbers(value: float) -> None:
    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    content = json.loads(report(Check("first", value, 1.0)).to_json(), parse_constant=refuse)
    assert content["checks"][0]["passed"] is False


@pytest.mark.parametrize(
    ("name", "start"),
    [("r.json", b"{"), ("r.png", b"\x89PNG\r\n"), ("r.svg", b"<?xml"), ("r.pdf", b"%PDF-"), ("r.txt", b"A title")],
)
def test_files_by_their_endings(name: str, start: bytes, tmp_path: Path) -> None:
    report().write(tmp_path / name)
    content = (tmp_path / name).read_bytes()
    assert content.lstrip().startswith(start)
    assert len(content) > 100
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["r.doc", "report", "r.JSON5"])
def test_other_endings_are_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"written as \.json, \.txt, \.png, \.svg or \.pdf"):
        report().write(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", [".json", ".txt", ".png"])
def test_places_that_cannot_be_written(ending: str, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"cannot write .*missing"):
        report().write(tmp_path / "missing" / f"r{ending}")
    (tmp_path / f"folder{ending}").mkdir()
    with pytest.raises(ExportError, match=r"cannot write .*folder"):
        report().write(tmp_path / f"folder{ending}")


def test_the_plot_shows_coordinates_and_differences() -> None:
    found = report()
    above, below = found.plot().axes
    assert above.get_lines()[0].get_label() == "x"
    (difference,) = below.get_lines()
    size = np.ptp(next(iter(found.trajectories.values()))["x"])
    assert difference.get_ydata() == pytest.approx(1e-9 / size, rel=1e-3)
    assert below.get_xlabel() == "time in s"
