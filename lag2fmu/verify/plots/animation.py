"""The mechanism as it moves: the drawing of the sketch along a trajectory, frame after frame."""

from __future__ import annotations

import logging
from base64 import b64encode
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib as mpl
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, HTMLWriter, PillowWriter
from matplotlib.figure import Figure

from lag2fmu.errors import ExportError
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.graph.batches import Floats
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.picture.drawing import frame
from lag2fmu.picture.layout import layout_of
from lag2fmu.picture.scene import Disc, Stroke
from lag2fmu.picture.surfaces import surfaces
from lag2fmu.progress import telling
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.plots.figures import LETTERS
from lag2fmu.verify.plots.marks import draw_marks

ENDINGS = (".gif", ".mp4", ".html")
RATE, MOST_FRAMES = 25, 300
"""Frames a second, and in all: a longer motion is shown faster, and says so."""

_SIZE, _MARGIN, _DOTS = (6.0, 4.5), 6.0, 100
"""The size of a picture in inches, the margin around the motion in units of the picture, dots for each inch."""

Progress = Callable[[float], None]
_LOGGER = logging.getLogger("lag2fmu")


@mpl.rc_context(LETTERS)
@telling("drawing")
def animate(model: Mechanism | str | Path, run: Trajectory, path: str | Path, progress: Progress | None = None) -> None:
    """Write the motion ``run`` of ``model``, a mechanism or what ``load`` takes, as .gif, .mp4 or .html to ``path``.

    It is shown in real time, or so much faster that it takes 12 s; ``progress`` is told the share that is done, 0 to 1.
    Raises LoadError as ``load`` does, DerivationError if there is nothing to draw,
    SimulationError for a trajectory without the coordinates, ExportError for another ending, a path that cannot be
    written, and where .mp4 lacks the program ffmpeg.
    """
    mechanism, path = as_mechanism(model), Path(path)
    writer = writer_of(path)
    seen, notes = surfaces(mechanism)
    for note in notes:
        _LOGGER.warning("warning: %s", note)
    layout = layout_of(mechanism, seen)
    times = np.linspace(run.time[0], run.time[-1], _count(run))
    states = _states(mechanism, run, times)
    pictures = [frame(layout, state) for state in states]
    figure, limits = Figure(figsize=_SIZE, dpi=_DOTS), _limits(pictures)
    speed = (run.time[-1] - run.time[0]) * RATE / len(times)
    shown = "" if speed < 1.05 else f", {speed:.3g} times as fast"
    axes = figure.add_axes((0, 0, 1, 0.92))
    try:
        with writer.saving(figure, str(path), _DOTS):
            for k, (time, marks) in enumerate(zip(times, pictures, strict=True)):
                axes.clear()
                draw_marks(axes, marks, _points_a_unit(limits))
                axes.set(xlim=limits[0], ylim=limits[1], aspect="equal")
                axes.axis("off")
                figure.suptitle(f"{mechanism.title}, t = {time:.2f} s{shown}", fontsize=11)
                writer.grab_frame()
                if progress is not None:
                    progress((k + 1) / len(times))
    except OSError as error:
        raise ExportError(f"cannot write '{path}': {error.strerror}; choose another place") from error


@dataclass(frozen=True)
class Film:
    """A motion as the bytes of a GIF, which a notebook shows."""

    gif: bytes = field(repr=False)

    def _repr_html_(self) -> str:
        return f'<img alt="the motion" src="data:image/gif;base64,{b64encode(self.gif).decode()}">'


def film(model: Mechanism | str | Path, run: Trajectory) -> Film:
    """The motion ``run`` of ``model`` to be shown in a notebook; raises what ``animate`` raises."""
    with TemporaryDirectory(prefix="lag2fmu-") as folder:
        path = Path(folder, "film.gif")
        animate(model, run, path)
        return Film(path.read_bytes())


def writer_of(path: Path) -> AbstractMovieWriter:
    """What writes an animation to ``path``; raises ExportError for another ending, and where .mp4 lacks ffmpeg."""
    if path.suffix not in ENDINGS:
        raise ExportError(f"'{path}': animations are written as {', '.join(ENDINGS)}")
    if path.suffix == ".gif":
        return PillowWriter(fps=RATE)
    if path.suffix == ".html":
        return HTMLWriter(fps=RATE, embed_frames=True)
    if not FFMpegWriter.isAvailable():
        raise ExportError(f"'{path}': .mp4 needs the program ffmpeg; install it, or write .gif or .html")
    return FFMpegWriter(fps=RATE)


def _count(run: Trajectory) -> int:
    """The number of frames of a run in real time, at most MOST_FRAMES and at least 2."""
    return int(np.clip(round((run.time[-1] - run.time[0]) * RATE) + 1, 2, MOST_FRAMES))


def _states(mechanism: Mechanism, run: Trajectory, times: Floats) -> Iterator[dict[str, float]]:
    """The time and what of ``run`` the drawing may need at each of ``times``, linear between its points."""
    needed = [q.name for q in mechanism.coordinates]
    columns = run.columns([*needed, *(u.name for u in mechanism.motions if u.name in run.names)])
    names = [*needed, *(u.name for u in mechanism.motions if u.name in run.names)]
    values = [np.interp(times, run.time, column) for column in columns.T]
    for k, time in enumerate(times):
        yield {"t": float(time), **{name: float(x[k]) for name, x in zip(names, values, strict=True)}}


def _limits(pictures: list[tuple[Stroke | Disc, ...]]) -> tuple[tuple[float, float], tuple[float, float]]:
    """The least box that all ``pictures`` fit in, in the shape of the figure."""
    found = [np.array(m.points if isinstance(m, Stroke) else [m.center]) for marks in pictures for m in marks]
    low, high = (np.vstack(found).min(axis=0) - _MARGIN), (np.vstack(found).max(axis=0) + _MARGIN)
    middle, shape = (low + high) / 2, np.array([_SIZE[0], 0.92 * _SIZE[1]])
    half = max((high - low) / shape) / 2 * shape
    (left, bottom), (right, top) = middle - half, middle + half
    return (float(left), float(right)), (float(bottom), float(top))


def _points_a_unit(limits: tuple[tuple[float, float], tuple[float, float]]) -> float:
    """Points (1/72 inch) for a unit of the picture, for widths of lines."""
    (left, right), _ = limits
    return float(max(1.0, min(5.0, _SIZE[0] * 72 / (right - left))))
