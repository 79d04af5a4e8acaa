"""A picture of a calibration: what was measured, what the model gives, and what is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from lag2fmu.language.units import Unit
from lag2fmu.studies.fits import Fit
from lag2fmu.verify.plots.figures import LETTERS, LINE, dressed, labelled, say

_MOST = 8
"""Panels of one figure; it says how many columns it leaves out."""


@mpl.rc_context(LETTERS)
def calibration_figure(fits: Sequence[Fit], noise: Mapping[str, float], units: Mapping[str, Unit]) -> Figure:
    """Left: each measured column (dots) and the calibrated model (line) over time; right: residuals by the noise."""
    panels = [(fit, j) for fit in fits for j in range(len(fit.experiment.names))]
    shown = panels[:_MOST]
    figure = Figure(figsize=(10, 0.8 + 2.0 * len(shown)), layout="constrained")
    axes = figure.subplots(len(shown), 2, squeeze=False, width_ratios=[2, 1])
    for row, (fit, j) in enumerate(shown):
        name = fit.experiment.names[j]
        title = f"{fit.experiment.label}: {name}" if len(fits) > 1 else name
        _draw(axes[row], fit, j, title, noise[name], units.get(name))
    left_out = len(panels) - len(shown)
    say(figure, [f"{left_out} further columns are not shown"] if left_out else [])
    return figure


def _draw(axes: Any, fit: Fit, j: int, title: str, size: float, unit: Unit | None) -> None:
    """One column of an experiment: the fit, and the residuals in units of the noise."""
    experiment = fit.experiment
    there = np.isfinite(experiment.values[:, j])
    time, measured, fitted = experiment.time[there], experiment.values[there, j], fit.fitted[there, j]
    residuals = (measured - fitted) / size
    if unit is not None:
        measured, fitted = unit.from_si(measured), unit.from_si(fitted)
    axes[0].plot(time, measured, ".", markersize=3, color="0.4", label="measured")
    axes[0].plot(time, fitted, color="C3", label="calibrated", **LINE)
    axes[0].legend(fontsize=8)
    axes[1].plot(time, residuals, ".", markersize=3, color="C0")
    axes[1].axhspan(-1.96, 1.96, color="C0", alpha=0.1)
    dressed(axes[0], title, "time in s", labelled(experiment.names[j], unit))
    dressed(axes[1], "what is left", "time in s", "in units of the noise")
