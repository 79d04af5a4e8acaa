"""FMUs: variables and model description, compilers, packing."""

from typing import TYPE_CHECKING

from lag2fmu.lazy import offered

if TYPE_CHECKING:
    from lag2fmu.fmu.advice import suited_solver as suited_solver
    from lag2fmu.fmu.contents import MECHANISM_ENTRY as MECHANISM_ENTRY
    from lag2fmu.fmu.contents import read_mechanism as read_mechanism
    from lag2fmu.fmu.exported import Fmu as Fmu
    from lag2fmu.fmu.exporting import export as export
    from lag2fmu.fmu.model_description import ModelDescription as ModelDescription

__getattr__, __all__ = offered(__name__, __file__)
