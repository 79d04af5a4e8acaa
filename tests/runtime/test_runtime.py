"""The C runtime in templates/engine: compiled with strict flags, driven by a C host and by fmpy.

The mechanisms here are written by hand, in place of the generator: a double pendulum, and a motion that ends.
"""

import ctypes
import re
import subprocess
from fractions import Fraction
from pathlib import Path

import fmpy
import numpy as np
import pytest
from compiling import COMPILERS, UNOPTIMISED
from fmpy.fmi2 import FMU2Model, FMU2Slave
from scipy.integrate import solve_ivp

from lag2fmu.codegen import METHODS, TABLEAUS, Tableau
from lag2fmu.codegen.sources import engine_files
from lag2fmu.codegen.templates import render
from lag2fmu.fmu.translation_units import translation_units

HERE = Path(__file__).parent
HEADERS = Path(fmpy.__file__).parent / "c-code"
STRICT = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]
STRICT += ["-fvisibility=hidden", "-ffp-contract=off"]
SANITIZE = ["-O0", "-g", "-DARENA_ON_STACK", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
GUID = "{6c1e5f0a-0d6b-4b0e-8a55-3f1d3b7a9c01}"
HEUN = Tableau(
    solver="heun_euler",
    title="Heun's method with Euler's embedded",
    source="Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd edition, section II.4",
    order=2,
    a=((Fraction(0), Fraction(0)), (Fraction(1), Fraction(0))),
    b=(Fraction(1, 2), Fraction(1, 2)),
    embedded=(Fraction(1), Fraction(0)),
    embedded_order=1,
)
"""Adaptive, and the last stage is not the next step's first."""
SOLVERS = {"heun_euler": HEUN, "dopri5": TABLEAUS["dopri5"], "rk4": TABLEAUS["rk4"], "ros2": METHODS["ros2"]}
"""Those of collocation methods are compiled with the FMUs of tests/codegen."""


def build(target: Path, mechanism: str, solver: str, compiler: list[str], flags: list[str], extra: list[Path]) -> Path:
    """Compile the runtime with a mechanism and a solver; returns target, raises AssertionError with the messages."""
    method = SOLVERS[solver]
    variants = ("constraints", "massless", "events", "timed", "contacts", "located", "further", "tables", "observer")
    files = engine_files(method, dict.fromkeys(variants, False) | {"heap": True})
    files |= {
        name: render(f"mechanism/{name}.jinja", {"method": method, "program": {"resting": 0}})
        for name in method.generated_files
    }
    place = target.with_name(f"{solver}_sources")
    place.mkdir(exist_ok=True)
    units = translation_units(files)
    for name, text in {**files, **units}.items():
        (place / name).write_text(text, "utf-8")
    sources = [*(place / name for name in units), HERE / mechanism / "mechanism.c"]
    folders = [f"-I{folder}" for folder in (place, HERE / mechanism, HERE, HEADERS)]
    sizes = [f"-DSTAGES={method.all_stages}", f"-DDENSE_ROWS={method.dense_rows}"]
    command = [*compiler, *STRICT, *flags, *sizes, *folders, *map(str, sources + extra), "-lm", "-o", str(target)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return target


def run(program: Path) -> None:
    """Run a host program; it must leave with 0 and say nothing on standard error."""
    done = subprocess.run([str(program)], check=False, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""


def pendulum_sources() -> list[Path]:
    return [HERE / "host.c", *sorted(HERE.glob("checks_*.c"))]


def blow_up_sources() -> list[Path]:
    return [HERE / "host.c", HERE / "blow_up" / "checks.c"]


@pytest.mark.parametrize("compiler", COMPILERS)
def test_double_pendulum(compiler: str, tmp_path: Path) -> None:
    program = build(tmp_path / "host", "double_pendulum", "dopri5", COMPILERS[compiler], [], pendulum_sources())
    run(program)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("compiler", COMPILERS)
def test_motion_that_ends(compiler: str, solver: str, tmp_path: Path) -> None:
    flags = [*UNOPTIMISED[compiler]]
    run(build(tmp_path / "host", "blow_up", solver, COMPILERS[compiler], flags, blow_up_sources()))


if "gcc" in COMPILERS:  # zig has no runtime library for the address sanitizer

    @pytest.mark.slow
    def test_sanitized(tmp_path: Path) -> None:
        gcc = COMPILERS["gcc"]
        run(build(tmp_path / "a", "double_pendulum", "dopri5", gcc, SANITIZE, pendulum_sources()))
        for solver in SOLVERS:
            run(build(tmp_path / "b", "blow_up", solver, gcc, SANITIZE, blow_up_sources()))


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The double pendulum as a shared library, in the folders of an unpacked FMU."""
    folder = tmp_path_factory.mktemp("fmu")
    binary = folder / "binaries" / fmpy.platform / f"double_pendulum{fmpy.sharedLibraryExtension}"
    binary.parent.mkdir(parents=True)
    build(binary, "double_pendulum", "dopri5", COMPILERS["zig"], ["-shared", "-fPIC"], [])
    return folder


def test_exports_all_functions_of_the_standard_and_no_others(unpacked: Path) -> None:
    [binary] = unpacked.rglob(f"*{fmpy.sharedLibraryExtension}")
    library = ctypes.CDLL(str(binary))
    declared = (HEADERS / "fmi2Functions.h").read_text()
    names = set(re.findall(r"^#define (fmi2\w+) +fmi2FullName", declared, re.MULTILINE))
    assert len(names) == 44
    assert [name for name in sorted(names) if not hasattr(library, name)] == []
    inner = ["integrate", "mass_solve", "fail", "mechanism_dynamics", "VARIABLES", "TABLEAU", "instance_start"]
    assert [name for name in inner if hasattr(library, name)] == []


def instance(kind: type, unpacked: Path) -> FMU2Slave | FMU2Model:
    """An initialized instance in fmpy, from time 0 to 3 s with tolerance 1e-8."""
    fmu = kind(guid=GUID, unzipDirectory=str(unpacked), modelIdentifier="double_pendulum", instanceName="it")
    fmu.instantiate()
    fmu.setupExperiment(tolerance=1e-8, startTime=0.0, stopTime=3.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    return fmu


def reference(t: float, x: np.ndarray) -> np.ndarray:
    """dx/dt[4] of the double pendulum: the well-known closed form in absolute angles, no mass matrix."""
    m1, m2, l1, l2, g = 1.5, 0.75, 1.0, 0.6, 9.81
    d, w1, w2 = x[0] - x[1], x[2], x[3]
    denominator = l1 * (2 * m1 + m2 - m2 * np.cos(2 * d))
    a1 = -g * (2 * m1 + m2) * np.sin(x[0]) - m2 * g * np.sin(x[0] - 2 * x[1])
    a1 -= 2 * np.sin(d) * m2 * (w2**2 * l2 + w1**2 * l1 * np.cos(d))
    a2 = w1**2 * l1 * (m1 + m2) + g * (m1 + m2) * np.cos(x[0]) + w2**2 * l2 * m2 * np.cos(d)
    return np.array([w1, w2, a1 / denominator, 2 * np.sin(d) * a2 * l1 / (denominator * l2)])


def expected_end() -> np.ndarray:
    """The states[4] after 3 s."""
    start = [1.0, -0.5, 0.0, 0.25]
    return solve_ivp(reference, (0.0, 3.0), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]


def test_co_simulation_agrees_with_scipy(unpacked: Path) -> None:
    slave = instance(FMU2Slave, unpacked)
    for i in range(60):
        slave.doStep(currentCommunicationPoint=i * 0.05, communicationStepSize=0.05)
    assert slave.getReal([1, 2, 3, 4]) == pytest.approx(expected_end(), abs=1e-5)
    slave.terminate()
    slave.freeInstance()


def test_model_exchange_agrees_with_scipy(unpacked: Path) -> None:
    model = instance(FMU2Model, unpacked)
    model.newDiscreteStates()
    model.enterContinuousTimeMode()

    def derivative(t: float, x: np.ndarray) -> np.ndarray:
        """dx/dt[4] as model exchange answers it."""
        values, answer = (ctypes.c_double * 4)(*x), (ctypes.c_double * 4)()
        model.setTime(t)
        model.setContinuousStates(values, 4)
        model.getDerivatives(answer, 4)
        return np.array(answer)

    solution = solve_ivp(derivative, (0.0, 3.0), [1.0, -0.5, 0.0, 0.25], method="DOP853", rtol=1e-10, atol=1e-10)
    assert solution.y[:, -1] == pytest.approx(expected_end(), abs=1e-6)
    model.terminate()
    model.freeInstance()
