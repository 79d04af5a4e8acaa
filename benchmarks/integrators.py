"""Work and precision of the adaptive solvers in a C host, beside CVODE on the same equations.

The explicit ones run beside CVODE's Adams methods and Hairer and Wanner's dop853, the implicit one, on stiff problems,
beside CVODE's BDF and the same authors' radau5. PyDSTool carries their codes, dop853 in C, radau5 in Fortran.

Run with `make bench` or `python -m benchmarks.integrators [--folder FOLDER]`. CPU time is the median of several runs;
the error is that of the states at the end, relative to max(|x|, nominal). The bars: less CPU time than the peer at
equal error at 80 % of the errors 1e-3 ... 1e-11, nowhere more than 1.5 times; communication steps of 1 ms at tolerance
1e-6 at most 1.5 times one step.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fmpy.sundials.libraries import sundials_core
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table
from sympy import cos, sin, sqrt

from benchmarks.cases import Floats
from benchmarks.running import KERNELS, save
from lag2fmu.dynamics import derive, lower
from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import FLAGS
from lag2fmu.formats.loading import load, with_values
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Body, Damper, Energy, Mechanism, Spring, coordinate, parameter
from lag2fmu.reference import integrate

EXPLICIT = ("dopri5", "dop853")
IMPLICIT = ("radau5",)
ADAMS, BDF, DOP853, RADAU5 = "CVODE Adams", "CVODE BDF", "Hairer's dop853", "Hairer's radau5"
TOLERANCES = 10.0 ** -np.arange(2.0, 13.6, 0.5)
ERRORS = 10.0 ** -np.arange(3.0, 11.1, 1.0)
LIBRARIES = ("cvode", "nvecserial", "sunlinsoldense", "sunmatrixdense", "core")


@dataclass(frozen=True)
class Run:
    """CPU time (ns), evaluations of the equations, and the error at the end."""

    time: float
    evaluations: int
    error: float


# ----------------------------------------------------------------------------------------------------------- problems


def particles(name: str, masses: Sequence[float], places: Floats, velocities: Floats) -> Mechanism:
    """Particles in the plane that attract each other, G = 1; ``places`` and ``velocities`` (particles, 2)."""
    m = [parameter(f"m{i}", float(mass), "kg") for i, mass in enumerate(masses, 1)]
    G = parameter("G", 1.0, "m3/(kg.s2)", "constant of gravitation")
    q = [
        [coordinate(f"{axis}{i}", "m", start=x, velocity=v) for axis, x, v in zip("xy", *row, strict=True)]
        for i, row in enumerate(zip(places.tolist(), velocities.tolist(), strict=True), 1)
    ]
    pairs = [(i, j) for i in range(len(m)) for j in range(i)]
    potential = sum(-G * m[i] * m[j] / sqrt((q[i][0] - q[j][0]) ** 2 + (q[i][1] - q[j][1]) ** 2) for i, j in pairs)
    bodies = [Body(f"particle{i}", mass, place) for i, (mass, place) in enumerate(zip(m, q, strict=True), 1)]
    coordinates = [entry for place in q for entry in place]
    energy = Energy(potential=potential)
    return Mechanism(name, coordinates=coordinates, parameters=[*m, G], bodies=bodies, energy=energy)


def kepler(e: float = 0.9) -> Mechanism:
    """Kepler's problem of eccentricity ``e`` in Cartesian coordinates, period 2 pi s, from the perihelion."""
    x, y = coordinate("x", "m", start=1 - e), coordinate("y", "m", velocity=float(np.sqrt((1 + e) / (1 - e))))
    m, alpha = parameter("m", 1.0, "kg"), parameter("alpha", 1.0, "N.m2")
    field = Energy(potential=-alpha / sqrt(x**2 + y**2))
    return Mechanism("kepler_ellipse", coordinates=[x, y], parameters=[m, alpha], bodies=[Body("planet", m, (x, y))],
                     energy=field)  # fmt: skip


def pleiades() -> Mechanism:
    """Seven stars in the plane: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.10."""
    x, y = [3, 3, -1, -3, 2, -2, 2], [3, -3, 2, 0, 0, -4, 4]
    u, v = [0, 0, 0, 0, 0, 1.75, -1.5], [0, 0, 0, -1.25, 1, 0, 0]
    return particles("pleiades", range(1, 8), np.array([x, y], float).T, np.array([u, v], float).T)


def stiff_spring_damper() -> Mechanism:
    """A block whose motion decays with 100 /s and 9900 /s."""
    return with_values(load("spring_mass_damper"), {"k": 1e6, "c": 1e4})


def stiff_governor() -> Mechanism:
    """The rotating governor with rods that stretch a little, k = 1e7 N/m, and hinges that are damped."""
    m1, m2 = parameter("m1", 1.0, "kg"), parameter("m2", 2.0, "kg")
    l0, k, c = parameter("l0", 0.5, "m"), parameter("k", 1e7, "N/m"), parameter("c", 1e4, "N.s/m")
    d, Omega, g = parameter("d", 0.5, "N.m.s/rad"), parameter("Omega", 10.0, "rad/s"), parameter("g", 9.81, "m/s2")
    theta, length = coordinate("theta", "rad", start=0.7), coordinate("l", "m", start=0.5, nominal=0.5)
    r, z = length * sin(theta), -length * cos(theta)
    x, y = r * cos(Omega * TIME), r * sin(Omega * TIME)
    return Mechanism(
        "stiff_governor",
        coordinates=[theta, length],
        parameters=[m1, m2, l0, k, c, d, Omega, g],
        bodies=[Body("weight1", m1, (x, y, z)), Body("weight2", m1, (-x, -y, z)), Body("sleeve", m2, (0, 0, 2 * z))],
        springs=[Spring("rods", k, elongation=length - l0)],
        dampers=[Damper("rods", c, rate=length.dot), Damper("hinges", d, rate=theta.dot)],
        gravity=g,
    )


def flexible_slider_crank() -> Mechanism:
    """A crank that drives a slider through an elastic rod of 1e6 N/m, damped critically."""
    J, m, g = parameter("J", 0.1, "kg.m2"), parameter("m", 1.0, "kg"), parameter("g", 9.81, "m/s2")
    r, l0 = parameter("r", 0.15, "m"), parameter("l0", 0.4, "m")
    k, c = parameter("k", 1e6, "N/m"), parameter("c", 2e3, "N.s/m")
    phi, x = (
        coordinate("phi", "rad", start=0.3, velocity=20.0),
        coordinate("x", "m", start=0.15 * np.cos(0.3) + 0.3975, nominal=0.5),
    )
    length = sqrt((x - r * cos(phi)) ** 2 + (r * sin(phi)) ** 2)
    rate = length.diff(phi) * phi.dot + length.diff(x) * x.dot
    return Mechanism(
        "flexible_slider_crank",
        coordinates=[phi, x],
        parameters=[J, m, g, r, l0, k, c],
        bodies=[
            Body("crank", m / 2, (r / 2 * cos(phi), r / 2 * sin(phi)), angle=phi, inertia=J),
            Body("slider", m, (x, 0)),
        ],
        springs=[Spring("rod", k, elongation=length - l0)],
        dampers=[Damper("rod", c, rate=rate)],
        gravity=g,
    )


SMOOTH = {
    "double_pendulum": (lambda: load("double_pendulum"), 10.0),
    "kepler, e = 0.9": (kepler, 2 * np.pi),
    "pleiades": (pleiades, 3.0),
    "six_axis_arm": (lambda: load("six_axis_arm"), 2.0),
}
"""name: (mechanism, stop time in s)"""
STIFF = {
    "spring and damper": (stiff_spring_damper, 0.05),
    "governor, elastic rods": (stiff_governor, 1.0),
    "slider-crank, elastic rod": (flexible_slider_crank, 1.0),
    "Andrews' squeezer": (lambda: with_derived(load("andrews_squeezer")), 0.03),
}
"""The same; the last one has constraints and is stiff in name only."""
CLOSED = {"four-bar linkage": (lambda: with_derived(load("four_bar_linkage")), 1.5)}
"""The same, with a closed loop, for steps of 1 ms only."""
INTERLEAVED = 7
"""How often the runs that are compared with each other take turns."""
CONTESTS = {"smooth": (SMOOTH, EXPLICIT, (ADAMS, DOP853)), "stiff": (STIFF, IMPLICIT, (BDF, RADAU5))}
"""Kind of problem -> problems, solvers for them, and the peers."""
WHICH = {ADAMS: "adams", BDF: "bdf", DOP853: "dop853", RADAU5: "radau5"}
"""What benchmarks/kernels/integrators.c calls the peers."""
FORTRAN = ("radau5.f", "dc_lapack.f", "lapack.f", "lapackc.f")
"""The sources of radau5."""


# ------------------------------------------------------------------------------------------------------------ running


def codes() -> Path | None:
    """The folder of Hairer and Wanner's codes in the installed PyDSTool, found without importing it; None: nowhere."""
    try:
        files = importlib.metadata.files("PyDSTool") or ()
    except importlib.metadata.PackageNotFoundError:
        return None
    return next((Path(str(file.locate())).parent for file in files if file.name == "dop853.c"), None)


def missing(peer: str) -> str:
    """What ``peer`` lacks to be built, "" if nothing."""
    if peer in (DOP853, RADAU5) and codes() is None:
        return "PyDSTool, which carries it, is not installed"
    if peer == RADAU5 and shutil.which("gfortran") is None:
        return "gfortran is not installed"
    return ""


def build_codes(mechanism: Mechanism, place: Path) -> list[str]:
    """Arguments of gcc, run in ``place``, for those codes of Hairer and Wanner that can be built and integrate it."""
    arguments: list[str] = []
    folder = codes()
    if folder is not None and not mechanism.constraints:
        for file in ("dop853.c", "dop853.h"):  # copied: a memory.h beside them hides that of the C library
            shutil.copy(folder / file, place)
        arguments += ["-DDOP853", "dop853.c"]
    if folder is not None and not missing(RADAU5):
        shutil.copy(folder / "radau5.h", place)
        sources = [str(folder / name) for name in FORTRAN]
        subprocess.run(["gfortran", "-O2", "-std=legacy", "-w", "-c", *sources], cwd=place, check=True)
        arguments += ["-DRADAU5", *(Path(name).with_suffix(".o").name for name in FORTRAN), "-lgfortran"]
    return arguments


def build(mechanism: Mechanism, solver: str, folder: Path) -> Path:
    """The C host with the sources of ``mechanism``, compiled by gcc with the flags of an FMU."""
    equations = derive(mechanism)
    _, sources = describe(mechanism, equations, lower(equations), solver)
    place = folder / f"{mechanism.name}_{solver}"
    place.mkdir()
    for name, text in sources.items():
        (place / name).write_text(text, "utf-8")
    sundials = Path(sundials_core._name).parent
    links = [f"libsundials_{library}.so.7" for library in LIBRARIES]
    for library, link in zip(LIBRARIES, links, strict=True):
        (place / link).symlink_to(sundials / f"sundials_{library}.so")
    units = [name for name in sources if name.endswith(".c")]
    flags = [flag for flag in FLAGS if flag != "-fPIC"]
    linking = [f"-Wl,-rpath,{place}", "-Wl,--allow-shlib-undefined"]
    if not mechanism.constraints:  # with them evaluations are counted elsewhere
        linking.append("-Wl,--wrap=mechanism_accelerations")
    peers = build_codes(mechanism, place)
    command = ["gcc", *flags, "-I.", f"-I{fmi_headers()}", *units, str(KERNELS / "integrators.c"), *peers, *links]
    subprocess.run([*command, *linking, "-lm", "-o", "host"], cwd=place, check=True)
    return place / "host"


def call(host: Path, which: str, tolerance: float, stop: float, step: float, rounds: int) -> Floats:
    """Least and median CPU time (ns), evaluations, states (2n,) at the end."""
    command = [str(host), which, *map(repr, (float(tolerance), float(stop), float(step))), str(rounds)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return np.array(done.stdout.split(), float)


def exact_states(host: Path, mechanism: Mechanism, stop: float) -> Floats:
    """The states (2n,) at the end by dop853 at 1e-14; ends the benchmark if direct integration does not agree."""
    exact = call(host, "own", 1e-14, stop, stop, 1)[3:]
    reference = integrate(mechanism, [0.0, stop], rtol=1e-12)
    names = [c.name for c in mechanism.coordinates]
    expected = [reference.trajectory[name][-1] for name in [*names, *(f"{name}_dot" for name in names)]]
    difference = float((np.abs(exact - expected) / scales(mechanism, exact)).max())
    if difference > 1e-8:
        raise SystemExit(f"{mechanism.name}: the run at 1e-14 is {difference:.1e} off the direct integration")
    return exact


def scales(mechanism: Mechanism, states: Floats) -> Floats:
    """What errors of the states (2n,) are measured in."""
    return np.maximum(np.abs(states), [c.nominal for c in mechanism.coordinates] * 2)


def precision(host: Path, which: str, stop: float, exact: Floats, scale: Floats, rounds: int) -> list[Run]:
    """The runs over TOLERANCES; a peer that cannot reach a tolerance is left out there."""
    runs = []
    for tolerance in TOLERANCES:
        try:
            row = call(host, which, tolerance, stop, stop, rounds)
        except subprocess.CalledProcessError:
            continue
        runs.append(Run(row[1], int(row[2]), float((np.abs(row[3:] - exact) / scale).max())))
    return runs


def time_at(runs: Sequence[Run], error: float) -> float:
    """CPU time (ns) for this error, between the runs next to it in logarithms; nan outside of what they reach."""
    best: list[Run] = []
    for run in sorted(runs, key=lambda run: run.error):
        if not best or run.time < best[-1].time:  # the cheapest run that is at least that accurate
            best.append(run)
    logs = np.log([[run.error, run.time] for run in best])
    return float(np.exp(np.interp(np.log(error), logs[:, 0], logs[:, 1], left=np.nan)))


# ------------------------------------------------------------------------------------------------------------ showing


def plot(found: dict[str, dict[str, list[Run]]], path: Path) -> None:
    """CPU time over error, a picture a problem."""
    figure = Figure(figsize=(4 * len(found), 4), layout="constrained")
    for axes, (name, runs_of) in zip(figure.subplots(1, len(found)), found.items(), strict=True):
        for method, runs in runs_of.items():
            axes.loglog([run.error for run in runs], [run.time / 1e3 for run in runs], "o-", ms=3, label=method)
        axes.invert_xaxis()
        axes.set(xlabel="relative error at the end", ylabel="CPU time / us", title=name)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    save(figure, path)


def show_ratios(found: dict[str, dict[str, list[Run]]], method: str, peer: str, console: Console) -> None:
    """CPU time of ``method`` by that of ``peer`` at equal errors."""
    table = Table(title=f"CPU time of {method} / {peer} at equal error", title_justify="left")
    for heading in ("problem", *(f"{error:.0e}" for error in ERRORS)):
        table.add_column(heading, justify="right")
    ratios = np.array([[time_at(r[method], e) / time_at(r[peer], e) for e in ERRORS] for r in found.values()])
    for name, row in zip(found, ratios, strict=True):
        table.add_row(name, *(f"{ratio:.2f}" for ratio in row))
    console.print(table)
    known = ratios[np.isfinite(ratios)]
    console.print(f"below 1 at {np.mean(known < 1):.0%} of {known.size} points, at most {known.max():.2f}\n")


def in_turn(runs: dict[str, tuple[Path, str]], stop: float, rounds: int) -> dict[str, Floats]:
    """Median CPU times (ns) and evaluations of runs (host, which) at 1e-6: in one step, in steps of 1 ms, (2, 2)."""
    found: dict[str, list[Floats]] = {name: [] for name in runs}
    for _ in range(INTERLEAVED):
        for name, (host, which) in runs.items():
            both = [call(host, which, 1e-6, stop, step, rounds) for step in (stop, 1e-3)]
            found[name].append(np.array([row[1:3] for row in both]))
    return {name: np.median(rows, axis=0) for name, rows in found.items()}


def show_communication(hosts: dict[str, dict[str, Path]], console: Console, rounds: int) -> None:
    """Cost of communication steps of 1 ms beside one step, without and with all outputs read after each."""
    table = Table(title="communication steps of 1 ms beside one step, at 1e-6", title_justify="left")
    for heading in ("problem", "solver", "one step (us)", "ratio", "evaluations", "ns a step", "reading (ns a step)"):
        table.add_column(heading, justify="right")
    for name, (_, stop) in {**SMOOTH, **CLOSED}.items():
        runs = {m: (hosts[name][m], "own") for m in EXPLICIT} | {ADAMS: (hosts[name]["dop853"], WHICH[ADAMS])}
        reading = in_turn({m: (hosts[name][m], "read") for m in EXPLICIT}, stop, rounds)
        count = stop / 1e-3
        for method, (one, many) in in_turn(runs, stop, rounds).items():
            read = f"{(reading[method][1, 0] - one[0]) / count:.1f}" if method in reading else ""
            evaluations = f"{many[1] / one[1]:.2f}" if one[1] else ""
            cells = (f"{one[0] / 1e3:.0f}", f"{many[0] / one[0]:.2f}", evaluations, f"{(many[0] - one[0]) / count:.1f}")
            table.add_row(name, method, *cells, read)
    console.print(table)


def main() -> None:
    """Measure, print, plot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("build/benchmarks"), help="where the plots go")
    parser.add_argument("--rounds", type=int, default=21)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    console = Console(width=160)
    if sys.platform != "linux":
        raise SystemExit("this benchmark links fmpy's SUNDIALS on Linux only")
    hosts: dict[str, dict[str, Path]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for kind, (problems, methods, all_peers) in CONTESTS.items():
            peers = [peer for peer in all_peers if not missing(peer)]
            for peer in {*all_peers} - {*peers}:
                console.print(f"no comparison with {peer}: {missing(peer)}")
            found: dict[str, dict[str, list[Run]]] = {}
            for name, (make, stop) in problems.items():
                mechanism = make()
                hosts[name] = {s: build(mechanism, s, Path(folder)) for s in {*methods, "dop853"}}
                exact = exact_states(hosts[name]["dop853"], mechanism, stop)
                entrants = {m: (hosts[name][m], "own") for m in methods}
                entrants |= {peer: (hosts[name]["dop853"], WHICH[peer]) for peer in peers}
                found[name] = {
                    method: precision(*entrant, stop, exact, scales(mechanism, exact), options.rounds)
                    for method, entrant in entrants.items()
                }
            plot(found, options.folder / f"integrators_{kind}.svg")
            for peer in peers:
                for method in methods:
                    show_ratios(found, method, peer, console)
        for name, (make, _) in CLOSED.items():
            hosts[name] = {solver: build(make(), solver, Path(folder)) for solver in EXPLICIT}
        show_communication(hosts, console, options.rounds)


if __name__ == "__main__":
    main()
