"""The power that changes a mechanism's energy, as a function in C of the variables of its FMU."""

from __future__ import annotations

from collections.abc import Mapping

from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Array, Program, filling
from lag2fmu.dynamics.work import moving_supports, power_of_work

FUNCTION = "work_power"


def work(equations: EquationsOfMotion, references: Mapping[str, int]) -> Program:
    """The function that computes power[2] at a time t (s) from the values v of the FMU's variables.

    power[0] is the power of work (W). power[1] is the sum of the squared velocities of supports, 0 if none moves.
    Inputs that are no variables of the FMU keep their start values.

    ``references`` is {variable: value reference}. Raises DerivationError if the power depends on a quantity that is no
    variable.
    """
    equations = equations.apart()
    g, v = equations.graph, equations.variables
    names = {reference: name for name, reference in references.items()}
    values = tuple(g.symbol(names.get(k, f"value {k}")) for k in range(1 + max(names)))
    resting = {u.name: u.start for u in equations.mechanism.inputs}
    unseen = {g.symbol(name): g.constant(resting.get(name, 0.0)) for name in equations.mechanism.hidden_inputs}
    unseen |= dict.fromkeys(v.rates, g.zero)  # a page holds its inputs between the points at which it sets them
    arguments = (Array("t", (v.t,), True), Array("v", values))
    power = g.substitute([power_of_work(equations), moving_supports(equations)], unseen)
    function = filling(FUNCTION, "The power of work, and how fast supports move.", arguments, power=power)
    return Program(g, (function.check(g),), "", 0, (), (), ())
