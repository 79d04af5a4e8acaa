"""Representative FMUs, also of a robot, of SymPy and of parts, through every importer; every model through check."""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path

import fmpy
import hosts
import numpy as np
import pytest
from chosen import KINDS
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu
from numpy.typing import NDArray

from lag2fmu.checking import check_fmu
from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import bundled
from lag2fmu.mechanism import Mechanism
from lag2fmu.reference import Trajectory, integrate

pytestmark = [pytest.mark.toolchain, pytest.mark.fmu]

STOP, STEP = 1.0, 0.01
ACCURACY = 2e-6
"""Of a run with tolerance 1e-8, by the nominal value of a state."""
ACCURACY_OF_CVODE = {"two_armed_robot": 4e-6}
"""Where CVode, as fmpy sets it up, errs by more than ACCURACY (2.6e-6 here); the FMU's own solvers do not."""


RUN_BY_ALL = [*hosts.REPRESENTATIVE, *hosts.FROM_ELSEWHERE]


@pytest.fixture(params=RUN_BY_ALL)
def fmu(request, exported) -> Fmu:
    return exported(hosts.representative(request.param))


def states_of(fmu: Fmu) -> list[str]:
    names = [c.name for c in fmu.mechanism.coordinates]
    return [*names, *(f"{name}_dot" for name in names)]


@cache
def integrated(mechanism: Mechanism) -> Trajectory:
    """The direct integration, at the start and the stop time."""
    return integrate(mechanism, [0.0, STOP]).trajectory


def directly(fmu: Fmu) -> NDArray[np.float64]:
    """The states at the stop time by the direct integration."""
    return integrated(fmu.mechanism).columns(states_of(fmu))[-1]


def end_in_fmpy(folder: Path, names: list[str], kind: str) -> NDArray[np.float64]:
    found = fmpy.simulate_fmu(
        str(folder), fmi_type=kind, stop_time=STOP, output_interval=STEP, relative_tolerance=1e-8, output=names
    )
    assert found["time"][-1] == pytest.approx(STOP)
    return np.array([found[name][-1] for name in names])


def test_fmpy(fmu: Fmu, tmp_path: Path) -> None:
    """No finding; co-simulation, model exchange (its CVODE), and co-simulation with what it compiles itself."""
    assert validate_fmu(str(fmu.path)) == []
    folder, expected = Path(fmpy.extract(str(fmu.path), str(tmp_path / "fmu"))), directly(fmu)
    for kind in ("CoSimulation", "ModelExchange"):
        bar = ACCURACY_OF_CVODE.get(fmu.mechanism.name, ACCURACY) if kind == "ModelExchange" else ACCURACY
        assert np.abs(end_in_fmpy(folder, states_of(fmu), kind) - expected).max() < bar, kind
    if shutil.which("cmake") is None:
        pytest.skip("fmpy compiles with CMake, which is not on this machine")
    (shipped,) = (folder / "binaries" / fmpy.platform).iterdir()
    shipped.unlink()
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    assert shipped.exists()
    assert np.abs(end_in_fmpy(folder, states_of(fmu), "CoSimulation") - expected).max() < ACCURACY


def test_casadi(fmu: Fmu) -> None:
    """Imported for model exchange and integrated by CVODES with Jacobians of the FMU."""
    casadi = pytest.importorskip("casadi", reason="CasADi is not installed: pip install -e '.[importers]'")
    dae = casadi.DaeBuilder(fmu.mechanism.name, str(fmu.path))
    x, u, p = ([*getattr(dae, kind)()] for kind in "xup")
    massless = {c.coordinate for c in fmu.mechanism.constraints}
    assert x == [name for name in states_of(fmu) if name.removesuffix("_dot") not in massless]
    function = dae.create("f", ["t", "x", "u", "p"], ["ode"])
    t, states = casadi.MX.sym("t"), casadi.MX.sym("x", len(x))
    problem = {"t": t, "x": states, "ode": function(t, states, np.array(dae.start(u)), np.array(dae.start(p)))}
    run = casadi.integrator("run", "cvodes", problem, 0.0, STOP, {"abstol": 1e-10, "reltol": 1e-10})
    start = integrated(fmu.mechanism).columns(x)[0]  # guesses are solved for by the FMU only
    found = np.array(casadi.DM(run(x0=start)["xf"]).full())[:, 0]
    assert np.abs(found - directly(fmu)[[states_of(fmu).index(name) for name in x]]).max() < ACCURACY


def test_libcosim(fmu: Fmu) -> None:
    """Without a tolerance, so that the FMU takes its own, 1e-6."""
    pytest.importorskip("libcosimpy", reason="libcosim is not installed: pip install -e '.[importers]'")
    from libcosim import Simulation

    simulation = Simulation(one=fmu.path)
    simulation.run(STOP)
    assert np.abs(np.array(simulation.get("one", states_of(fmu))) - directly(fmu)).max() < 1e-4


@pytest.mark.parametrize(
    "model",
    [*RUN_BY_ALL, *(pytest.param(name, marks=pytest.mark.all_models) for name in bundled() if name not in RUN_BY_ALL)],
)
def test_check_finds_nothing(model: str, exported) -> None:
    """In the files of any of them, and in the runs of one of each kind and of what comes from elsewhere."""
    fmu = exported(hosts.representative(model))
    assert check_fmu(fmu.path, run=model in KINDS or model in RUN_BY_ALL).findings == ()
