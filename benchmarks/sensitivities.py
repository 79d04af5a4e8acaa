"""Derivatives through time: the variational equations of lag2fmu against CVODES' forward sensitivities by CasADi.

Run with `make bench` or `python -m benchmarks.sensitivities`. The double pendulum, 5 s: d states at the end / d 8
values (five parameters, two start angles, one start velocity). CasADi differentiates the same Lagrangian, and CVODES
integrates 8 forward sensitivities with error control; CasADi interprets its functions, which is how CVODES gets them
there. Each column is one tolerance. Errors are the greatest error of an entry relative to the greatest entry, against
central differences of runs at 1e-13; CPU time is the least of several runs, after compiling. The bar: less CPU time at
equal error.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from lag2fmu.studies.library import Study, StudyLibrary, compiled
from lag2fmu.studies.requests import scale_of

STOP = 5.0
PARAMETERS = ("m1", "m2", "l1", "l2", "g")
STARTS = ("theta1", "theta2", "theta1_dot")
STATES = ("theta1", "theta2", "theta1_dot", "theta2_dot")
REPEATS = 20


def best_time(run: Callable[[], Any]) -> float:
    """The least CPU time of a run in ms."""
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return 1e3 * min(times)


def values_of(library: StudyLibrary) -> dict[str, float]:
    """Parameters and starts of the model, in SI."""
    return {name: float(library.variables[name].start or 0.0) for name in (*PARAMETERS, *STATES)}


def reference(library: StudyLibrary) -> Any:
    """d states / d values, (4, 8), by differences with two extrapolations."""
    study, outputs, centre = Study(library), library.readable(STATES), values_of(library)

    def run(name: str, value: float) -> Any:
        given = {library.settable(name): value}
        return study.run(given, np.array([STOP]), outputs, tolerance=1e-13)[0][0]

    columns = []
    for name in (*PARAMETERS, *STARTS):
        h = 4e-4 * (abs(centre[name]) or 1.0)
        slopes = [(run(name, centre[name] + d) - run(name, centre[name] - d)) / (2 * d) for d in (h, h / 2, h / 4)]
        once = [(4 * b - a) / 3 for a, b in pairwise(slopes)]
        columns.append((16 * once[1] - once[0]) / 15)
    return np.stack(columns, axis=1)


def ours(library: StudyLibrary, tolerance: float) -> Callable[[], Any]:
    """A run of lag2fmu."""
    over = (*PARAMETERS, *STARTS)
    study, outputs, times = Study(library, len(over)), library.readable(STATES), np.array([STOP])
    seeds = [(library.settable(name), scale_of(library, name, {})) for name in over]
    return lambda: study.run({}, times, outputs, tolerance=tolerance, seeds=seeds)[1][0]


def cvodes(library: StudyLibrary, tolerance: float, method: str) -> Callable[[], Any]:
    """A run of CVODES with 8 forward sensitivities of (q, qd) by CasADi."""
    import casadi as ca

    q, qd, p = ca.SX.sym("q", 2), ca.SX.sym("qd", 2), ca.SX.sym("p", 5)
    m1, m2, l1, l2, g = (p[i] for i in range(5))
    x1, y1 = l1 * ca.sin(q[0]), -l1 * ca.cos(q[0])
    x2, y2 = x1 + l2 * ca.sin(q[1]), y1 - l2 * ca.cos(q[1])
    v1, v2 = (ca.jtimes(ca.vertcat(*r), q, qd) for r in ((x1, y1), (x2, y2)))
    kinetic = m1 / 2 * ca.dot(v1, v1) + m2 / 2 * ca.dot(v2, v2)
    lagrangian = kinetic - g * (m1 * y1 + m2 * y2)
    momenta = ca.gradient(lagrangian, qd)
    mass = ca.jacobian(momenta, qd)
    force = ca.gradient(lagrangian, q) - ca.jtimes(momenta, q, qd)
    x = ca.vertcat(q, qd)
    ode = {"x": x, "p": p, "ode": ca.vertcat(qd, ca.solve(mass, force))}
    options = {
        "reltol": tolerance, "abstol": tolerance, "linear_multistep_method": method, "fsens_err_con": True,
        "nonlinear_solver_iteration": "functional" if method == "adams" else "newton", "max_num_steps": 1_000_000,
    }  # fmt: skip
    integrator = ca.integrator("run", "cvodes", ode, 0.0, STOP, options)
    forward = integrator.forward(8)
    centre = values_of(library)
    x0 = ca.DM([centre[name] for name in STATES])
    p0 = ca.DM([centre[name] for name in PARAMETERS])
    nominal = integrator(x0=x0, p=p0)
    seeds = {"fwd_p": ca.horzcat(ca.DM.eye(5), ca.DM.zeros(5, 3))}
    seeds["fwd_x0"] = ca.horzcat(ca.DM.zeros(4, 5), ca.DM.eye(4)[:, :3])
    known = {f"out_{name}": nominal[name] for name in integrator.name_out()}
    return lambda: np.array(forward(x0=x0, p=p0, **known, **seeds)["fwd_xf"])


def main() -> None:
    """Measure and print."""
    exact = None
    print(f"{'':24s}" + "".join(f"{f'tolerance {t:g}':>30s}" for t in (1e-6, 1e-8, 1e-10)))
    rows: dict[str, Callable[[StudyLibrary, float], Callable[[], Any]]] = {
        "lag2fmu dop853": ours,
        "lag2fmu dopri5": ours,
        "CVODES Adams (CasADi)": lambda library, tolerance: cvodes(library, tolerance, "adams"),
        "CVODES BDF (CasADi)": lambda library, tolerance: cvodes(library, tolerance, "bdf"),
    }
    for label, make in rows.items():
        library = compiled("double_pendulum", solver="dopri5" if label.endswith("dopri5") else "dop853")
        exact = reference(compiled("double_pendulum")) if exact is None else exact
        cells = []
        for tolerance in (1e-6, 1e-8, 1e-10):
            run = make(library, tolerance)
            error = abs(run() - exact).max() / abs(exact).max()
            cells.append(f"{best_time(run):8.2f} ms, error {error:.1e}".rjust(30))
        print(f"{label:24s}" + "".join(cells))


if __name__ == "__main__":
    main()
