"""Code generation: Program -> C text, templates -> source tree."""

from lag2fmu.codegen.sources import Slot, Tables, render_sources
from lag2fmu.codegen.tableaus import DEFAULT_SOLVER, METHODS, Tableau

__all__ = ["DEFAULT_SOLVER", "METHODS", "Slot", "Tableau", "Tables", "render_sources"]
