"""FMUs in Ecos (ecospy), a co-simulation engine of others: an observer wired to the plant."""

from __future__ import annotations

import ctypes
import importlib.util
import sys
from pathlib import Path

import pytest
from stepping import Stepping

from lag2fmu.analysis.observing import Observing
from lag2fmu.fmu.exporting import export

pytestmark = [
    pytest.mark.fmu,
    pytest.mark.skipif(importlib.util.find_spec("ecospy") is None, reason="ecospy is not installed"),
]
STEP = 0.01


def engine():
    """The module; its library needs one of the package tbb, which Python does not look for by itself."""
    for path in sorted((Path(sys.prefix) / "lib").glob("libtbb.so.12")):
        ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    try:
        import ecospy
    except OSError as error:
        pytest.skip(f"ecospy does not load here: {error}")
    return ecospy


def test_an_observer_sees_the_plant(exported, tmp_path: Path) -> None:
    """The same numbers as an own master that carries samples from the plant before each step."""
    ecospy = engine()
    asked = Observing("ekf", {"x": 0.005, "theta": 0.02}, {"F": 0.1, "x": 0.01})
    plant, eye = exported("cart_pole").path, export("cart_pole", tmp_path / "eye.fmu", observer=asked).path
    names = ["x", "theta", "x_dot", "theta_dot", "theta_dot_std"]
    with ecospy.EcosSimulationStructure() as structure:
        structure.add_model("plant", str(plant))
        structure.add_model("eye", str(eye))
        for name in ("x", "theta"):
            structure.make_real_connection(f"plant::{name}", f"eye::{name}_measured")
        structure.add_parameter_set("begin", {"eye::theta_dot": 1.0})
        with ecospy.EcosSimulation(structure=structure, step_size=STEP) as simulation:
            simulation.init(parameter_set="begin")
            simulation.step(100)
            found = [simulation.get_real(f"eye::{name}") for name in names]
            truth = simulation.get_real("plant::theta_dot")
            simulation.terminate()
    with Stepping(plant) as seen, Stepping(eye) as seeing:
        seen.start()
        seeing.start({"theta_dot": 1.0})
        for _ in range(100):
            seeing.set({f"{name}_measured": value for name, value in zip(names[:2], seen.get(names[:2]), strict=True)})
            seen.step(STEP)
            seeing.step(STEP)
        assert found == pytest.approx(seeing.get(names), abs=1e-8)
        assert truth == pytest.approx(seen.get(["theta_dot"])[0], abs=1e-8)
    assert found[3] == pytest.approx(truth, abs=0.02)
