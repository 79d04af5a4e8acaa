"""FMUs of FMI 3.0 under sanitizers: random calls, legal and illegal, in the C host of the folder host3/."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import hosts
import pytest

from lag2fmu.fmu.backends.native import fmi_headers

pytestmark = [
    pytest.mark.toolchain,
    pytest.mark.fmu,
    pytest.mark.skipif(
        sys.platform != "linux" or shutil.which("gcc") is None, reason="sanitizers are used with gcc on Linux"
    ),
]

HOST = sorted((Path(__file__).parent / "host3").glob("*.c"))
PLAIN_NAMES = "-DFMI3_OVERRIDE_FUNCTION_PREFIX"
CALLS, SEEDS = 200_000, (1, 2)
MODELS = [
    ("bouncing_ball", False),
    ("block_on_belt", False),
    ("double_pendulum", True),
    ("four_bar_linkage", False),
    ("slides_problem_5_small", True),
]
"""Impacts, dry friction, arrays, constraints, what has no mass."""


@pytest.mark.parametrize(("model", "arrays"), MODELS)
def test_random_calls(model: str, arrays: bool, exported, tmp_path: Path) -> None:
    sources = hosts.unpack_sources(exported(model, fmi="3.0", arrays=arrays), tmp_path)
    command = ["gcc", "-std=c99", *hosts.ADDRESS, PLAIN_NAMES, f"-I{tmp_path / 'sources'}", f"-I{HOST[0].parent}"]
    program = hosts.build(tmp_path / "host", command, [*HOST, *sources], "-lm")
    met: Counter[tuple[str, str, str, str]] = Counter()
    for seed in SEEDS:
        done = hosts.run([str(program), str(CALLS), str(seed)], tmp_path)
        assert (done.returncode, done.stderr) == (0, ""), done.stdout[-2000:] + done.stderr[-4000:]
        for line in done.stdout.splitlines():
            kind, function, *states = line.split()
            for state, legal, accepted, refused in (re.split(r"[:/]", cell[0] + ":" + cell[1:]) for cell in states):
                met[kind, function, state + legal, "accepted"] += int(accepted)
                met[kind, function, state + legal, "refused"] += int(refused)
    assert len(met) == 2 * 6 * 51 * 2
    for (kind, function, (_, legal), verdict), count in met.items():
        if legal == ".":
            assert count == 0 or verdict == "refused", (kind, function, "is accepted where it is illegal")
    illegal_met = [met[key] for key in met if key[2][1] == "." and key[3] == "refused"]
    assert sum(map(bool, illegal_met)) > 0.8 * len(illegal_met)


@pytest.mark.parametrize("compiler", [["gcc"], [sys.executable, "-m", "ziglang", "cc"]], ids=["gcc", "zig"])
def test_compilers_have_nothing_to_say(compiler: list[str], exported, tmp_path: Path) -> None:
    """The headers of the standard declare functions without prototypes; they count as those of a system."""
    sources = hosts.unpack_sources(exported("bouncing_ball", fmi="3.0"), tmp_path)
    flags = [*hosts.STRICT, "-Wconversion", "-fPIC", "-shared", "-isystem", str(fmi_headers())]
    command = [*compiler, *flags, *map(str, sources), "-lm", "-o", str(tmp_path / "fmu.so")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
