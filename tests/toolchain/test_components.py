"""Components for WebAssembly beside the same C code with the same mathematical library, and in Node by jco."""

from __future__ import annotations

import itertools
import json
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from components import SteppingComponent, component_of, exchange
from stepping3 import Stepping3

from lag2fmu.archives import unpack
from lag2fmu.building.process import zig
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import FLAGS, compiler_command
from lag2fmu.fmu.exporting import export
from lag2fmu.formats.loading import load

pytestmark = [pytest.mark.fmu, pytest.mark.toolchain]

FEW = frozenset({"bouncing_ball", "double_pendulum", "four_bar_linkage", "woodpecker"})
EQUAL, MOST_BYTES = 1e-12, 300_000
"""The relative difference that two mathematical libraries may make in the greatest value; the size of a component."""
KINDS = ("CoSimulation", "ModelExchange")
HERE = Path(__file__).parent
FURTHER = ("andrews_squeezer", "cart_pole", "free_body", "motion_driven_pendulum", "slides_problem_5_small")
"""Long code, inputs, quaternions, an input with its rate, and what has no mass."""
CHOSEN = [*sorted(FEW), *(pytest.param(name, marks=pytest.mark.all_models) for name in FURTHER)]
COUNT = {"CoSimulation": 50, "ModelExchange": 200}
"""Steps: by co-simulation through the experiment, by model exchange, with Euler's method, 1e-4 of it each."""


@pytest.fixture(scope="session")
def fmu_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """``fmu_of(model)``: its FMU, built once."""
    folder = tmp_path_factory.mktemp("components")
    return cache(lambda m: export(m, folder / f"{m}.fmu", fmi="3.0", platform="host,wasm", page="static").path)


@cache
def run_of(path: Path, model: str, kind: str) -> tuple[list[str], list[list[float]], bytes]:
    """What the hosts beside this file need to do the same run as wasmtime does here; its values and its last state."""
    stop = load(model).experiment.stop_time
    count, step = COUNT[kind], stop / (50 if kind == "CoSimulation" else 10_000)
    with SteppingComponent(path, kind) as wasm:
        reals = {v.valueReference for v in wasm.description.modelVariables if v.type == "Float64"}
        number = next(reference for reference in itertools.count() if reference not in reals)
        rows = rows_of(wasm, kind, step, count, number)
        arguments = [wasm.description.instantiationToken, kind, repr(step), str(count), str(number)]
        return arguments, rows, bytes(wasm.unit.getFMUState())


def rows_of(stepping: Stepping3, kind: str, step: float, count: int, number: int) -> list[list[float]]:
    """The first variables after each step of co-simulation, or states, derivatives and indicators (model exchange)."""
    stepping.start()
    if kind == "ModelExchange":
        return exchange(stepping, [i * step for i in range(count + 1)])
    rows = []
    for i in range(count):
        stepping.unit.doStep(i * step, step)
        rows.append(list(stepping.unit.getFloat64([*range(number)])))
    return rows


def printed(command: Sequence[str | Path]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("model", CHOSEN)
def test_a_component_is_as_small_and_exact_as_a_library(
    model: str, fmu_of: Callable[[str], Path], request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """Trajectories differ by what the mathematical libraries do, and states go there and back with equal bytes.

    A program with the mathematical functions of zig's musl in it, which are those of wasm, computes equal bits.
    """
    path = fmu_of(model)
    assert len(component_of(path)) <= MOST_BYTES
    for kind in KINDS:
        arguments, rows, saved = run_of(path, model, kind)
        with Stepping3(path, kind) as library, SteppingComponent(path, kind) as wasm:
            wasm.start()
            found = np.array(rows_of(library, kind, float(arguments[2]), int(arguments[3]), int(arguments[4])))
            if kind == "CoSimulation":
                compared = [
                    library.references[v.name] for v in library.description.modelVariables if v.causality == "output"
                ]
            else:
                compared = [*range(wasm.unit.getNumberOfContinuousStates())]
            ours, theirs = found[:, compared], np.array(rows)[:, compared]
            assert np.abs(ours - theirs).max(initial=0.0) <= EQUAL * (1 + np.abs(ours).max(initial=0.0)), kind
            library.unit.setFMUState(library.unit.deserializeFMUState(saved))
            again = library.unit.serializeFMUState(library.unit.getFMUState())
            wasm.unit.setFMUState(again)
            assert bytes(wasm.unit.getFMUState()) == again == saved
        if sys.platform == "linux" and platform.machine() == "x86_64":
            host = tmp_path / "host"
            if not host.exists():
                build_host(path, host, request.getfixturevalue("mathematics"))
            lines = printed([host, *arguments]).splitlines()
            assert [[float.fromhex(word) for word in line.split()] for line in lines] == rows, kind


@pytest.fixture(scope="session")
def mathematics(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Objects with the mathematical functions of zig's musl: some in C, others in Zig.

    All of musl, for a program that is linked with nothing else, would take 40 s of a processor.
    """
    folder, library, target = tmp_path_factory.mktemp("mathematics"), Path(zig()).with_name("lib"), "x86_64-linux-musl"
    for file, options in (("c.zig", ["-lc"]), ("compiler_rt.zig", [])):
        command = [zig(), "build-obj", "-target", target, "-OReleaseFast", "-fstrip", "-fPIC", *options, library / file]
        subprocess.run(command, cwd=folder, check=True)
    musl = library / "libc" / "musl"
    places = [
        musl / "arch/x86_64",
        musl / "arch/generic",
        musl / "src/include",
        musl / "src/internal",
        musl / "include",
    ]
    places += [library / "libc/include/generic-musl", library / f"libc/include/{target}"]
    command = [zig(), "cc", "-target", target, "-std=c99", "-nostdinc", "-O3", "-D_XOPEN_SOURCE=700", "-w", "-c"]
    command += [*(f"-I{place}" for place in places), *sorted((musl / "src/math").glob("*.c"))]
    subprocess.run(command, cwd=folder, check=True)
    return sorted(folder.glob("*.o"))


def build_host(path: Path, host: Path, objects: Sequence[Path]) -> None:
    """The program ``host``: component_host.c and the sources of the FMU, with these ``objects`` before libm."""
    unpack(path, host.with_name("fmu"))
    sources = host.with_name("fmu") / "sources"
    command = [*compiler_command("zig", "x86_64-linux-gnu.2.17"), *FLAGS, f"-I{fmi_headers()}", f"-I{sources}"]
    command += ["-DFMI3_OVERRIDE_FUNCTION_PREFIX=", "-Xclang", "-O0", "-o", host, sources / "all.c"]
    subprocess.run([*command, HERE / "component_host.c", *objects, "-lm"], cwd=host.parent, check=True)


@pytest.mark.parametrize("model", CHOSEN)
def test_a_component_runs_in_node(model: str, fmu_of: Callable[[str], Path], tmp_path: Path) -> None:
    """jco makes a module for Node of it: values and state are those in wasmtime."""
    jco, node = shutil.which("jco"), shutil.which("node")
    if jco is None or node is None:
        pytest.skip("there is no jco, or no node to run it (npm install @bytecodealliance/jco)")
    path = fmu_of(model)
    (tmp_path / "fmu.wasm").write_bytes(component_of(path))
    folder = tmp_path / "out"
    subprocess.run([jco, "transpile", "fmu.wasm", "-o", "out", "--instantiation", "async"], cwd=tmp_path, check=True)
    (folder / "package.json").write_text('{"type": "module"}')
    for kind in KINDS:
        arguments, rows, state = run_of(path, model, kind)
        found = json.loads(printed([node, HERE / "component_host.mjs", folder, "fmu", *arguments]))
        assert found == {"rows": rows, "state": [*state], "said": []}, kind
