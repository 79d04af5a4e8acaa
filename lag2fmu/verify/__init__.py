"""Verification: simulation by fmpy, comparison with the direct integration, reports."""

from lag2fmu.verify.entry_points import linearize, simulate, validate
from lag2fmu.verify.report import Check, Report

__all__ = ["Check", "Report", "linearize", "simulate", "validate"]
