"""FMUs in programs of other languages, loaded as hosts in these languages load them: two instances in two threads each.

What they print are the bits that fmpy gets. Client.cs loads FMUs as Unity does, with callbacks that are soon garbage.
"""

from __future__ import annotations

import shutil
import struct
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import fmpy
import pytest
from stepping import Stepping
from stepping3 import Stepping3

pytestmark = [
    pytest.mark.fmu,
    pytest.mark.toolchain,
    pytest.mark.skipif(sys.platform != "linux", reason="the clients load libraries as Linux does"),
]

CLIENTS = Path(__file__).parent / "clients"
MODELS = ("double_pendulum", "woodpecker")
STEP, STEPS = 0.02, 25
JNA = Path("/usr/share/java/jna.jar")


def tool(name: str) -> str:
    """The program ``name``; the test is skipped where there is none."""
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"there is no {name}")
    return found


def ran(command: Sequence[str | Path], folder: Path) -> str:
    """What ``command`` prints; AssertionError with what it says of its failure."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stderr == ""
    return done.stdout


def assert_equal_bits(command: Sequence[str | Path], path: Path, folder: Path, fmi: str) -> None:
    """The program ``command`` gets the values of fmpy from the FMU ``path``, in both of its threads."""
    stepping = Stepping(path) if fmi == "2.0" else Stepping3(path)
    with stepping as fmu:
        outputs = [
            v for v in fmu.description.modelVariables if v.causality == "output" and v.type in ("Real", "Float64")
        ]
        fmu.start()
        get = fmu.unit.getReal if fmi == "2.0" else fmu.unit.getFloat64
        references, rows = [v.valueReference for v in outputs], []
        for i in range(STEPS):
            fmu.unit.doStep(i * STEP, STEP)
            rows.append([*get(references)])
        name = fmu.description.coSimulation.modelIdentifier
        token = fmu.description.guid if fmi == "2.0" else fmu.description.instantiationToken
    platform = fmpy.platform if fmi == "2.0" else fmpy.platform_tuple
    library = path.with_suffix(".unpacked") / "binaries" / platform / f"{name}{fmpy.sharedLibraryExtension}"
    printed = ran([*command, library, token, repr(STEP), str(STEPS), *map(str, references)], folder)
    expected = [" ".join(struct.pack(">d", value).hex() for value in row) for row in rows]
    assert printed.splitlines() == expected * 2


@pytest.mark.parametrize("model", MODELS)
def test_dot_net(model: str, exported, tmp_path: Path) -> None:
    compiler, mono = tool("mcs"), tool("mono")
    ran([compiler, f"-out:{tmp_path / 'client.exe'}", CLIENTS / "Client.cs"], tmp_path)
    assert_equal_bits([mono, "client.exe"], exported(model).path, tmp_path, "2.0")


@pytest.mark.parametrize("model", MODELS)
def test_java(model: str, exported, tmp_path: Path) -> None:
    java = tool("java")
    tool("javac")
    if not JNA.is_file():
        pytest.skip("there is no JNA (libjna-java)")
    assert_equal_bits([java, "-cp", JNA, CLIENTS / "Client.java"], exported(model).path, tmp_path, "2.0")


@pytest.mark.parametrize("model", MODELS)
def test_rust(model: str, exported, tmp_path: Path) -> None:
    ran([tool("rustc"), "--edition", "2021", "-o", tmp_path / "client", CLIENTS / "client.rs"], tmp_path)
    assert_equal_bits([tmp_path / "client"], exported(model, fmi="3.0").path, tmp_path, "3.0")
