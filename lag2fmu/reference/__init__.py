"""The independent path: a mechanism integrated directly from its energies, without the derivation in dynamics/.

T comes from Koenig's theorem, the equations from polarisation and the complex step, the trajectory from SciPy.
"""

from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.equations import Equations
from lag2fmu.reference.hamilton import integrate_canonically
from lag2fmu.reference.integrate import integrate, remedy_of_jumps
from lag2fmu.reference.integrated import Reference
from lag2fmu.reference.signals import Pieces, Signals, held, interpolated
from lag2fmu.reference.symbolic import sympy_accelerations
from lag2fmu.reference.terms import Balance
from lag2fmu.reference.trajectory import Trajectory, parse_csv, read_csv

__all__ = [
    "Balance",
    "EnergyFunctions",
    "Equations",
    "Pieces",
    "Reference",
    "Signals",
    "Trajectory",
    "held",
    "integrate",
    "integrate_canonically",
    "interpolated",
    "parse_csv",
    "read_csv",
    "remedy_of_jumps",
    "sympy_accelerations",
]
