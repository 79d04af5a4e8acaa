"""Batches of runs against peers: double pendula, Lorenz's system, a six-axis arm, CasADi's external functions.

Run with ``make bench`` or ``python -m benchmarks.ensembles [--quick]``. What is compared is timed in turn, round after
round, in one thread by its CPU clock (rates of pools by their processes'); medians. Rates on two cores are by the
clock on the wall, and say something on a machine that does nothing else. Errors are the medians over the runs of the
greatest error of a state at the end, against dop853 at a tolerance of 1e-13. Peers that are not installed are reported.
"""

from __future__ import annotations

import argparse
import ctypes
import importlib
import statistics
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from benchmarks.cases import case
from benchmarks.peers import casadi_function, mjcf_of
from benchmarks.running import KERNELS
from lag2fmu import Ensemble, export, simulate
from lag2fmu.ensemble import StateFunction
from lag2fmu.fmu.compilers import compile_here

Floats = NDArray[np.float64]
PENDULUM = ("theta1", "theta2", "theta1_dot", "theta2_dot")
STOP = 10.0
"""s; of the double pendulum."""
GRAVITY = 9.81
LORENZ = """
[mechanism]
name = "lorenz"
title = "Lorenz's equations beside a body that rests"
source = "E. N. Lorenz, Deterministic nonperiodic flow, J. Atmos. Sci. 20 (1963) 130-141"
[parameters]
m = { value = 1.0, unit = "kg" }
sigma = { value = 10.0 }
rho = { value = 21.0 }
beta = { expression = "8/3" }
[coordinates]
rest = { start = 0.0 }
[energy]
kinetic = "m*rest_dot**2/2"
[states]
x = { start = 1.0, derivative = "sigma*(y - x)", nominal = 1.0 }
y = { start = 0.0, derivative = "x*(rho - z) - y", nominal = 1.0 }
z = { start = 0.0, derivative = "x*y - beta*z", nominal = 1.0 }
"""
MOST_ON_ALL_CORES = 1.33e6
"""Trajectories of Lorenz's system a second, of DiffEqGPU on all cores of its CPU: U. Utkarsh and others, Automated
translation and accelerated solving of differential equations on multiple GPU platforms, Comput. Methods Appl. Mech.
Eng. 419 (2024)."""


def main() -> None:
    """Measure and print all tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer runs and rounds")
    quick = parser.parse_args().quick
    rounds, scale = (3, 0.1) if quick else (7, 1.0)
    tables: list[Callable[[], Table]] = [
        lambda: pendula(int(1e5 * scale), rounds),
        lambda: lorenz(int(4e5 * scale), rounds),
        lambda: arm(rounds),
        lambda: externals(rounds),
    ]
    for table in tables:
        Console(width=150).print(table())


def in_turn(actions: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """The median CPU time (s) of this thread in each of ``actions`` {name: what}, one after another in each round."""
    times: dict[str, list[float]] = {name: [] for name in actions}
    for _ in range(rounds):
        for name, action in actions.items():
            begun = time.thread_time()
            action()
            times[name].append(time.thread_time() - begun)
    return {name: statistics.median(values) for name, values in times.items()}


def optional(name: str) -> Any:
    """The package ``name``, or None where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


# ----------------------------------------------------------------------------------------------------- double pendula


def pendula(runs: int, rounds: int) -> Table:
    """10 s of double pendula from different starts: lanes, the FMU's runtime, importers and peers."""
    angles = np.random.default_rng(0).uniform(-1.0, 1.0, runs)
    few, part = angles[: max(8, runs // 1000)], angles[: runs // 10]
    models = {name: Ensemble("double_pendulum", solver=name) for name in ("dopri5", "dop853")}
    scalar = Ensemble("double_pendulum", solver="dopri5", lanes=0)
    exact = _finals(models["dop853"], part, 1e-13)
    found: dict[str, tuple[Callable[[], object], int, float]] = {}

    def add(name: str, action: Callable[[Floats], Floats], starts: Floats) -> None:
        error = _error(action(starts), exact[: len(starts)])
        found[name] = (lambda: action(starts), len(starts), error)

    add("lanes, dopri5, 1e-6", lambda a: _finals(models["dopri5"], a, 1e-6), part)
    add("the FMU's runtime in C, 1e-6", lambda a: _finals(scalar, a, 1e-6), few)
    with tempfile.TemporaryDirectory() as folder:
        fmu = export("double_pendulum", Path(folder) / "pendulum.fmu", solver="dopri5")
        add("one FMU in a loop of simulate, 1e-6", lambda a: _looped(fmu, a), few)
        heyoka = optional("heyoka")
        if heyoka is not None:
            batch = _heyoka(heyoka)
            for tolerance in (1e-4, 1e-5, 1e-6, 1e-8):
                add(f"heyoka batch, {tolerance:g}", lambda a, t=tolerance: batch(a, t), part)  # type: ignore[misc]
                target = found[f"heyoka batch, {tolerance:g}"][2]
                _at_equal_error(models, part, exact, target, f"lanes, as heyoka {tolerance:g}", add)
        seconds = in_turn({name: action for name, (action, _, _) in found.items()}, rounds)
    table = Table("10 s of a double pendulum", "us a run and core", "runs a second and core", "error", box=None)
    for name, (_, count, error) in found.items():
        each = seconds[name] / count
        table.add_row(name, f"{1e6 * each:.2f}", f"{1.0 / each:.0f}", f"{error:.1e}")
    _pooled(table, few, exact)
    _by_fmpy_pooled(table, few, exact)
    _on_two_cores(table, models["dopri5"], angles, rounds)
    table.add_row("bar", "8 times one FMU in a loop; faster than heyoka's batch at equal error", "", "")
    return table


def _finals(model: Ensemble, angles: Floats, tolerance: float) -> Floats:
    """The states at the end, (runs, 4)."""
    runs = model.run(starts={"theta1": angles}, stop_time=STOP, tolerance=tolerance, threads=1)
    return np.stack([runs.final[name] for name in PENDULUM], axis=1)


def _error(finals: Floats, exact: Floats) -> float:
    return float(np.median(np.abs(finals - exact).max(axis=1)))


def _at_equal_error(
    models: Mapping[str, Ensemble],
    angles: Floats,
    exact: Floats,
    target: float,
    name: str,
    add: Callable[[str, Callable[[Floats], Floats], Floats], None],
) -> None:
    """Add the faster one of the solvers at the loosest tolerance at which its error is no more than ``target``."""
    candidates = []
    for solver, model in models.items():
        for exponent in np.arange(3.0, 13.0, 0.25):
            begun = time.thread_time()
            error = _error(_finals(model, angles, 10.0**-exponent), exact)
            if error <= target:
                candidates.append((time.thread_time() - begun, solver, 10.0**-exponent))
                break
    _, solver, tolerance = min(candidates)
    add(f"{name}: {solver}, {tolerance:.1e}", lambda a: _finals(models[solver], a, tolerance), angles)


def _looped(fmu: Any, angles: Floats) -> Floats:
    runs = [simulate(fmu, stop_time=STOP, step=STOP, tolerance=1e-6, values={"theta1": float(a)}) for a in angles]
    return np.array([[run[name][-1] for name in PENDULUM] for run in runs])


def _rates(t: float, x: Floats) -> list[float]:
    """The equations by hand, masses and lengths 1."""
    a, b, v, w = x
    c, s = np.cos(a - b), np.sin(a - b)
    return [
        v,
        w,
        (-s * (w * w + v * v * c) - GRAVITY * (2.0 * np.sin(a) - np.sin(b) * c)) / (2.0 - c * c),
        (s * (2.0 * v * v + w * w * c) + 2.0 * GRAVITY * (np.sin(a) * c - np.sin(b))) / (2.0 - c * c),
    ]


def _heyoka(heyoka: Any) -> Callable[[Floats, float], Floats]:
    """Heyoka's Taylor method on the same equations, in batches of what it recommends."""
    a, b, v, w = heyoka.make_vars("a", "b", "v", "w")
    c, s = heyoka.cos(a - b), heyoka.sin(a - b)
    first = (-s * (w * w + v * v * c) - GRAVITY * (2.0 * heyoka.sin(a) - heyoka.sin(b) * c)) / (2.0 - c * c)
    second = (s * (2.0 * v * v + w * w * c) + 2.0 * GRAVITY * (heyoka.sin(a) * c - heyoka.sin(b))) / (2.0 - c * c)
    equations = [(a, v), (b, w), (v, first), (w, second)]
    size = heyoka.recommended_simd_size()
    made: dict[float, Any] = {}

    def run(angles: Floats, tolerance: float) -> Floats:
        if tolerance not in made:
            made[tolerance] = heyoka.taylor_adaptive_batch(equations, state=np.zeros((4, size)), tol=tolerance)
        taylor, finals = made[tolerance], np.empty((len(angles), 4))
        for i in range(0, len(angles) - size + 1, size):
            taylor.state[0], taylor.state[1], taylor.state[2:] = angles[i : i + size], -0.3, 0.0
            taylor.set_time(0.0)
            taylor.propagate_until(STOP)
            finals[i : i + size] = taylor.state.T
        rest = len(angles) % size
        if rest:
            finals[-rest:] = run(angles[-size:], tolerance)[-rest:]
        return finals

    return run


def _by_scipy(angle: float) -> tuple[Floats, float]:
    from scipy.integrate import solve_ivp

    begun = time.process_time()
    run = solve_ivp(_rates, (0.0, STOP), [angle, -0.3, 0.0, 0.0], method="RK45", rtol=1e-6, atol=1e-6)
    return run.y[:, -1], time.process_time() - begun


def _pooled(table: Table, angles: Floats, exact: Floats) -> None:
    """SciPy in a pool of processes, and CasADi's map over its integrator."""
    with ProcessPoolExecutor(2) as pool:
        finals, seconds = zip(*pool.map(_by_scipy, angles.tolist()), strict=True)
    each = statistics.median(seconds)
    error = _error(np.array(finals), exact[: len(angles)])
    table.add_row("SciPy's RK45 in a pool, 1e-6", f"{1e6 * each:.0f}", f"{1.0 / each:.0f}", f"{error:.1e}")
    ca = optional("casadi")
    if ca is None:
        return
    x = ca.SX.sym("x", 4)
    a, b, v, w = (x[i] for i in range(4))
    c, s = ca.cos(a - b), ca.sin(a - b)
    first = (-s * (w * w + v * v * c) - GRAVITY * (2.0 * ca.sin(a) - ca.sin(b) * c)) / (2.0 - c * c)
    second = (s * (2.0 * v * v + w * w * c) + 2.0 * GRAVITY * (ca.sin(a) * c - ca.sin(b))) / (2.0 - c * c)
    options = {"reltol": 1e-6, "abstol": 1e-6}
    integrator = ca.integrator("run", "cvodes", {"x": x, "ode": ca.vertcat(v, w, first, second)}, 0.0, STOP, options)
    mapped = integrator.map(len(angles))
    starts = np.vstack([angles, np.full_like(angles, -0.3), np.zeros((2, len(angles)))])
    begun = time.thread_time()
    finals = np.array(mapped(x0=starts)["xf"]).T
    each = (time.thread_time() - begun) / len(angles)
    error = _error(finals, exact[: len(angles)])
    table.add_row("CasADi's map of CVODES, 1e-6", f"{1e6 * each:.0f}", f"{1.0 / each:.0f}", f"{error:.1e}")


def _by_fmpy(path: Path, angle: float) -> tuple[Floats, float]:
    from fmpy import simulate_fmu

    begun = time.process_time()
    options = {"stop_time": STOP, "output_interval": STOP, "relative_tolerance": 1e-6, "output": PENDULUM}
    run = simulate_fmu(str(path), start_values={"theta1": angle}, **options)
    return np.array([run[name][-1] for name in PENDULUM]), time.process_time() - begun


def _by_fmpy_pooled(table: Table, angles: Floats, exact: Floats) -> None:
    """Fmpy in a pool of processes, each run with the FMU unpacked and loaded anew."""
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(2) as pool:
        path = Path(folder) / "pendulum.fmu"
        export("double_pendulum", path, solver="dopri5")
        finals, seconds = zip(*pool.map(partial(_by_fmpy, path), angles.tolist()), strict=True)
    each = statistics.median(seconds)
    error = _error(np.array(finals), exact[: len(angles)])
    table.add_row("fmpy in a pool, 1e-6", f"{1e6 * each:.0f}", f"{1.0 / each:.0f}", f"{error:.1e}")


def _on_two_cores(table: Table, model: Ensemble, angles: Floats, rounds: int) -> None:
    times = []
    for _ in range(rounds):
        begun = time.perf_counter()
        model.run(starts={"theta1": angles}, stop_time=STOP, tolerance=1e-6, threads=2)
        times.append(time.perf_counter() - begun)
    each = statistics.median(times) / len(angles)
    name = f"lanes, dopri5, 1e-6: {len(angles)} on two cores, by the clock on the wall"
    table.add_row(name, f"{1e6 * each:.2f} a run", f"{1.0 / each:.0f} a second", "")


# ------------------------------------------------------------------------------------------------- Lorenz's equations


def lorenz(runs: int, rounds: int) -> Table:
    """1 s of Lorenz's equations for many parameters, states at the end, one thread."""
    rho = np.linspace(0.0, 21.0, runs)
    table = Table("1 s of Lorenz's equations, adaptive", "tolerance", "runs a second and core", "steps", box=None)
    for solver in ("dopri5", "dop853"):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "lorenz.toml")
            file.write_text(LORENZ, "utf-8")
            model = Ensemble(file, solver=solver)
        for tolerance in (1e-6, 1e-8):
            asked = {"parameters": {"rho": rho}, "stop_time": 1.0, "max_step": np.inf, "tolerance": tolerance}
            steps = model.run(**asked, threads=1).steps.mean()
            each = in_turn({"": lambda: model.run(**asked, threads=1)}, rounds)[""] / runs  # noqa: B023
            table.add_row(solver, f"{tolerance:g}", f"{1.0 / each:.0f}", f"{steps:.0f}")
    table.add_row("bar: DiffEqGPU, all cores of its CPU together", "", f"{MOST_ON_ALL_CORES:.0f}", "")
    return table


# ----------------------------------------------------------------------------------------------------- six-axis arm


def arm(rounds: int, runs: int = 512, steps: int = 200) -> Table:
    """Fixed steps of 1 ms of the spatial arm S6, RK4 in lanes and MuJoCo's rollout."""
    chosen = case("S6")
    mechanism = chosen.mechanism()
    model = Ensemble(mechanism, solver="rk4")
    names = [c.name for c in mechanism.coordinates]
    q = np.random.default_rng(0).uniform(-0.5, 0.5, (runs, len(names)))
    starts = {name: q[:, i] for i, name in enumerate(names)}
    actions: dict[str, Callable[[], object]] = {
        "lanes, rk4": lambda: model.run(starts=starts, stop_time=steps * 1e-3, step=1e-3, threads=1)
    }
    finals = {"lanes, rk4": np.stack([actions["lanes, rk4"]().final[name] for name in names], axis=1)}  # type: ignore[attr-defined]
    if optional("mujoco") is not None:
        for integrator in ("RK4", "Euler"):
            roll = _rollout(mjcf_of(chosen), integrator, q, steps)
            actions[f"MuJoCo's rollout, {integrator}"] = roll
            finals[f"MuJoCo's rollout, {integrator}"] = roll()
    seconds = in_turn(actions, rounds)
    table = Table("six-axis arm S6, steps of 1 ms", "steps a second and core", "furthest from the lanes", box=None)
    for name, time_of in seconds.items():
        apart = np.abs(finals[name] - finals["lanes, rk4"]).max()
        table.add_row(name, f"{runs * steps / time_of:.0f}", f"{apart:.1e}")
    return table


def _rollout(text: str, integrator: str, q: Floats, steps: int) -> Callable[[], Floats]:
    """MuJoCo's rollout of all runs in this thread; it returns the coordinates at the end, (runs, n)."""
    mujoco = importlib.import_module("mujoco")
    rollout = importlib.import_module("mujoco.rollout")
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = 1e-3
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    data = mujoco.MjData(model)
    n = model.nq
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states = np.zeros((len(q), size))
    states[:, 1 : n + 1] = q

    def run() -> Floats:
        found, _ = rollout.rollout(model, data, states, nstep=steps)
        return np.asarray(found)[:, -1, 1 : n + 1]

    return run


# -------------------------------------------------------------------------------------------------- CasADi's external


def externals(rounds: int, points: int = 4096) -> Table:
    """The external function and CasADi's own from the same Lagrangian, both in C by CasADi's interface, in one loop."""
    table = Table("CasADi: dx/dt of", "external, ns", "own, ns", "ratio", "bar", box=None)
    ca = optional("casadi")
    for name, bar in (("C8", 0.45), ("S6", 0.55), ("S7", 0.55)) if ca else ():
        chosen = case(name)
        f = StateFunction(chosen.mechanism())
        x = f.start["x"] + np.random.default_rng(0).uniform(-0.5, 0.5, (points, len(f.start["x"])))
        u, p = f.start["u"], f.start["p"]
        with tempfile.TemporaryDirectory() as folder:
            external = ctypes.CDLL(str(f.external(folder)))[f.mechanism.name]
            own = ctypes.CDLL(str(_own(ca, chosen, Path(folder)))).own
            loop = ctypes.CDLL(str(_loop(Path(folder)))).at_points
        actions = {
            "external": partial(_at_points, loop, external, [np.zeros(1), x, u, p], 1),
            "own": partial(_at_points, loop, own, [x, u, p], 0),
        }
        first, second = (action() for action in actions.values())
        assert np.abs(first - second).max() < 1e-6 * max(1.0, np.abs(second).max())
        each = [1e9 * seconds / points for seconds in in_turn(actions, 5 * rounds).values()]
        table.add_row(name, *(f"{ns:.0f}" for ns in each), f"{each[0] / each[1]:.2f}", f"{bar}")
    return table


def _at_points(loop: Any, function: Any, arguments: Sequence[Floats], moving: int) -> Floats:
    """The results of a function of CasADi's interface at all points of the argument that moves."""
    points, size = arguments[moving].shape
    results, work = np.empty((points, size)), np.empty(100_000)
    pointers = (ctypes.c_void_p * len(arguments))(*(array.ctypes.data for array in arguments))
    integers = (ctypes.c_longlong * 1000)()
    counts = (ctypes.c_longlong(points), ctypes.c_longlong(size))
    loop(function, pointers, moving, *counts, *map(_pointer, (results, work)), integers)
    return results


def _pointer(array: Floats) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def _own(ca: Any, chosen: Any, folder: Path) -> Path:
    """CasADi's own function dx/dt, with its LDL^T, generated and compiled with the same flags."""
    generator = ca.CodeGenerator("own.c", {"with_header": False})
    generator.add(casadi_function(ca, chosen, "own"))
    text = f'#define CASADI_SYMBOL_EXPORT __attribute__((visibility("default")))\n{generator.dump()}'
    library = folder / "own.so"
    library.write_bytes(compile_here({"own.c": text}, "own"))
    return library


def _loop(folder: Path) -> Path:
    library = folder / "loop.so"
    library.write_bytes(compile_here({"external.c": (KERNELS / "external.c").read_text("utf-8")}, "loop"))
    return library


if __name__ == "__main__":
    main()
