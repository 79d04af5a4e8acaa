"""Verification: simulation by fmpy, comparison with the direct integration, reports."""

from lag2fmu.verify.entry_points import linearize, simulate, start
from lag2fmu.verify.report import Check, Report
from lag2fmu.verify.validate import validate

__all__ = ["Check", "Report", "linearize", "simulate", "start", "validate"]
