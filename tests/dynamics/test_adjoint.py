"""The adjoint program: what it costs, and that it leaves all other functions as they are."""

import pytest
from chosen import REPRESENTATIVE, models

from lag2fmu.codegen.c import c_function
from lag2fmu.dynamics import Program, derive, lower
from lag2fmu.dynamics.adjoint import with_adjoints
from lag2fmu.formats.loading import load

HYBRID = frozenset({"falling_rod", "sliding_sphere"})
MOST = 4.0
"""Operations of an adjoint as a multiple of those of an evaluation."""


def operations(program: Program, *names: str) -> int:
    known = {f.name for f in program.functions}
    return sum(program.operations(name) for name in (f"mechanism_{n}" for n in names) if name in known)


@pytest.mark.parametrize("model", models(REPRESENTATIVE | HYBRID))
def test_adjoints_cost_less_than_four_evaluations(model: str) -> None:
    """The system is factorised once more: for the first adjoint at a point nothing is there but the function's value.

    Where modes switch rows, the function itself factorises it.
    """
    program = with_adjoints(lower(derive(load(model))))
    system = "constrained" if program.constraints else "factor"
    evaluation = operations(program, "accelerations" if not program.places else system, "further", "locals")
    evaluation += operations(program, "dependent")
    adjoint = operations(program, system, "solve", "unknowns_adjoint", "adjoint", "dependent_adjoint")
    assert adjoint <= MOST * evaluation


def test_the_other_functions_stay_as_they_are() -> None:
    """Trajectories of FMI 3.0 are those of 2.0 bit for bit."""
    program = lower(derive(load("falling_rod")))
    adjoint = with_adjoints(program)
    assert adjoint.functions[: len(program.functions)] == program.functions
    assert all(c_function(program, f) == c_function(adjoint, f) for f in program.functions)
