"""A comparison of trajectories, with its differences below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from lag2fmu.reference import Trajectory
from lag2fmu.verify.plots.figures import LINE

_MAX_CURVES = 6


def comparison(title: str, coordinates: Sequence[str], trajectories: Mapping[str, Trajectory]) -> Figure:
    """Above: ``coordinates`` of the first trajectory as lines, of the last as dots; below: |differences|."""
    figure = Figure(figsize=(9, 6.5), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    labels = list(trajectories)
    base, last = trajectories[labels[0]], trajectories[labels[-1]]
    shown = list(coordinates)[:_MAX_CURVES]
    stride = max(1, len(last) // 80)
    for number, name in enumerate(shown):
        above.plot(base.time, base[name], color=f"C{number}", label=name, **LINE)
        above.plot(last.time[::stride], last[name][::stride], "o", color=f"C{number}", markersize=3)
    for number, label in enumerate(labels[1:]):
        run = trajectories[label]
        worst = np.max([np.abs(run[name] - base.interpolated(run.time)[name]) for name in shown], axis=0)
        below.semilogy(run.time[1:], np.maximum(worst[1:], 1e-18), color=f"C{number + len(shown)}", label=label, **LINE)
    above.set_title(f"{title}\nlines: {labels[0]}, dots: {labels[-1]}", fontsize=11)
    below.set_ylabel("largest |difference|")
    below.set_xlabel("time in s")
    for axes in (above, below):
        axes.grid(True, alpha=0.3)
        axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure
