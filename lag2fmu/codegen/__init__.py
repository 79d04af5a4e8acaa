"""Code generation: Program -> C text, templates -> source tree."""

from lag2fmu.codegen.sources import render_sources
from lag2fmu.codegen.tables import RuntimeTables, Slot
from lag2fmu.solvers.methods import DEFAULT_SOLVER, METHODS, SMOOTH_METHODS, STIFF_SOLVER, Method, takes
from lag2fmu.solvers.tableaus import TABLEAUS, Tableau

__all__ = [
    "DEFAULT_SOLVER",
    "METHODS",
    "SMOOTH_METHODS",
    "STIFF_SOLVER",
    "TABLEAUS",
    "Method",
    "RuntimeTables",
    "Slot",
    "Tableau",
    "render_sources",
    "takes",
]
