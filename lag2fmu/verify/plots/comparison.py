"""A comparison of trajectories, with its differences below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from lag2fmu.language.units import Unit
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.verify.plots.figures import LETTERS, LINE, by_unit, in_units

_MAX_CURVES, _DOTS = 6, 80
"""The most coordinates that are shown, and about the number of dots of each."""


@mpl.rc_context(LETTERS)
def comparison(
    title: str, coordinates: Sequence[str], trajectories: Mapping[str, Trajectory], units: Mapping[str, Unit]
) -> Figure:
    """Above: ``coordinates`` of the first trajectory as lines, of the last as dots, a panel for each unit in ``units``.

    Below: |differences|, relative to the range of each coordinate in the first trajectory.
    """
    labels = list(trajectories)
    base, last = trajectories[labels[0]], trajectories[labels[-1]]
    shown = list(coordinates)[:_MAX_CURVES]
    groups = by_unit(shown, units)
    figure = Figure(figsize=(9, 4.0 + 2.5 * len(groups)), layout="constrained")
    *above, below = figure.subplots(len(groups) + 1, 1, sharex=True, height_ratios=[3] * len(groups) + [2])
    stride = max(1, len(last) // _DOTS)
    line, dots = in_units(base, units), in_units(last, units)
    for axes, (unit, names) in zip(above, groups.items(), strict=True):
        for name in names:
            color = f"C{shown.index(name)}"
            axes.plot(base.time, line[name], color=color, label=name, **LINE)
            axes.plot(last.time[::stride], dots[name][::stride], "o", color=color, markersize=3)
        axes.set_ylabel(f"in {unit}" if unit else "")
    size = [max(float(np.ptp(base[name])), 1e-300) for name in shown]
    for number, label in enumerate(labels[1:]):
        run = trajectories[label]
        at = base.interpolated(run.time)
        worst = np.max([np.abs(run[n] - at[n]) / s for n, s in zip(shown, size, strict=True)], axis=0)
        below.semilogy(run.time[1:], np.maximum(worst[1:], 1e-18), color=f"C{number + len(shown)}", label=label, **LINE)
    figure.suptitle(f"{title}\nlines: {labels[0]}, dots: {labels[-1]}", fontsize=11)
    below.set_ylabel("largest |difference| / range")
    below.set_xlabel("time in s")
    for axes in (*above, below):
        axes.grid(True, alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure
