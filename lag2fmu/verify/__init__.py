"""Verification: simulation by fmpy, comparison with the direct integration, reports."""

from typing import TYPE_CHECKING

from lag2fmu.lazy import offered

if TYPE_CHECKING:
    from lag2fmu.verify.report import Check as Check
    from lag2fmu.verify.report import Report as Report

__getattr__, __all__ = offered(__name__, __file__)
