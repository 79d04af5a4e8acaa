"""Derivation: the expression graph with automatic differentiation and the Lagrange equations on it."""

from lag2fmu.dynamics.derivation import derive
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Array, Function
from lag2fmu.dynamics.program import Program, lower

__all__ = ["Array", "EquationsOfMotion", "Function", "Program", "derive", "lower"]
