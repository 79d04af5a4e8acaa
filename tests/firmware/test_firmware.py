"""Mechanisms in plain C: they move as their FMUs do, refuse what is wrong, and meet nothing in the program."""

from __future__ import annotations

import math
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bare import Bare, program
from compiling import COMPILERS, QUICK
from sympy import Max

from lag2fmu import export, simulate
from lag2fmu.errors import ExportError
from lag2fmu.fmu.firmware import firmware, write_folder
from lag2fmu.formats.loading import load
from lag2fmu.language.vocabulary import Smooth
from lag2fmu.mechanism import Energy, Experiment, coordinate, parameter
from lag2fmu.mechanism.record import Mechanism

pytestmark = pytest.mark.fmu

HEAP = {"malloc", "calloc", "realloc", "free", "printf", "snprintf", "fopen", "abort", "exit"}


def short(model: str, stop_time: float) -> Mechanism:
    """The bundled ``model`` with a shorter experiment."""
    mechanism = load(model)
    return replace(mechanism, experiment=replace(mechanism.experiment, stop_time=stop_time))


@pytest.mark.parametrize(
    ("model", "solver"),
    [
        ("cart_pole", "rk4"),
        ("cart_pole", "ros2"),
        ("four_bar_linkage", "gauss4"),
        ("slides_problem_5_massless", "rk4"),
        ("woodpecker", "moreau"),
    ],
)
def test_it_moves_as_the_fmu_does(model: str, solver: str, tmp_path: Path) -> None:
    """The same solver and the same steps, through another gate; main.c prints what the FMU has as outputs."""
    mechanism = short(model, 0.2)
    made = firmware(mechanism, solver=solver)
    printed = subprocess.run([program(made.files, tmp_path, *QUICK)], capture_output=True, text=True, check=True)
    names, *lines = printed.stdout.splitlines()
    rows = np.array([line.split(",") for line in lines], float)
    fmu = export(mechanism, tmp_path / "it.fmu", solver=solver, page="static")
    run = simulate(fmu, step=made.bound.longest)
    columns = [list(run.names).index(name) for name in names.split(",")[1:]]
    expected = np.asarray(run.values)[:, columns]
    assert len(rows) == len(expected) > 10
    scale = np.abs(expected).max(axis=0) + 1e-9
    assert (np.abs(rows[:, 1:] - expected) / scale).max() < (1e-4 if model == "woodpecker" else 1e-9)
    assert np.ptp(rows[:, 1:], axis=0).max() > 1e-3


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> Bare:
    """A pendulum that has not begun, in memory that begins at an odd address."""
    return Bare(firmware("pendulum").files, tmp_path_factory.mktemp("pendulum"), shift=5)


def test_what_is_wrong_is_a_status(pendulum: Bare) -> None:
    """And nothing moves, nothing is set, nothing is written."""
    it = pendulum
    assert it.init(None, it.size) is None
    assert it.init(it.it, it.size - 1) is None
    assert it.step(0.01) == it.status("NOT_NOW")
    assert it.get("theta_ddot") == (it.status("NOT_NOW"), -1.0)
    assert it.set("theta", math.nan) == it.status("NO_VALUE")
    assert it.set("total_energy", 1.0) == it.set(-1, 1.0) == it.set(10**6, 1.0) == it.status("NO_VARIABLE")
    assert it.start(math.inf) == it.status("NO_VALUE")
    assert it.set("theta", 0.5) == it.start(2.0) == 0
    assert (
        it.start(0.0) == it.set("theta", 0.1) - it.status("NO_VARIABLE") + it.status("NOT_NOW") == it.status("NOT_NOW")
    )
    for step in (0.0, -0.01, math.nan, math.inf, 0.02):
        assert it.step(step) == it.status("NO_STEP")
    assert it.time == 2.0
    assert it.get("theta") == (0, 0.5)
    assert it.set("Q_theta", math.inf) == it.status("NO_VALUE")
    assert it.step(0.01) == it.step(0.004) == 0
    assert it.time == pytest.approx(2.014, abs=1e-12)
    assert it.get("theta")[1] < 0.5
    assert it.get(-5) == it.get(10**6) == (it.status("NO_VARIABLE"), -1.0)


def test_a_parameter_has_its_range(tmp_path: Path) -> None:
    it = Bare(firmware("elastic_pendulum").files, tmp_path)
    before = it.get("l0")
    assert it.set("l0", -1.0) == it.status("NO_VALUE")
    assert it.get("l0") == before


def test_inputs_and_parameters_act(tmp_path: Path) -> None:
    it = Bare(firmware("spring_mass_damper").files, tmp_path)
    assert it.set("x", 0.0) == it.start() == it.set("Q_x", 3.0) == 0
    status, acceleration = it.get("x_ddot")
    assert status == 0
    assert acceleration == pytest.approx(3.0 / it.get("m")[1], rel=1e-12)


def test_times_do_not_drift_and_float_has_no_end(tmp_path: Path) -> None:
    """A million steps of float: 0.01 s are still 0.01 s, which the time itself does not tell any more."""
    it = Bare(firmware("spring_mass_damper", real="float", values={"c": 0.0}).files, tmp_path)
    assert it.start(2.0e5) == 0
    first = it.get("x")[1]
    amplitudes = []
    for _ in range(2000):
        assert it.step(0.01) == 0
        amplitudes.append(it.get("x")[1])
    assert it.time == pytest.approx(2.0e5 + 20.0, rel=1e-6)
    assert max(amplitudes) == pytest.approx(abs(first), rel=1e-2)
    assert min(amplitudes) < 0


@pytest.mark.parametrize(
    ("model", "worst"), [("cart_pole", 1e-4), ("six_axis_arm", 1e-3), ("heavy_top_quaternion", 1e-3)]
)
def test_float_is_near_double(model: str, worst: float, tmp_path: Path) -> None:
    """No number of type double is left in it: the compiler tells where one is made."""
    final = []
    for real in ("double", "float"):
        (folder := tmp_path / real).mkdir()
        made = firmware(short(model, 1.0), real=real, own_math=True)
        options = ("-DMAIN_SILENT", *(("-Wdouble-promotion",) if real == "float" else ()))
        files = made.files | {"main.c": made.files["main.c"].replace("%.9g", "%.6g")}
        if real == "float":
            text = re.sub(r"/\*.*?\*/", "", made.files[f"{model}.c"], flags=re.DOTALL)
            assert re.search(r"\bdouble\b", text) is None
        printed = subprocess.run(
            [program(files, folder, *QUICK, options=options)], capture_output=True, text=True, check=True
        )
        final.append(np.array(printed.stdout.splitlines()[-1].split(","), float))
    error = np.abs(final[1] - final[0]) / (1 + np.abs(final[0]))
    assert 0 < error.max() < worst


def test_a_power_that_rests_at_0_in_float(tmp_path: Path) -> None:
    """A mass that flies off a spring of Hertz: x = 0.1 + t; ros2 needs the derivative of max(0, -x)**n at 0, too."""
    x, n = coordinate("x", start=0.1, velocity=1.0), parameter("n", 1.5)
    spring = {x: 100 * Smooth(Max(0, -x)) ** n}
    energy, experiment = Energy(x.dot**2 / 2), Experiment(stop_time=0.5)
    mechanism = Mechanism("hertz", coordinates=[x], parameters=[n], energy=energy, forces=spring, experiment=experiment)
    made = firmware(mechanism, solver="ros2", real="float")
    printed = subprocess.run([program(made.files, tmp_path, *QUICK)], capture_output=True, text=True, check=True)
    assert float(printed.stdout.splitlines()[-1].split(",")[1]) == pytest.approx(0.6, abs=1e-5)


def test_contacts_in_float(tmp_path: Path) -> None:
    """A woodpecker, of which impacts and friction obey their laws to the digits that float has."""
    made = firmware(short("woodpecker", 0.3), real="float", own_math=True)
    printed = subprocess.run([program(made.files, tmp_path, *QUICK)], capture_output=True, text=True, check=True)
    rows = np.array([line.split(",") for line in printed.stdout.splitlines()[1:]], float)
    assert len(rows) == 601
    assert np.isfinite(rows).all()


@pytest.mark.parametrize("model", ["sliding_sphere", "stack_of_blocks"])
def test_laws_have_the_memory_that_they_need(model: str, tmp_path: Path) -> None:
    """With more of it the motion is the same to the last bit."""
    printed = []
    made = firmware(short(model, 1.0), own_math=True)
    assert made.size < 150_000
    for options in ((), ("-DSMALL_LAWS=8000000",)):
        (folder := tmp_path / str(len(options))).mkdir()
        files = {name: text.replace(f"bytes[{made.size}]", "bytes[9000000]") for name, text in made.files.items()}
        run = program(files, folder, *QUICK, options=options)
        printed.append(subprocess.run([run], capture_output=True, text=True, check=True).stdout)
    assert printed[0] == printed[1]


def test_two_mechanisms_in_one_program_run_as_alone(tmp_path: Path) -> None:
    made = {model: firmware(short(model, 0.1)) for model in ("cart_pole", "newtons_cradle")}
    alone = []
    for model, one in made.items():
        (folder := tmp_path / model).mkdir()
        run = program(one.files, folder, *QUICK, options=("-DMAIN_SILENT",))
        alone.append(subprocess.run([run], capture_output=True, text=True, check=True).stdout)
    files = {"main.c": "int first(void); int second(void);\nint main(void) { return first() + second(); }\n"}
    for name, (model, one) in zip(("first", "second"), made.items(), strict=True):
        files |= {file: text for file, text in one.files.items() if file.startswith(model)}
        renamed = one.files["main.c"].replace("int main(void)", f"int {name}(void)")
        files[f"{name}.c"] = f"int {name}(void);\n{renamed}"
    run = program(files, tmp_path, *QUICK, options=("-DMAIN_SILENT",))
    assert subprocess.run([run], capture_output=True, text=True, check=True).stdout == "".join(alone)


@pytest.mark.skipif("gcc" not in COMPILERS, reason="no gcc: nm reads its objects")
@pytest.mark.parametrize("model", ["double_pendulum", "woodpecker"])
def test_it_calls_no_heap_and_prints_nothing_and_has_its_prefix(model: str, tmp_path: Path) -> None:
    """With own sines libm gives what is exact alone."""
    made = firmware(model, own_math=True, prefix="toy")
    for name in ("toy.c", "toy.h"):
        (tmp_path / name).write_text(made.files[name], "utf-8")
    subprocess.run(["gcc", "-std=c99", "-O2", "-ffp-contract=off", "-c", "toy.c"], cwd=tmp_path, check=True)
    table = subprocess.run(["nm", "toy.o"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    used = {line.split()[-1] for line in table.splitlines() if " U " in line}
    seen = {line.split()[-1] for line in table.splitlines() if re.search(r" [TDBRC] ", line)}
    assert not used & HEAP
    assert used <= {
        "memcpy",
        "memset",
        "memcmp",
        "memmove",
        "sqrt",
        "fmin",
        "fmax",
        "floor",
        "ceil",
        "frexp",
        "ldexp",
        "fmod",
    }
    assert len(seen) > 8
    assert all(name.startswith("toy_") for name in seen)


@pytest.mark.skipif("gcc" not in COMPILERS, reason="no gcc")
@pytest.mark.parametrize("model", ["four_bar_linkage", "woodpecker", "gripper"])
def test_gcc_has_no_warning(model: str, tmp_path: Path) -> None:
    """Optimised, which lets it see more."""
    program(firmware(model).files, tmp_path, "gcc", options=("-O2",))


@pytest.mark.parametrize(
    ("model", "options", "sentence"),
    [
        ("pendulum", {"solver": "dopri5"}, "as many steps as the error .* take rk4"),
        ("woodpecker", {"solver": "rk4"}, "nothing bounds how many of them come in a step; take moreau"),
        ("dc_motor", {}, "has conditions .* write smooth expressions"),
        ("pendulum", {"solver": "euler"}, "unknown solver 'euler'"),
        ("pendulum", {"step": math.nan}, "--step nan: expected a positive number"),
        ("pendulum", {"step": 0.0}, "--step 0: expected a positive number"),
        ("pendulum", {"step": 1e3}, "would have 1000000 solver steps; expected 1 to 10000"),
        ("pendulum", {"solver_steps": 0}, "--solver-steps 0: expected 1 to 10000"),
        ("pendulum", {"real": "half"}, "--real half: known are double, float"),
        ("pendulum", {"prefix": "2nd"}, "--prefix '2nd': expected a letter"),
        ("pendulum", {"prefix": "Main"}, r"--prefix 'Main': main\.c is the program"),
        ("pendulum", {"ram": -5}, "--ram -5: expected a positive number of bytes"),
        ("pendulum", {"ram": 100}, r"takes \d+ bytes, and --ram allows 100; take --real float"),
    ],
)
def test_refusals_name_the_remedy(model: str, options: dict, sentence: str) -> None:
    with pytest.raises(ExportError, match=sentence):
        firmware(model, **options)


def test_a_target_without_doubles_is_told_what_to_do(tmp_path: Path) -> None:
    short_double = "#include <float.h>\n#undef DBL_MANT_DIG\n#define DBL_MANT_DIG 24\n"
    files = {"short.h": short_double, **firmware("pendulum").files}
    with pytest.raises(AssertionError, match=r"double is shorter .* --real float"):
        program(files, tmp_path, *QUICK, options=("-include", "short.h"))


def test_a_folder_is_not_overwritten(tmp_path: Path) -> None:
    write_folder({"a.c": "one"}, tmp_path / "new" / "folder")
    with pytest.raises(ExportError, match=r"a\.c' exists; overwrite with --force"):
        write_folder({"b.c": "two", "a.c": "two"}, tmp_path / "new" / "folder")
    assert not (tmp_path / "new" / "folder" / "b.c").exists()
    write_folder({"a.c": "two"}, tmp_path / "new" / "folder", force=True)
    assert (tmp_path / "new" / "folder" / "a.c").read_text() == "two"
    (tmp_path / "file").touch()
    with pytest.raises(ExportError, match="cannot write to"):
        write_folder({"a.c": "one"}, tmp_path / "file")
