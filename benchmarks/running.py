"""Compiling, checking and timing kernels: ``void call(const double in[], double out[])``, see kernels/call.h."""

from __future__ import annotations

import ctypes
import math
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from benchmarks.cases import Case, Floats
from benchmarks.recursive import Given, inverse_and_mass

KERNELS = Path(__file__).parent / "kernels"
FLAGS = ("-O2", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno", "-w")


@dataclass(frozen=True)
class Source:
    """C text: the file of kernels/ that includes ``generated`` as generated.h, with macros and flags of its own.

    ``tolerance`` is the largest relative residual that passes; None for a kernel that is not checked. ``setup``: the
    numbers for a kernel that is told its case at run time (gravity, then 18 a coordinate); it is compiled only once.
    """

    kernel: str
    generated: str
    macros: Mapping[str, str] = field(default_factory=dict)
    flags: Sequence[str] = ()
    tolerance: float | None = 1e-8
    setup: Floats | None = None


@dataclass
class Kernel:
    """A kernel in memory, what it took to compile (CPU s), and its measured times (ns)."""

    run: Callable[[Floats, int, int], tuple[float, Floats]]
    compile_seconds: float
    times: list[float] = field(default_factory=list)
    repetitions: int = 1

    @property
    def median(self) -> float:
        """ns per call"""
        return float(np.median(self.times))


def compiler() -> tuple[str, ...]:
    """gcc if there is one, else the pinned zig."""
    return ("gcc",) if shutil.which("gcc") else (sys.executable, "-m", "ziglang", "cc")


def compile_kernel(case: Case, source: Source, folder: Path, label: str) -> Kernel:
    """Compile ``source`` in ``folder`` and load it; raises CalledProcessError with the compiler's output."""
    place = folder / case.name / label.replace(" ", "_").replace(",", "")
    place.mkdir(parents=True, exist_ok=True)
    (place / "generated.h").write_text(source.generated, "utf-8")
    library = place / "kernel.so"
    before = _children_seconds()
    if source.setup is None:
        _compile(case, source, place, library)
        return Kernel(loaded(library, folder), _children_seconds() - before)
    common = folder / f"{label.replace(' ', '_')}.so"
    if not common.exists():
        _compile(case, source, place, common)
    shutil.copy(common, library)
    gravity, rows = _pointer(source.setup[:3]), _pointer(source.setup[3:].copy())
    ctypes.CDLL(str(library)).setup(case.n, gravity, rows)
    return Kernel(loaded(library, folder), _children_seconds() - before)


def _compile(case: Case, source: Source, place: Path, library: Path) -> None:
    macros = {"CASE_N": str(case.n), "CASE_P": str(len(case.values)), **source.macros}
    command = compiler() if source.kernel.endswith(".c") else ("g++",)
    defines = [f"-D{name}={value}" for name, value in macros.items()]
    files = [str(KERNELS / source.kernel), f"-I{place}", f"-I{KERNELS}", "-o", str(library)]
    subprocess.run(
        [*command, *FLAGS, *defines, *files, *source.flags, "-lm"], check=True, capture_output=True, text=True
    )


def _pointer(array: Floats) -> object:
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def _children_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def loaded(library: Path, folder: Path) -> Callable[[Floats, int, int], tuple[float, Floats]]:
    """The function of a compiled kernel: (rows, entries of a result, repetitions) -> (ns per call, results)."""
    measure = _harness(folder).measure
    measure.restype = ctypes.c_double
    function = ctypes.cast(ctypes.CDLL(str(library)).call, ctypes.c_void_p)

    def run(rows: Floats, n: int, repetitions: int) -> tuple[float, Floats]:
        out = np.full((len(rows), n), np.nan)
        ns = measure(function, len(rows), rows.shape[1], _pointer(rows), n, _pointer(out), repetitions)
        return float(ns), out

    return run


def _harness(folder: Path) -> ctypes.CDLL:
    library = folder / "harness.so"
    if not library.exists():
        source = str(KERNELS / "harness.c")
        subprocess.run([*compiler(), "-O2", "-fPIC", "-shared", source, "-o", str(library)], check=True)
    return ctypes.CDLL(str(library))


# ------------------------------------------------------------------------------------------------------- rows, checks


def rows_of(case: Case) -> Floats:
    """The input rows (states, width) of kernels/call.h; qdd by a dense solve, random seeds."""
    x, Q = case.states()
    p = np.tile(np.array(list(case.values.values())), (len(x), 1))
    qdd = np.array([np.linalg.solve(M, b) for M, b in (equations_at(case, a, b) for a, b in zip(x, Q, strict=True))])
    seeds = np.random.default_rng(2).normal(size=(len(x), 3 * case.n + p.shape[1]))
    return np.ascontiguousarray(np.hstack([x, Q, p, qdd, seeds]))


def equations_at(case: Case, x: Floats, Q: Floats) -> tuple[Floats, Floats]:
    """M (n, n) and f (n,) of M qdd = f in floats, by the algorithms written by hand."""
    M, h = inverse_and_mass(case, Given(x[: case.n], x[case.n :], Q, case.values, math.sin, math.cos))
    return np.array(M, dtype=float), Q - np.array(h, dtype=float)


def residual(case: Case, rows: Floats, qdd: Floats) -> float:
    """The largest |M qdd - f| / (|M| |qdd| + |f|) over the rows (infinity norms); nan if something is not finite."""
    worst = 0.0
    n = case.n
    for row, a in zip(rows, qdd, strict=True):
        M, f = equations_at(case, row[: 2 * n], row[2 * n : 3 * n])
        size = np.abs(M).sum(axis=1).max() * np.abs(a).max() + np.abs(f).max()
        worst = float(np.maximum(worst, np.abs(M @ a - f).max() / size))
    return worst


def derivative_error(case: Case, rows: Floats, kernel: Kernel, derivative: Floats) -> float:
    """The derivatives of a kernel against central differences of the accelerations of another, relative."""
    n, width = case.n, len(case.values)
    step = 1e-6
    moved = []
    for sign in (1.0, -1.0):
        shifted = rows.copy()
        shifted[:, : 3 * n + width] += sign * step * rows[:, 4 * n + width :]
        moved.append(kernel.run(shifted, n, 1)[1])
    differences = (moved[0] - moved[1]) / (2 * step)
    scale = np.abs(differences).max(axis=1, keepdims=True)
    return float(np.max(np.abs(derivative - differences) / (scale + 1e-300)))


def time_interleaved(kernels: Mapping[str, Kernel], rows: Floats, n: int, rounds: int, budget: float = 4e6) -> None:
    """``rounds`` measurements of every kernel in turn, each of about ``budget`` ns; fills ``Kernel.times``."""
    for kernel in kernels.values():
        kernel.run(rows, n, 2)
        ns, _ = kernel.run(rows, n, 3)
        kernel.repetitions = max(1, int(budget / (ns * len(rows))))
    for _ in range(rounds):
        for kernel in kernels.values():
            kernel.times.append(kernel.run(rows, n, kernel.repetitions)[0])


def save(figure: Figure, path: Path) -> None:
    """Write a picture as SVG: text stays text, and equal pictures are equal files."""
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "lag2fmu"}):
        figure.savefig(path, metadata={"Date": None})
