"""FMUs: variables and model description, compilers, packing."""

from lag2fmu.fmu.advice import suited_solver
from lag2fmu.fmu.exporting import MECHANISM_ENTRY, Fmu, export, read_mechanism
from lag2fmu.fmu.model_description import ModelDescription

__all__ = ["MECHANISM_ENTRY", "Fmu", "ModelDescription", "export", "read_mechanism", "suited_solver"]
