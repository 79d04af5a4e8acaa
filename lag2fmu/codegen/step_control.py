"""The constants of step size control, which the C engine, lanes and the readable Python of an FMU share."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from runpy import run_path

from lag2fmu.codegen.templates import render
from lag2fmu.resources import resource_folder


@cache
def step_control() -> Mapping[str, float]:
    """{name: value} of all constants, in the order of the file that explains them and gives their sources."""
    path = resource_folder("templates") / "python" / "runtime" / "step_control.py"
    return {name: value for name, value in run_path(str(path)).items() if name.isupper()}


def step_control_header() -> str:
    """The constants as a header in C."""
    return render("mechanism/step_control.h.jinja", {"control": step_control()})
