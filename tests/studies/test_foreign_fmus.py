"""Sweeps of FMUs that lag2fmu has not made: written by hand in C, in FMI 2.0 and 3.0, each with its own Euler steps."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from by_hand import SOURCE, SOURCES, TOKEN, by_hand

import lag2fmu
from lag2fmu.errors import LoadError

pytestmark = [
    pytest.mark.fmu,
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("xarray") is None, reason='the extra "sweeps" is not installed'),
]

XML_3 = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="faulty" instantiationToken="{TOKEN}">
  <CoSimulation modelIdentifier="faulty" canHandleVariableCommunicationStepSize="true"/>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.125"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="x" valueReference="1" causality="output" initial="exact" start="1 2"><Dimension start="2"/></Float64>
    <Float64 name="u" valueReference="3" causality="input" start="0.5"/>
    <Float64 name="k" valueReference="4" causality="parameter" variability="tunable" start="2"/>
    <Float64 name="y" valueReference="6" causality="output"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="1"/><Output valueReference="6"/><InitialUnknown valueReference="6"/>
  </ModelStructure>
</fmiModelDescription>
"""


def test_an_fmu_2_of_another_tool(tmp_path: Path) -> None:
    """x(t + h) = x + h (u + k) from 1, so that x = 1 + t (u + k); here it refuses steps with k below 0."""
    refusing = SOURCE.replace(
        "    (void)no_set;\n", "    (void)no_set;\n    if (self->value[2] < 0.0) return fmi2Error;\n"
    )
    fmu = by_hand(tmp_path / "x.fmu", refusing)
    vary = {"k": [-1.0, 0.5, 2.0], "u": [0.0, 0.25]}
    found = lag2fmu.sweep(fmu, vary, times=[0.5, 1.0], path=tmp_path / "out.nc")
    k, u, t = np.meshgrid(*vary.values(), [0.5, 1.0], indexing="ij")
    assert found["x"].dims == ("k", "u", "time")
    np.testing.assert_allclose(found["x"].values[1:], (1.0 + t * (u + k))[1:], rtol=1e-12)
    assert found["x"].attrs["units"] == "m"
    assert found["failed"].values.tolist() == [[True, True], [False, False], [False, False]]
    assert np.isnan(found["x"].values[0]).all()
    assert "fmi2DoStep" in str(found["reason"].values[0, 0])
    with pytest.raises(LoadError, match="has no variable 'K'"):
        lag2fmu.sweep(fmu, {"K": [1.0]})


def test_an_fmu_3_of_another_tool(tmp_path: Path) -> None:
    """Euler steps h/8 of dx1/dt = u - k x1: x1 goes to u/k by the factor 1 - k h/8 each."""
    fmu = by_hand(tmp_path / "x.fmu", (SOURCES / "faulty_fmu3.c").read_text("utf-8"), XML_3, "3.0")
    k = np.array([0.5, 1.0, 2.0])
    found = lag2fmu.sweep(fmu, {"k": k, "u": [0.5]}, at_end=True)
    (name,) = (name for name in found.data_vars if name.startswith("x") and "1" in name)
    rest = 0.5 / k
    expected = rest + (1.0 - rest) * (1.0 - k * 0.125 / 8.0) ** 64
    assert not found["failed"].any()
    np.testing.assert_allclose(found[name].values[:, 0], expected, rtol=1e-12)
