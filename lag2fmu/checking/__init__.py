"""The rules of FMI 2.0 and 3.0 on any FMU of any tool: archive, XML, variables, structure, binaries, a run of it."""

from typing import TYPE_CHECKING

from lag2fmu.lazy import offered

if TYPE_CHECKING:
    from lag2fmu.checking.check import check_fmu as check_fmu
    from lag2fmu.checking.findings import Finding as Finding
    from lag2fmu.checking.findings import Findings as Findings

__getattr__, __all__ = offered(__name__, __file__)
