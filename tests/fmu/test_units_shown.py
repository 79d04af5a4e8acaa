"""The unit in which a table, a plot or a CSV file shows a variable is the one that the FMU gives it."""

from __future__ import annotations

import pytest

from lag2fmu.dynamics.lagrange import derive
from lag2fmu.dynamics.program import lower
from lag2fmu.fmu.variables import build_table
from lag2fmu.formats.loading import load
from lag2fmu.mechanism.display import display_units


@pytest.mark.parametrize("model", ["motion_driven_pendulum", "slider_crank", "braked_wheel", "gripper", "dc_motor"])
def test_every_unit_of_the_fmu_is_shown(model: str) -> None:
    equations = derive(load(model))
    shown = display_units(equations.mechanism)
    for variable in build_table(equations, lower(equations)).variables:
        if variable.unit is not None and variable.causality != "independent":
            assert shown[variable.name].dimension == variable.unit.dimension, variable.name
            assert shown[variable.name].factor == variable.unit.factor, variable.name
