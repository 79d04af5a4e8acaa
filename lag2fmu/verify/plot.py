"""Figures: trajectories over time, and a comparison with its differences. The only module that uses matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lag2fmu.errors import ExportError, LoadError
from lag2fmu.mechanism import Mechanism, Output
from lag2fmu.reference import Trajectory

Floats = NDArray[np.float64]

_MAX_CURVES = 6
_LINE = {"linewidth": 1.2}


def comparison(title: str, coordinates: Sequence[str], trajectories: Mapping[str, Trajectory]) -> Figure:
    """Above: ``coordinates`` of the first trajectory as lines, of the last as dots; below: |differences|."""
    figure = Figure(figsize=(9, 6.5), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    labels = list(trajectories)
    base, last = trajectories[labels[0]], trajectories[labels[-1]]
    shown = list(coordinates)[:_MAX_CURVES]
    stride = max(1, len(last) // 80)
    for number, name in enumerate(shown):
        above.plot(base.time, base[name], color=f"C{number}", label=name, **_LINE)
        above.plot(last.time[::stride], last[name][::stride], "o", color=f"C{number}", markersize=3)
    for number, label in enumerate(labels[1:]):
        run = trajectories[label]
        worst = np.max([np.abs(run[name] - base.interpolated(run.time)[name]) for name in shown], axis=0)
        below.semilogy(
            run.time[1:], np.maximum(worst[1:], 1e-18), color=f"C{number + len(shown)}", label=label, **_LINE
        )
    above.set_title(f"{title}\nlines: {labels[0]}, dots: {labels[-1]}", fontsize=11)
    below.set_ylabel("largest |difference|")
    below.set_xlabel("time in s")
    for axes in (above, below):
        axes.grid(True, alpha=0.3)
        axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure


def time_histories(title: str, trajectory: Trajectory, labels: Mapping[str, str] | None = None) -> Figure:
    """One panel for every column of ``trajectory`` (at most twelve) over time; ``labels`` gives names with units."""
    names = trajectory.names[:12]
    figure = Figure(figsize=(9, 1.2 + 1.3 * len(names)), layout="constrained")
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for number, (axes, name) in enumerate(zip(panels, names, strict=True)):
        axes.plot(trajectory.time, trajectory[name], color=f"C{number % 10}", **_LINE)
        axes.set_ylabel((labels or {}).get(name, name), fontsize=9)
        axes.grid(True, alpha=0.3)
    panels[0].set_title(title, fontsize=11)
    panels[-1].set_xlabel("time in s")
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write ``figure`` as .png, .svg or .pdf; raises ExportError for another ending or an unwritable path."""
    if path.suffix not in (".png", ".svg", ".pdf"):
        raise ExportError(f"'{path}': plots are written as .png, .svg or .pdf")
    try:
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise ExportError(f"cannot write '{path}': {error.strerror}; choose another place") from error


def configuration(mechanism: Mechanism) -> Figure:
    """The mechanism in its start position: bodies, points, springs, dampers, and the paths the bodies will take.

    Positions in space are seen along the y axis (x to the right, z up). Raises LoadError if there is nothing to draw.
    """
    from lag2fmu.reference import integrate

    parts = mechanism.places
    if not parts:
        raise LoadError(f"mechanism '{mechanism.name}' has no bodies or points: there is nothing to draw")
    positions = {part.name: Output(f"place{i}", point=part.name, quantity="position") for i, part in enumerate(parts)}
    times = np.linspace(0.0, mechanism.experiment.stop_time, 400)
    run = integrate(replace(mechanism, outputs=tuple(positions.values())), times, rtol=1e-8).trajectory
    vertical = "xyz"[mechanism.dimension - 1]
    paths = {name: run.columns([f"{o.name}_x", f"{o.name}_{vertical}"]) for name, o in positions.items()}
    figure = Figure(figsize=(6.5, 6.5), layout="constrained")
    axes = figure.subplots()
    for part in parts:
        path = paths[part.name]
        axes.plot(path[:, 0], path[:, 1], color="0.8", linewidth=0.8, zorder=1)
        fixed = part.name in {point.name for point in mechanism.points}
        axes.plot(
            *path[0], "^" if fixed else "o", color="0.4" if fixed else "C0", markersize=6 if fixed else 10, zorder=3
        )
        axes.annotate(part.name, path[0], textcoords="offset points", xytext=(8, 6), fontsize=9)
    for elements, style in ((mechanism.springs, "--"), (mechanism.dampers, ":")):
        for element in elements:
            if element.between is not None:
                ends = np.array([paths[str(end)][0] for end in element.between])
                axes.plot(ends[:, 0], ends[:, 1], f"C3{style}", label=element.name, zorder=2)
    axes.set_title(f"{mechanism.title}\nstart position, and the paths over {times[-1]:g} s", fontsize=11)
    axes.set_xlabel("x in m")
    axes.set_ylabel(f"{vertical} in m")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(True, alpha=0.3)
    return figure
