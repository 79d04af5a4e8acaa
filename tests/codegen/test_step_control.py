"""One list of constants controls the steps of the C engine, of lanes, and of readable Python."""

from __future__ import annotations

import re

import pytest

from lag2fmu.codegen.lanes import render_lanes
from lag2fmu.codegen.python_sources import runtime_files
from lag2fmu.codegen.sources import render_sources
from lag2fmu.codegen.step_control import step_control
from lag2fmu.dynamics import derive, lower
from lag2fmu.fmu.variables import build_table
from lag2fmu.formats.loading import load
from lag2fmu.solvers.tableaus import TABLEAUS

NUMBER = re.compile(r"^static const double (\w+) = ([^;]+);$", re.MULTILINE)


@pytest.mark.parametrize("lanes", [False, True])
def test_c_has_the_constants_of_readable_python(lanes: bool) -> None:
    equations = derive(load("double_pendulum"))
    program, method = lower(equations), TABLEAUS["dopri5"]
    tables = build_table(equations, program).tables
    sources = render_lanes(program, tables, method, 4) if lanes else render_sources(program, tables, method, "")
    found = {name: float(value) for name, value in NUMBER.findall(sources["step_control.h"])}
    run: dict[str, float] = {}
    exec(runtime_files()[1]["step_control.py"], run)
    assert found == {name: run[name] for name in found} == dict(step_control())
    assert found["LARGEST_GROWTH"] == 10.0
    again = [name for file, text in sources.items() if file != "step_control.h" for name, _ in NUMBER.findall(text)]
    assert not found.keys() & set(again)
