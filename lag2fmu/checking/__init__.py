"""The rules of FMI 2.0 on any FMU from any tool: archive, XML, variables, structure, binaries, and a run of it."""

from lag2fmu.checking.check import check_fmu
from lag2fmu.checking.findings import Finding, Findings

__all__ = ["Finding", "Findings", "check_fmu"]
