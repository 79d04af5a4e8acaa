"""The rules of FMI 2.0 and 3.0 on any FMU of any tool: archive, XML, variables, structure, binaries, a run of it."""

from typing import TYPE_CHECKING

from lag2fmu.lazy import offered

if TYPE_CHECKING:
    from lag2fmu.checking.check import check_fmu
    from lag2fmu.checking.findings import Finding, Findings

__all__ = ["Finding", "Findings", "check_fmu"]

__getattr__ = offered(
    __name__,
    {
        "Finding": "lag2fmu.checking.findings",
        "Findings": "lag2fmu.checking.findings",
        "check_fmu": "lag2fmu.checking.check",
    },
)
