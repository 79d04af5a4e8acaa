"""Animations: as many frames as the motion takes, what stands still stands still, and other endings are refused."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

from lag2fmu import load
from lag2fmu.errors import ExportError, Lag2FmuError
from lag2fmu.picture.drawing import frame
from lag2fmu.picture.layout import layout_of
from lag2fmu.picture.scene import Stroke
from lag2fmu.reference import Trajectory
from lag2fmu.verify.plots.animation import animate


def swing(seconds: float) -> Trajectory:
    """A pendulum's angle that grows evenly by 1 rad/s."""
    time = np.linspace(0.0, seconds, 11)
    return Trajectory(time, ("theta",), time[:, None])


def test_frames_follow_the_motion(tmp_path: Path) -> None:
    """25 a second, each another picture."""
    animate("pendulum", swing(0.2), tmp_path / "x.gif")
    with Image.open(tmp_path / "x.gif") as found:
        assert found.n_frames == 6
        pictures = []
        for k in range(6):
            found.seek(k)
            pictures.append(np.asarray(found.convert("L"), dtype=float))
    assert all(np.abs(a - b).max() > 100 for a, b in pairwise(pictures))


def test_a_page_holds_its_frames(tmp_path: Path) -> None:
    animate("pendulum", swing(0.12), str(tmp_path / "x.html"))
    assert (tmp_path / "x.html").read_text("utf-8").count("data:image/png;base64") == 4


def test_the_ground_stays() -> None:
    """The rail of a slider-crank is where it was; rod and slider are not."""
    layout = layout_of(load("slider_crank"))
    pictures = [frame(layout, {**layout.values, "a": a, "x": 0.3 + a}) for a in (0.3, 1.0)]
    first, later = ({tuple(map(tuple, m.points)) for m in marks if isinstance(m, Stroke)} for marks in pictures)
    assert first & later
    assert first - later


@pytest.mark.parametrize("name", ["x.txt", "x.png"])
def test_other_endings_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ExportError, match=r"animations are written as \.gif, \.mp4, \.html"):
        animate("pendulum", swing(0.1), tmp_path / name)


def test_without_ffmpeg_the_remedy_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FFMpegWriter, "isAvailable", lambda: False)
    with pytest.raises(ExportError, match=r"\.mp4 needs the program ffmpeg; install it, or write \.gif or \.html"):
        animate("pendulum", swing(0.1), tmp_path / "x.mp4")


def test_a_run_without_the_coordinates_is_refused(tmp_path: Path) -> None:
    run = Trajectory(np.array([0.0, 1.0]), ("phi",), np.zeros((2, 1)))
    with pytest.raises(Lag2FmuError, match="theta"):
        animate("pendulum", run, tmp_path / "x.gif")
