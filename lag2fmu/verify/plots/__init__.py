"""Figures: comparisons, runs, mechanisms. The only room that uses matplotlib."""

from lag2fmu.verify.plots.comparison import comparison
from lag2fmu.verify.plots.figures import save
from lag2fmu.verify.plots.mechanism import mechanism_figure
from lag2fmu.verify.plots.motion import motion_figure

__all__ = ["comparison", "mechanism_figure", "motion_figure", "save"]
