"""Forward dynamics with constraints against CasADi's generated KKT solve, and the energy over many periods.

Run with ``make bench`` or ``python -m benchmarks.constraints [MODEL ...]``. CasADi gets T, V and the constraints of the
same mechanism, differentiates them by SX and solves [M G^T; G 0] by its LDL^T (in the order of the unknowns) or its QR,
generated as C and compiled with the same flags; redundant constraints, which it cannot solve, are left out for it. All
kernels of a model are timed in turn over 64 states near its start, by the thread's CPU clock; medians. The bar: at most
the time of the faster one. Energy: 500 periods of the fastest mode at tolerance 1e-10, within 1e-6 of max|T| + max|V|.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import sympy as sp
from rich.console import Console
from rich.table import Table

import lag2fmu
from benchmarks.cases import Case, Floats
from benchmarks.peers import casadi_text
from benchmarks.running import FLAGS, KERNELS, Kernel, Source, compile_kernel, compiler, loaded, time_interleaved
from lag2fmu.dynamics import EquationsOfMotion, derive, lower
from lag2fmu.dynamics.starts import start_values
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.formats.loading import load
from lag2fmu.graph.graph import Graph
from lag2fmu.graph.operations import CONSTANT, OPERATIONS, SYMBOL

MODELS = ("four_bar_linkage", "andrews_squeezer", "parallel_manipulator", "whipple_bicycle")
PERIODS, TOLERANCE = 500, 1e-10
CONSERVATIVE = {"heavy_top_quaternion": 2 * np.pi / 80.0, "slider_crank": 2 * np.pi / 150.0}
"""Model -> period (s) of its fastest motion at the start: the spin of the top, the turn of the crank."""

_SX = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "negate": lambda a: -a,
    "power": lambda a, b: a**b,
}


def ours(equations: EquationsOfMotion, folder: Path, harness: Path) -> Kernel:
    """The FMU's own path: the runtime's and the generated sources behind kernels/constrained.c."""
    _, sources = describe(equations.mechanism, equations, lower(equations), "dopri5")
    place = folder / "lag2fmu"
    place.mkdir()
    for name, text in sources.items():
        (place / name).write_text(text, "utf-8")
    units = [str(place / name) for name in sources if name.endswith(".c")]
    command = [*compiler(), *FLAGS, f"-I{place}", f"-I{fmi_headers()}", "-o", str(place / "kernel.so")]
    subprocess.run([*command, *units, str(KERNELS / "constrained.c"), "-lm"], check=True)
    return Kernel(loaded(place / "kernel.so", harness), 0.0)


def casadi_texts(equations: EquationsOfMotion) -> dict[str, str]:
    """{name of the solve: C text of the function f(x, Q, p) -> qdd} by CasADi."""
    m, c, v = equations.mechanism, equations.constraints, equations.variables
    n, names = len(m.coordinates), [p.name for p in m.parameters if p.value is not None]
    x, Q, p = ca.SX.sym("x", 2 * n), ca.SX.sym("Q", n), ca.SX.sym("p", len(names))
    q, qd = ca.SX.sym("q", n), ca.SX.sym("v", n)
    known: dict[int, Any] = dict(zip((*v.q, *v.qd), [*ca.vertsplit(q), *ca.vertsplit(qd)], strict=True))
    symbols = dict(zip(names, ca.vertsplit(p), strict=True))
    rows = independent(equations)
    holonomic = [k for k in rows if k < len(c.positions)]
    rolling = [k for k in rows if k >= len(c.positions)]
    nodes = [equations.energies["kinetic_energy"], equations.energies["potential_energy"]]
    nodes += [c.positions[k] for k in holonomic] + [c.velocities[k] for k in rolling]
    T, V, *values = translated(equations.graph, nodes, known, symbols)
    phi, slip = ca.vertcat(*values[: len(holonomic)]), ca.vertcat(*values[len(holonomic) :])
    momenta = ca.gradient(T, qd)
    h = ca.jtimes(momenta, q, qd) - ca.gradient(T, q) + ca.gradient(V, q)
    rate = ca.vertcat(ca.jtimes(phi, q, qd) if holonomic else ca.SX(0, 1), slip if rolling else ca.SX(0, 1))
    M, G, gamma = ca.jacobian(momenta, qd), ca.jacobian(rate, qd), ca.jtimes(rate, q, qd)
    K = ca.sparsify(ca.vertcat(ca.horzcat(M, G.T), ca.horzcat(G, ca.SX(len(rows), len(rows)))))
    right = ca.vertcat(Q + forces(equations, symbols) - h, -gamma)
    D, LT, order = ca.ldl(K, False)
    solutions = {"casadi ldl": ca.ldl_solve(right, D, LT, order), "casadi qr": ca.solve(K, right)}
    texts = {}
    for label, solution in solutions.items():
        result = ca.substitute([ca.densify(solution[:n])], [q, qd], [x[:n], x[n:]])
        texts[label] = casadi_text(ca, ca.Function("f", [x, Q, p], result, {"cse": True}))
    return texts


def translated(graph: Graph, nodes: Sequence[int], known: dict[int, Any], symbols: dict[str, Any]) -> list[Any]:
    """``nodes`` of our graph as SX; what is not known of the variables is 0."""
    found = dict(known)
    for node in graph.cone(list(nodes)):
        if node in found:
            continue
        if graph.code[node] == CONSTANT:
            found[node] = ca.SX(float(graph.value(node)))
        elif graph.code[node] == SYMBOL:
            found[node] = symbols.get(str(graph.leaf[node]), ca.SX(0))
        else:
            name = OPERATIONS[graph.code[node]].name
            function = _SX.get(name) or getattr(ca, name)
            found[node] = function(*(found[operand] for operand in graph.operands[node]))
    return [found[node] for node in nodes]


def forces(equations: EquationsOfMotion, symbols: dict[str, Any]) -> Any:
    """The forces on coordinates that are parameters or numbers, (n, 1)."""
    written = {force.coordinate: sp.sympify(force.expression) for force in equations.mechanism.forces}
    values = [written.get(q.name, sp.S.Zero) for q in equations.mechanism.coordinates]
    return ca.vertcat(*(symbols[str(value)] if value.is_Symbol else float(value) for value in values))


def independent(equations: EquationsOfMotion) -> list[int]:
    """The constraints that are independent of those before them at the start."""
    values, chosen = start_values(equations.mechanism), []
    G = np.array([equations.graph.evaluate(list(row), values) for row in equations.constraints.jacobian])
    G /= np.linalg.norm(G, axis=1, keepdims=True)
    for k in range(len(G)):
        if np.linalg.matrix_rank(G[[*chosen, k]], tol=1e-6) > len(chosen):
            chosen.append(k)
    return chosen


def rows_near_the_start(equations: EquationsOfMotion, number: int = 64) -> Floats:
    """Input rows (x, Q = 0, p, ...) of kernels/call.h, states off the start by a hundredth of the nominal values."""
    m, rng = equations.mechanism, np.random.default_rng(1)
    nominal = np.array([q.nominal for q in m.coordinates])
    start = np.array([[q.start for q in m.coordinates], [q.velocity for q in m.coordinates]])
    x = (start + 0.01 * nominal * rng.uniform(-1, 1, (number, 2, len(nominal)))).reshape(number, -1)
    p = np.tile([p.value for p in m.parameters if p.value is not None], (number, 1))
    rest = np.zeros((number, 4 * len(nominal) + p.shape[1]))  # qdd and seeds: not asked for
    return np.ascontiguousarray(np.hstack([x, np.zeros((number, len(nominal))), p, rest]))


def measure(model: str, folder: Path, rounds: int) -> list[str]:
    """The line of the table: medians in ns, the ratio to CasADi's better one, and how far the results are apart."""
    equations = derive(load(model))
    m = equations.mechanism
    n, values = len(m.coordinates), {p.name: p.value for p in m.parameters if p.value is not None}
    place = folder / model
    place.mkdir()
    kernels = {"lag2fmu": ours(equations, place, folder)}
    for label, text in casadi_texts(equations).items():
        stand_in = Case(model, n, "fixed", False, (), values)
        kernels[label] = compile_kernel(stand_in, Source("casadi.c", text), folder, label)
    rows = rows_near_the_start(equations)
    results = {label: kernel.run(rows, n, 1)[1] for label, kernel in kernels.items()}
    size = np.abs(results["lag2fmu"]).max()
    apart = max(np.abs(result - results["lag2fmu"]).max() / size for result in results.values())
    time_interleaved(kernels, rows, n, rounds)
    own, *peers = (kernel.median for kernel in kernels.values())
    sizes = f"{n}, {len(equations.constraints)}"
    return [model, sizes, *(f"{ns:.0f}" for ns in (own, *peers)), f"{own / min(peers):.2f}", f"{apart:.0e}"]


def energy(model: str, period: float, folder: Path) -> list[str]:
    """The greatest change of T + V over the run, relative to max|T| + max|V|."""
    fmu = lag2fmu.export(load(model), folder / f"{model}.fmu", outputs=("kinetic_energy", "potential_energy"))
    stop = PERIODS * period
    run = lag2fmu.simulate(fmu, stop_time=stop, step=period / 4, tolerance=TOLERANCE)
    T, V = run["kinetic_energy"], run["potential_energy"]
    drift = np.abs(T + V - T[0] - V[0]).max() / (np.abs(T).max() + np.abs(V).max())
    return [model, f"{stop:.4g}", f"{drift:.1e}", "1e-06"]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", default=list(MODELS))
    parser.add_argument("--rounds", type=int, default=25)
    options = parser.parse_args()
    speed = Table(title="accelerations with constraints, ns: medians of interleaved rounds", title_justify="left")
    for heading in ("model", "n, m", "lag2fmu", "casadi ldl", "casadi qr", "ratio (bar 1)", "apart"):
        speed.add_column(heading, justify="right")
    kept = Table(title=f"energy over {PERIODS} periods, tolerance {TOLERANCE:g}", title_justify="left")
    for heading in ("model", "time (s)", "change", "bar"):
        kept.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        for model in options.models:
            speed.add_row(*measure(model, Path(folder), options.rounds))
        for model, period in CONSERVATIVE.items():
            kept.add_row(*energy(model, period, Path(folder)))
    Console(width=120).print(speed)
    Console().print(kept)


if __name__ == "__main__":
    main()
