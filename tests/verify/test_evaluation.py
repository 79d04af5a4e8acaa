"""FMUs that are asked for their equations at single states."""

import pytest
import sympy as sp

from lag2fmu.errors import SimulationError
from lag2fmu.mechanism import Constraint, Energy, Mechanism, coordinate
from lag2fmu.verify.evaluation import evaluation

pytestmark = pytest.mark.fmu


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_a_start_that_the_fmu_refuses_is_told_with_its_reason(exported, fmi: str) -> None:
    """A crank at 0 is at its place at t = 0, and 1 rad off at t = 1 s; fmpy's own error gave no reason."""
    crank = coordinate("crank", "rad", start=0.0, velocity=1.0)
    drive = Constraint("drive", crank - sp.Symbol("t"))
    energy = Energy(kinetic=crank.dot**2 / 2)
    fmu = exported(Mechanism("driven", coordinates=[crank], energy=energy, constraints=[drive]), fmi=fmi)
    with pytest.raises(SimulationError, match=r"could not begin at t = 1 s: .*drive"), evaluation(fmu.path, 1.0):
        pass
