"""A picture of estimates: each within two standard deviations, with what was measured of it."""

from __future__ import annotations

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from lag2fmu.language.units import Unit
from lag2fmu.reference.trajectory import Floats
from lag2fmu.verify.plots.figures import LETTERS, LINE, dressed, labelled, say

_MOST = 8
"""Panels of one figure; it says how many estimates it leaves out."""


@mpl.rc_context(LETTERS)
def estimates_figure(
    time: Floats,
    estimates: Mapping[str, tuple[Floats, Floats]],
    samples: Mapping[str, Floats],
    units: Mapping[str, Unit],
) -> Figure:
    """A panel for each of the first ``estimates`` {name: (values, deviations)}, (m,) each, over ``time`` (m,) in s.

    ``samples`` {name: (m,)} are shown with them. Values are in SI units, panels in the ``units`` {name: unit}.
    """
    shown = [*estimates][:_MOST]
    figure = Figure(figsize=(8, 0.8 + 1.8 * len(shown)), layout="constrained")
    axes = figure.subplots(len(shown), 1, squeeze=False, sharex=True)[:, 0]
    for i, (name, panel) in enumerate(zip(shown, axes, strict=True)):
        unit, (estimate, deviation) = units.get(name), estimates[name]
        value, low, high = (estimate + k * deviation for k in (0, -2, 2))
        sample = samples.get(name, np.full_like(value, np.nan))
        if unit is not None:
            value, low, high, sample = (unit.from_si(x) for x in (value, low, high, sample))
        if np.isfinite(sample).any():
            panel.plot(time, sample, ".", markersize=3, color="0.5", label="measured")
        panel.fill_between(time, low, high, color="C0", alpha=0.2, linewidth=0, label="two standard deviations")
        panel.plot(time, value, color="C0", label="estimated", **LINE)
        if i == 0:
            panel.legend(fontsize=8)
        dressed(panel, name, "time in s" if i == len(shown) - 1 else "", labelled(name, unit))
    left_out = len(estimates) - len(shown)
    say(figure, [f"{left_out} further estimates are not shown"] if left_out else [])
    return figure
