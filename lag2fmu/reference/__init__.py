"""The independent path: a mechanism integrated directly from its energies, without the derivation in dynamics/.

T comes from Koenig's theorem, the equations from polarisation and the complex step, the trajectory from SciPy.
"""

from typing import TYPE_CHECKING

from lag2fmu.lazy import offered

if TYPE_CHECKING:
    from lag2fmu.reference.direct_integration import integrate as integrate
    from lag2fmu.reference.direct_integration import remedy_of_jumps as remedy_of_jumps
    from lag2fmu.reference.energies import EnergyFunctions as EnergyFunctions
    from lag2fmu.reference.equations import Equations as Equations
    from lag2fmu.reference.hamilton import integrate_canonically as integrate_canonically
    from lag2fmu.reference.integrated import Reference as Reference
    from lag2fmu.reference.signals import Pieces as Pieces
    from lag2fmu.reference.signals import Signals as Signals
    from lag2fmu.reference.signals import held as held
    from lag2fmu.reference.signals import interpolated as interpolated
    from lag2fmu.reference.symbolic import sympy_accelerations as sympy_accelerations
    from lag2fmu.reference.terms import Balance as Balance
    from lag2fmu.reference.trajectory import Trajectory as Trajectory
    from lag2fmu.reference.trajectory import parse_csv as parse_csv
    from lag2fmu.reference.trajectory import read_csv as read_csv

__getattr__, __all__ = offered(__name__, __file__)
