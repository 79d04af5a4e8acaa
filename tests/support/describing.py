"""The description of a mechanism's FMU without the FMU: nothing is compiled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lag2fmu.codegen import DEFAULT_SOLVER
from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.fmu.backends.native import describe
from lag2fmu.fmu.model_description import ModelDescription
from lag2fmu.fmu.variables import promotable
from lag2fmu.fmu.versions import VERSIONS
from lag2fmu.mechanism import Mechanism


def described(
    mechanism: Mechanism, outputs: Sequence[str] = (), *, fmi: str = "2.0", arrays: bool = False
) -> tuple[ModelDescription, Mapping[str, str]]:
    """The description, ``outputs`` among its outputs, and the C sources {file name: text}."""
    equations, version = derive(mechanism), VERSIONS[fmi]
    program = lower(equations, promotable(equations, outputs, events=fmi != "2.0"))
    return describe(
        with_derived(mechanism, equations), equations, program, DEFAULT_SOLVER, version=version, arrays=arrays
    )
