"""Components for WebAssembly beside the same C code with the same mathematical library, and in Node by jco."""

from __future__ import annotations

import itertools
import json
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from chosen import models
from components import SteppingComponent, component_of, exchange

from lag2fmu.building.process import zig
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import FLAGS
from lag2fmu.fmu.exporting import export
from lag2fmu.fmu.pack import unpack
from lag2fmu.formats.loading import load

pytestmark = [pytest.mark.fmu, pytest.mark.toolchain]

FEW = frozenset({"bouncing_ball", "double_pendulum", "four_bar_linkage", "woodpecker"})
KINDS = ("CoSimulation", "ModelExchange")
HERE = Path(__file__).parent
COUNT = {"CoSimulation": 50, "ModelExchange": 200}
"""Steps: by co-simulation through the experiment, by model exchange, with Euler's method, 1e-4 of it each."""


@pytest.fixture
def fmu_of(tmp_path: Path) -> Callable[[str], Path]:
    return lambda model: export(model, tmp_path / f"{model}.fmu", fmi="3.0", platform="wasm", page="static").path


def run_of(path: Path, model: str, kind: str) -> tuple[list[str], list[list[float]], bytes]:
    """What the hosts beside this file need to do the same run as wasmtime does here; its values and its last state."""
    stop = load(model).experiment.stop_time
    count, step = COUNT[kind], stop / (50 if kind == "CoSimulation" else 10_000)
    with SteppingComponent(path, kind) as wasm:
        reals = {v.valueReference for v in wasm.description.modelVariables if v.type == "Float64"}
        number = next(reference for reference in itertools.count() if reference not in reals)
        wasm.start()
        if kind == "CoSimulation":
            rows = []
            for i in range(count):
                wasm.unit.doStep(i * step, step)
                rows.append(list(wasm.unit.getFloat64([*range(number)])))
        else:
            rows = exchange(wasm, [i * step for i in range(count + 1)])
        arguments = [wasm.description.instantiationToken, kind, repr(step), str(count), str(number)]
        return arguments, rows, bytes(wasm.unit.getFMUState())


def printed(command: Sequence[str | Path]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64", reason="the program with musl is for Linux on x86-64"
)
@pytest.mark.parametrize("model", models(FEW))
def test_the_same_mathematical_library_gives_the_same_bits(
    model: str, fmu_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """The C library of wasm is musl's for the most part. A program with all of musl in it computes equal bits."""
    path = fmu_of(model)
    unpack(path, tmp_path / "fmu")
    sources = tmp_path / "fmu" / "sources"
    command = [zig(), "cc", "-target", "x86_64-linux-musl", "-static", *FLAGS, f"-I{fmi_headers()}", f"-I{sources}"]
    command += ["-DFMI3_OVERRIDE_FUNCTION_PREFIX=", "-Xclang", "-O0", "-o", "host", str(sources / "all.c")]
    subprocess.run([*command, str(HERE / "component_host.c"), "-lm"], cwd=tmp_path, check=True)
    for kind in KINDS:
        arguments, rows, _ = run_of(path, model, kind)
        lines = printed([tmp_path / "host", *arguments]).splitlines()
        assert [[float.fromhex(word) for word in line.split()] for line in lines] == rows, kind


@pytest.mark.parametrize("model", models(FEW))
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
