"""Verification: simulation by fmpy, comparison with the direct integration, reports."""

from lag2fmu.verify.report import Check, Report
from lag2fmu.verify.running import simulate, validate

__all__ = ["Check", "Report", "simulate", "validate"]
