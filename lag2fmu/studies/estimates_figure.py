"""A picture of estimates: each within two standard deviations, with what was measured of it."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from lag2fmu.studies.estimates import Estimates
from lag2fmu.verify.plots.figures import LETTERS, LINE, dressed, labelled, say

_MOST = 8
"""Panels of one figure; it says how many estimates it leaves out."""


@mpl.rc_context(LETTERS)
def estimates_figure(found: Estimates) -> Figure:
    """A panel for each of the first estimates over time, in its declared unit."""
    shown = found.names[:_MOST]
    figure = Figure(figsize=(8, 0.8 + 1.8 * len(shown)), layout="constrained")
    axes = figure.subplots(len(shown), 1, squeeze=False, sharex=True)[:, 0]
    for i, (name, panel) in enumerate(zip(shown, axes, strict=True)):
        unit = found.units.get(name)
        value, low, high = (found[name] + k * found.deviation(name) for k in (0, -2, 2))
        sample = found.samples[:, found.measured.index(name)] if name in found.measured else np.full_like(value, np.nan)
        if unit is not None:
            value, low, high, sample = (unit.from_si(x) for x in (value, low, high, sample))
        if np.isfinite(sample).any():
            panel.plot(found.time, sample, ".", markersize=3, color="0.5", label="measured")
        panel.fill_between(found.time, low, high, color="C0", alpha=0.2, linewidth=0, label="two standard deviations")
        panel.plot(found.time, value, color="C0", label="estimated", **LINE)
        if i == 0:
            panel.legend(fontsize=8)
        dressed(panel, name, "time in s" if i == len(shown) - 1 else "", labelled(name, unit))
    left_out = len(found.names) - len(shown)
    say(figure, [f"{left_out} further estimates are not shown"] if left_out else [])
    return figure
