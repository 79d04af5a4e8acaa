"""The C hosts of host/ and host3/, built for several platforms and under sanitizers, and FMUs as they take them."""

from __future__ import annotations

import math
import subprocess
import sys
import zipfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from delivered import tables, unpack_sources
from fmpy import read_model_description

from lag2fmu.building.process import of_processor_alone
from lag2fmu.fmu import Fmu
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.formats.loading import load, with_values
from lag2fmu.mechanism import Mechanism

HERE = Path(__file__).parent
HOST = sorted((HERE / "host").glob("*.c"))
HOST3 = sorted((HERE / "host3").glob("*.c"))
INCLUDES = [f"-I{folder}" for folder in (HERE / "host", HERE.parent / "runtime", fmi_headers())]
LIBRARIES = ("-lpthread", "-lm")
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]

ADDRESS = [
    "-g1",
    "-Og",
    "-DARENA_ON_STACK",
    "-fsanitize=address,undefined,float-cast-overflow",
    "-fno-sanitize-recover=all",
]
"""-Og takes a quarter less than -O1 to compile, which takes longer than to run; -O0 takes twice as long to run."""
THREAD = ["-g1", "-Og", "-fsanitize=thread"]

REPRESENTATIVE = [
    "double_pendulum",
    "cart_pole",
    "motion_driven_pendulum",
    "six_axis_arm",
    "linkage",
    "slides_problem_5_small",
]
"""Autonomous, with ports, with a motion input, large, with constraints and a motion input, without mass."""

HYBRID = ["block_on_belt", "sliding_sphere", "woodpecker"]
"""With dry friction, with friction in a round cone, and with impacts of several contacts at once."""

FROM_ELSEWHERE = ["arm.urdf", "crane.py:method", "two_armed_robot"]
"""A robot, an object of SymPy's mechanics, and a mechanism of parts."""
VALUES = {"crane.py:method": {"M": 3.0, "m": 1.0, "l": 0.8, "g": 9.81, "c": 0.5}}
"""Values of constants that the file leaves open."""


@cache
def representative(name: str) -> str | Mechanism:
    """What ``exported`` takes for a name of REPRESENTATIVE or FROM_ELSEWHERE."""
    file = next((path for path in (HERE / name, HERE / f"{name}.toml") if path.is_file()), None)
    if file is not None:
        return load(file)
    if name in VALUES:
        return with_values(load(f"{HERE / name}", VALUES[name]), {"theta": 0.7})
    return name


def build(target: Path, command: Sequence[str], sources: Sequence[Path], *after: str) -> Path:
    """Compile ``sources`` to ``target``; raises AssertionError with what the compiler said."""
    line = [*command, *INCLUDES, *map(str, sources), "-o", str(target), *after]
    done = subprocess.run(line, cwd=target.parent, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return target


def build_host3(
    folder: Path, command: Sequence[str], sources: Sequence[Path], libraries: Sequence[str] = LIBRARIES
) -> Path:
    """The host for FMI 3.0 in ``folder``, from its own files and ``sources`` of the FMU that are unpacked there."""
    (folder / "tables.h").write_text(tables(folder / "sources"), "utf-8")
    here = [f"-I{folder}", f"-I{folder / 'sources'}", f"-I{HOST3[0].parent}"]
    line = [*command, "-std=c99", "-DFMI3_OVERRIDE_FUNCTION_PREFIX", *here]
    return build(folder / "host3.exe", line, [*HOST3, *sources], *libraries)


def with_host3(fmu: Fmu, folder: Path, command: Sequence[str], libraries: Sequence[str] = LIBRARIES) -> Path:
    """The host for FMI 3.0 with all of the FMU in it, which sanitizers then see, too."""
    return build_host3(folder, command, [unpack_sources(fmu, folder)], libraries)


def zig(target: str) -> list[str]:
    """The command for a ``target``. With -s, as for libraries of FMUs, zig has the parts of the C library already."""
    return [sys.executable, "-m", "ziglang", "cc", "-target", target, *of_processor_alone(target), "-O1", "-s"]


KINDS = {"independent": "t", "input": "u", "calculatedParameter": "c"}


def description(fmu: Fmu) -> str:
    """The FMU as the host reads it: GUID, numbers of constraints, states, event indicators, variables; then these."""
    found = read_model_description(str(fmu.path), validate=False)
    lines = []
    states = {v.derivative.name for v in found.modelVariables if v.derivative is not None}
    for v in found.modelVariables:
        if v.type != "Real":
            kind = "n"
        elif v.variability == "discrete" and v.causality != "input":
            kind = "j"
        elif v.derivative is not None:
            kind = "d"
        elif v.causality == "parameter":
            kind = "p" if v.variability == "tunable" else "f"
        elif v.causality in KINDS:
            kind = KINDS[v.causality]
        else:
            kind = (
                ("x" if v.causality == "output" else "l")
                if v.name in states
                else "y"
                if v.causality == "output"
                else "c"
            )
        bounds = [float(v.min or -math.inf) if v.min is not None else -math.inf]
        bounds += [float(v.max) if v.max is not None else math.inf]
        lines.append(f"{v.valueReference} {kind} {float(v.start or 0)!r} {bounds[0]!r} {bounds[1]!r}")
    constraints = len(fmu.mechanism.constraints)
    return "\n".join(
        [f"{found.guid} {constraints} {len(states)} {found.numberOfEventIndicators or 0} {len(lines)}", *lines, ""]
    )


def run(
    command: Sequence[str], folder: Path, environment: Mapping[str, str] | None = None, timeout: float = 300
) -> subprocess.CompletedProcess[str]:
    """Run the host in ``folder`` and return what it did and said."""
    return subprocess.run(
        list(command), cwd=folder, env=environment, capture_output=True, text=True, timeout=timeout, check=False
    )


def library(fmu: Fmu) -> bytes:
    """The library of the FMU, exported for this machine."""
    with zipfile.ZipFile(fmu.path) as archive:
        (name,) = [name for name in archive.namelist() if name.startswith("binaries/")]
        return archive.read(name)
