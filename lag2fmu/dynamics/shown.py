"""Equations of motion that show themselves: in a notebook, and as SymPy expressions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lag2fmu.dynamics import lagrange
from lag2fmu.dynamics.formulas import formulas
from lag2fmu.dynamics.lagrange import EquationsOfMotion
from lag2fmu.dynamics.symbolic import Symbolic
from lag2fmu.mechanism import Mechanism


@dataclass(frozen=True, repr=False)
class ShownEquations(EquationsOfMotion):
    """EquationsOfMotion for users, who read them."""

    def _repr_latex_(self) -> str | None:
        """The equations of motion for a notebook; nothing where they would fill pages."""
        found = formulas(self)
        if found is None:
            return None
        lines = [*found.motion, *found.constraints]
        return "$$\\begin{gathered}" + " \\\\ ".join(line.latex for line in lines) + "\\end{gathered}$$"

    @property
    def sympy(self) -> Symbolic:
        """The equations as SymPy expressions: ``mass_matrix``, ``forcing``, ``lagrangian``, ``equations``."""
        return Symbolic(self.apart())


def derive(model: Mechanism | str | Path, method: str | None = None) -> ShownEquations:
    """The equations of motion of ``model``, see ``lagrange.derive``."""
    return ShownEquations(**vars(lagrange.derive(model, method)))
