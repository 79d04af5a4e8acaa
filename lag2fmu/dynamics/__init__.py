"""Derivation: the expression graph with automatic differentiation and the Lagrange equations on it."""

from lag2fmu.dynamics.lagrange import EquationsOfMotion
from lag2fmu.dynamics.program import Array, Function, Program, lower
from lag2fmu.dynamics.shown import derive

__all__ = ["Array", "EquationsOfMotion", "Function", "Program", "derive", "lower"]
