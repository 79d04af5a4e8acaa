"""Components for WebAssembly beside the same C code with the same mathematical library, and in Node by jco."""

from __future__ import annotations

import itertools
import json
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from components import SteppingComponent, component_of

from lag2fmu.building.process import zig
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import FLAGS
from lag2fmu.fmu.exporting import export
from lag2fmu.fmu.pack import unpack

pytestmark = [pytest.mark.fmu, pytest.mark.toolchain]

MODELS = ("double_pendulum", "woodpecker")
HERE = Path(__file__).parent
COUNT = 50


@pytest.fixture
def fmu_of(tmp_path: Path) -> Callable[[str], Path]:
    return lambda model: export(model, tmp_path / f"{model}.fmu", fmi="3.0", platform="wasm", page="static").path


def run_of(path: Path, step: float) -> tuple[list[str], list[list[float]], bytes]:
    """What the hosts beside this file need to do the same run as wasmtime does here; its values and its last state."""
    with SteppingComponent(path) as wasm:
        reals = {v.valueReference for v in wasm.description.modelVariables if v.type == "Float64"}
        count = next(reference for reference in itertools.count() if reference not in reals)
        wasm.start()
        rows = []
        for i in range(COUNT):
            wasm.unit.doStep(i * step, step)
            rows.append(wasm.unit.getFloat64([*range(count)]))
        arguments = [wasm.description.instantiationToken, repr(step), str(COUNT), str(count)]
        return arguments, rows, bytes(wasm.unit.getFMUState())


@pytest.mark.skipif(
    sys.platform != "linux" or platform.machine() != "x86_64", reason="the program with musl is for Linux on x86-64"
)
@pytest.mark.parametrize("model", MODELS)
def test_the_same_mathematical_library_gives_the_same_bits(
    model: str, fmu_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """The C library of wasm is musl's for the most part. A program with all of musl in it computes equal bits."""
    path = fmu_of(model)
    unpack(path, tmp_path / "fmu")
    arguments, rows, _ = run_of(path, 0.02)
    sources = tmp_path / "fmu" / "sources"
    command = [zig(), "cc", "-target", "x86_64-linux-musl", "-static", *FLAGS, f"-I{fmi_headers()}", f"-I{sources}"]
    command += ["-DFMI3_OVERRIDE_FUNCTION_PREFIX=", "-o", "host", str(sources / "all.c")]
    subprocess.run([*command, str(HERE / "component_host.c"), "-lm"], cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "host", *arguments], capture_output=True, text=True, check=True)
    printed = [[float.fromhex(word) for word in line.split()] for line in done.stdout.splitlines()]
    assert printed == rows


@pytest.mark.parametrize("model", ["bouncing_ball", "four_bar_linkage", "woodpecker"])
def test_a_component_runs_in_node(model: str, fmu_of: Callable[[str], Path], tmp_path: Path) -> None:
    """jco makes a module for Node of it: values and state are those in wasmtime."""
    jco, node = shutil.which("jco"), shutil.which("node")
    if jco is None or node is None:
        pytest.skip("there is no jco, or no node to run it (npm install @bytecodealliance/jco)")
    path = fmu_of(model)
    arguments, rows, state = run_of(path, 0.05)
    (tmp_path / "fmu.wasm").write_bytes(component_of(path))
    folder = tmp_path / "out"
    subprocess.run([jco, "transpile", "fmu.wasm", "-o", "out", "--instantiation", "async"], cwd=tmp_path, check=True)
    (folder / "package.json").write_text('{"type": "module"}')
    command = [node, str(HERE / "component_host.mjs"), str(folder), "fmu", *arguments]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert found == {"rows": rows, "state": [*state], "said": []}
