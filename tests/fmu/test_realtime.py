"""The profile for real time: steps with a bound, no memory after instantiation, contacts that never fail a step."""

from __future__ import annotations

import ctypes
import math
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from bare import Bare
from compiling import UNOPTIMISED, compiled
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException
from stepping import Stepping
from stepping3 import Stepping3

from lag2fmu import export, simulate
from lag2fmu.errors import ExportError
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import constant
from lag2fmu.fmu.deriving import derived
from lag2fmu.fmu.firmware import firmware
from lag2fmu.fmu.realtime import RealTime
from lag2fmu.formats.loading import load

pytestmark = pytest.mark.fmu


@pytest.mark.usefixtures("unoptimised")
def test_the_solver_is_one_of_fixed_steps(tmp_path: Path) -> None:
    fmu = export("pendulum", tmp_path / "pendulum.fmu", profile="realtime", page="static")
    assert fmu.description.solver == "rk4"
    massless, hybrid = (
        derived(load(model), None, bounded=True).solver for model in ("slides_problem_5_small", "bouncing_ball")
    )
    assert massless in ("rk4", "ros2")
    assert hybrid == "moreau"


@pytest.mark.usefixtures("unoptimised")
def test_longer_steps_are_discarded_and_shorter_ones_taken(tmp_path: Path) -> None:
    fmu = export("cart_pole", tmp_path / "it.fmu", profile="realtime", step=0.004, page="static")
    assert float(read_model_description(str(fmu.path)).defaultExperiment.stepSize) == 0.004  # 0.01 in the model
    with Stepping(fmu.path) as host:
        host.start()
        assert len(host.steps(3, 0.004)) == 3
        assert len(host.steps(1, 0.001)) == 1
        with pytest.raises(FMICallException, match="discard"):
            host.steps(1, 0.005)
        assert any("steps" in sentence for _, _, sentence in host.log)


@pytest.mark.usefixtures("unoptimised")
def test_what_is_no_step_or_no_input_is_a_status(tmp_path: Path) -> None:
    """Nothing moves, and a sentence tells why; FMI allows no further step after an error."""
    fmu = export("bouncing_ball", tmp_path / "it.fmu", profile="realtime", page="static")
    for step in (0.0, -0.01, math.nan, math.inf, -math.inf, 0.5):
        with Stepping(fmu.path) as host:
            host.start().steps(2, 0.01)
            before = host.get(host.states)
            with pytest.raises(FMICallException, match="discard" if step == 0.5 else "error"):
                host.unit.doStep(host.time, step)
            assert host.get(host.states) == before
            assert "step" in host.log[-1][2]
    for value in (math.nan, math.inf):
        with Stepping(fmu.path) as host:
            host.start()
            name = next(v.name for v in host.description.modelVariables if v.causality == "input")
            with pytest.raises(FMICallException, match="error"):
                host.set({name: value})
            assert name in host.log[-1][2]


@pytest.mark.usefixtures("unoptimised")
def test_what_is_no_step_or_no_input_is_an_error_of_fmi_3(tmp_path: Path) -> None:
    fmu = export("bouncing_ball", tmp_path / "it.fmu", profile="realtime", page="static", fmi="3.0")
    for step in (0.0, -0.01, math.nan, math.inf, 0.5):
        with Stepping3(fmu.path) as host:
            host.start()
            host.unit.doStep(0.0, 0.01)
            before = host.get(["y", "y_dot"])
            with pytest.raises(FMICallException, match="error"):
                host.unit.doStep(0.01, step)
            assert host.get(["y", "y_dot"]) == before
            assert "step" in host.log[-1][2]
    with Stepping3(fmu.path) as host:
        host.start()
        with pytest.raises(FMICallException, match="error"):
            host.set({"Q_y": math.nan})
        assert "Q_y" in host.log[-1][2]


@pytest.fixture(scope="module")
def cradles(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """FMUs of Newton's cradle by time stepping, without and with the profile."""
    folder = tmp_path_factory.mktemp("cradles")
    return [
        export("newtons_cradle", folder / f"{profile}.fmu", solver="moreau", page="static", profile=profile).path
        for profile in ("desktop", "realtime")
    ]


def test_it_moves_as_without_the_profile(cradles: list[Path]) -> None:
    """The profile bounds a step; within the bound it is the same solver with the same steps."""
    assert np.array_equal(*(simulate(path, stop_time=0.5).values for path in cradles))


def test_nothing_is_allocated_after_instantiation(tmp_path: Path) -> None:
    """An allocator that counts: one call for the instance, none for the steps of a stack that falls.

    The instance has the bytes that the report tells, and its name.
    """
    found = derived(load("stack_of_blocks"), None, bounded=True)
    _, sources = describe(
        found.mechanism, found.equations, found.program, found.solver, found.vibrations, realtime=RealTime()
    )
    counting = "#include <stdlib.h>\nextern int allocations;\nextern size_t allocated;\n"
    counting += "static inline void *counted(size_t n, size_t s) { allocations++; allocated += n * s; "
    counting += "return calloc(n, s); }\n#define calloc counted\n"
    counting += "#define malloc(size) counted(1, size)\n"
    counter = '__attribute__((visibility("default"))) int allocations;\n'
    counter += '__attribute__((visibility("default"))) __SIZE_TYPE__ allocated;\n'
    texts = {**sources, "counting.h": counting, "counter.c": counter}
    library = compiled(tmp_path, texts, options=("-include", "counting.h", *UNOPTIMISED["zig"]))
    guid = re.search(r'MODEL_GUID\[\] = "([^"]+)"', sources["tables.c"])[1]
    library.fmi2Instantiate.restype = ctypes.c_void_p
    callbacks = (ctypes.c_void_p * 5)()
    it = ctypes.c_void_p(library.fmi2Instantiate(b"one", 1, guid.encode(), None, callbacks, 0, 0))
    count = ctypes.c_int.in_dll(library, "allocations")
    assert count.value == 1
    headers = {file.name: file.read_text("utf-8") for file in fmi_headers().glob("fmi2*.h")}
    told = constant({**sources, **headers}, "life.h", "COMPONENT_SIZE")
    assert told < ctypes.c_size_t.in_dll(library, "allocated").value <= told + 16
    assert library.fmi2EnterInitializationMode(it) == library.fmi2ExitInitializationMode(it) == 0
    step = found.mechanism.experiment.step
    for i in range(50):
        assert library.fmi2DoStep(it, ctypes.c_double(i * step), ctypes.c_double(step), 1) == 0
    assert count.value == 1


def test_what_is_left_of_the_laws_is_projected_and_told_once(tmp_path: Path) -> None:
    """With no work for the laws a stack of blocks sinks, but no step fails and no speed grows."""
    made = firmware("stack_of_blocks")
    name = next(file for file in made.files if file.endswith(".c") and file != "main.c")
    code = made.files[name]
    for bound in ("MOST_ROUNDS", "MOST_FEW_STEPS"):
        code, count = re.subn(rf"(\b{bound} = (?:REAL_TIME \? )?)\d+", r"\g<1>0", code)
        assert count == 1
    poor = {**made.files, name: code}
    unsolved, energies = [], []
    for files in (made.files, poor):
        (folder := tmp_path / str(len(unsolved))).mkdir()
        it = Bare(files, folder)
        assert it.start() == 0
        for _ in range(100):
            assert it.step(made.bound.longest) == 0
        unsolved.append(bool(it.notices() & 1024))
        energies.append(it.get("kinetic_energy")[1])
    assert unsolved == [False, True]
    assert all(math.isfinite(energy) for energy in energies)
    assert energies[1] < 1e3 * (energies[0] + 1.0)


def test_the_fmu_says_what_it_takes(cradles: list[Path]) -> None:
    """In a file and on its page. An FMU without the profile says nothing."""
    plain, bounded = cradles
    with zipfile.ZipFile(plain) as archive:
        assert "extra/org.lag2fmu/realtime.md" not in archive.namelist()
        assert "In real time" not in archive.read("documentation/index.html").decode()
    with zipfile.ZipFile(bounded) as archive:
        text = archive.read("extra/org.lag2fmu/realtime.md").decode()
        page = archive.read("documentation/index.html").decode()
    (size,) = map(int, re.findall(r"^- memory of an instance: (\d+) bytes", text, re.MULTILINE))
    found = re.search(r"^\| (\S+) \| (\d+) \| (\d+) \| (\d+) \|$", text, re.MULTILINE)
    code, constants, stack = map(int, found.groups()[1:])
    assert code > constants > 1000 < stack < 1e5
    assert re.search(r"^\| MOST_\w+ \| \d+ \|$", text, re.MULTILINE)
    for number in (code, constants, stack):
        assert f">{number}</td>" in page
    assert f"memory of an instance: {size} bytes" in page


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"profile": "hard"}, "--profile hard: known are desktop, realtime"),
        ({"profile": "realtime", "solver": "dop853"}, "nothing bounds them in real time; take rk4"),
        ({"profile": "realtime", "backend": "python"}, "Python answers when it likes"),
        ({"profile": "realtime", "step": -1.0}, "--step -1: expected a positive number"),
        ({"profile": "realtime", "step": math.nan}, "--step nan: expected a positive number"),
        ({"step": 0.1}, "--step bounds the steps of --profile realtime"),
    ],
)
def test_refusals_name_the_remedy(options: dict, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=sentence):
        export("pendulum", tmp_path / "it.fmu", page="static", **options)
    assert not (tmp_path / "it.fmu").exists()
