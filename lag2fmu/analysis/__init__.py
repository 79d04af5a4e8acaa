"""What follows from the Lagrangian beside the motion: conserved quantities, equilibria, modes, canonical forms."""

from lag2fmu.analysis.canonical import (
    action,
    hamiltonian,
    hamiltonian_form,
    poisson_bracket,
    routhian_form,
)
from lag2fmu.analysis.conserved import Conserved, conserved
from lag2fmu.analysis.equilibria import Equilibrium, equilibria
from lag2fmu.analysis.floquet import Floquet, floquet
from lag2fmu.analysis.linearization import linearize
from lag2fmu.analysis.modes import NaturalMode, normal_modes
from lag2fmu.analysis.report import analysis_report, analysis_sections
from lag2fmu.analysis.small_motions import linearized
from lag2fmu.analysis.state_space import Linearization
from lag2fmu.analysis.stiffness import Stiffness, Vibration, stiffness, undamped_vibrations

__all__ = [
    "Conserved",
    "Equilibrium",
    "Floquet",
    "Linearization",
    "NaturalMode",
    "Stiffness",
    "Vibration",
    "action",
    "analysis_report",
    "analysis_sections",
    "conserved",
    "equilibria",
    "floquet",
    "hamiltonian",
    "hamiltonian_form",
    "linearize",
    "linearized",
    "normal_modes",
    "poisson_bracket",
    "routhian_form",
    "stiffness",
    "undamped_vibrations",
]
