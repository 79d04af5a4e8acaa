"""Importers of others that may be installed here, and how each runs an FMU."""

from __future__ import annotations

import importlib.metadata
import importlib.util
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lag2fmu.errors import SimulationError
from lag2fmu.verify.run import Kind, Run
from lag2fmu.verify.simulate import simulate_fmu

Floats = NDArray[np.float64]

SHARPER = 1e-2
"""Importers of model exchange take the tolerance of the experiment times this: the errors of their solvers add up."""

_SECOND = 1_000_000_000
"""libcosim counts nanoseconds."""


@dataclass(frozen=True)
class Importer:
    """A tool that runs FMUs.

    - ``package``: its name on PyPI; ``module``: what Python imports of it; ``kind``: the interface it uses.
    - ``run``: of the path of an FMU, the tolerance of its experiment, times (m,) in s from 0, and the names of k
      variables, their values (m, k) in SI units.
    - ``events``: whether it handles state events; ``versions``: those of FMI that it imports.
    """

    package: str
    module: str
    kind: str
    run: Callable[[Path, float, Floats, Sequence[str]], Floats]
    events: bool = True
    versions: tuple[str, ...] = ("2.0", "3.0")

    @property
    def installed(self) -> bool:
        """Whether Python finds it here."""
        return importlib.util.find_spec(self.module) is not None

    @property
    def version(self) -> str:
        """The version that is installed, "" if none is."""
        try:
            return importlib.metadata.version(self.package)
        except importlib.metadata.PackageNotFoundError:
            return ""


def _by_fmpy(kind: Kind, path: Path, tolerance: float, times: Floats, names: Sequence[str]) -> Floats:
    """By fmpy: co-simulation, or model exchange with CVode."""
    step, end = float(times[1] - times[0]), float(times[-1])
    held = tolerance * (1.0 if kind == "co-simulation" else SHARPER)
    return simulate_fmu(path, Run(end, step, held, outputs=names, kind=kind)).columns(names)


def _by_libcosim(path: Path, tolerance: float, times: Floats, names: Sequence[str]) -> Floats:
    """By libcosim of the Open Simulation Platform, which gives no ``tolerance``, so that the FMU's own holds."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.FATAL)
    execution = CosimExecution.from_step_size(step_size=round(float(times[1] - times[0]) * _SECOND))
    slave = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=str(path), instance_name="record"))
    known = {variable.name.decode(): variable.reference for variable in execution.slave_variables(slave)}
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer=observer)
    references = [known[name] for name in names]
    execution.step(step_count=1)  # libcosim shows no values before its first step
    rows = [[float("nan")] * len(names), list(observer.last_real_values(slave, references))]
    for _ in times[2:]:
        execution.step(step_count=1)
        rows.append(list(observer.last_real_values(slave, references)))
    return np.array(rows)


def _by_casadi(path: Path, tolerance: float, times: Floats, names: Sequence[str]) -> Floats:
    """By CasADi: its DaeBuilder imports the equations, and its CVODES integrates them."""
    import casadi

    imported: Any = casadi.DaeBuilder("record", str(path))
    kinds = [list(getattr(imported, kind)()) for kind in "xup"]
    x, u, p = (np.array(imported.start(found)) for found in kinds)
    t, unknown = casadi.MX.sym("t"), casadi.MX.sym("x", len(x))
    known = imported.create("f", ["t", "x", "u", "p"], ["ode"])
    settings = {"abstol": SHARPER * tolerance * 1e-3, "reltol": SHARPER * tolerance}
    problem = {"t": t, "x": unknown, "ode": known(t, unknown, u, p)}
    run = casadi.integrator("run", "cvodes", problem, 0.0, [float(time) for time in times[1:]], settings)
    states = np.vstack([x, np.array(casadi.DM(run(x0=x)["xf"]).full()).T])
    return np.column_stack([states[:, kinds[0].index(name)] for name in names])


IMPORTERS = (
    Importer("fmpy", "fmpy", "co-simulation", partial(_by_fmpy, "co-simulation")),
    Importer("fmpy", "fmpy", "model exchange", partial(_by_fmpy, "model-exchange")),
    Importer("libcosimpy", "libcosimpy", "co-simulation", _by_libcosim, versions=("2.0",)),
    Importer("casadi", "casadi", "model exchange", _by_casadi, events=False),
)


def run_by(importer: Importer, path: Path, tolerance: float, times: Floats, names: Sequence[str]) -> Floats:
    """The values (m, k) of ``names`` at ``times`` (m,) in s, run by ``importer``; NaN where it shows none.

    It runs in a process of its own, because importers may crash. ``tolerance`` is that of the FMU's experiment. Raises
    SimulationError with the importer's words if it cannot run the FMU.
    """
    try:
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            return pool.submit(importer.run, path, tolerance, times, names).result()
    except BrokenProcessPool:
        raise SimulationError(f"{importer.package} crashed while it ran '{path.name}'") from None
    except Exception as error:
        words = str(error).strip().splitlines() or [type(error).__name__]
        raise SimulationError(f"{importer.package} cannot run '{path.name}': {words[-1]}") from error
