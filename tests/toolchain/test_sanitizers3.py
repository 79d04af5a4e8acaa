"""FMUs of FMI 3.0 under sanitizers and valgrind, in the C host of the folder host3/."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import hosts
import pytest
from compiling import COMPILERS, STRICT, UNOPTIMISED
from delivered import sections, unpack_sources

from lag2fmu.fmu.backends.native import fmi_headers

pytestmark = [
    pytest.mark.toolchain,
    pytest.mark.fmu,
    pytest.mark.skipif(
        sys.platform != "linux" or shutil.which("gcc") is None, reason="sanitizers are used with gcc on Linux"
    ),
]

CALLS, SEEDS = 75_000, (1, 2)
MODELS = [
    ("bouncing_ball", False),
    ("block_on_belt", False),
    ("double_pendulum", True),
    ("four_bar_linkage", False),
    ("slides_problem_5_small", True),
]
"""Impacts, dry friction, arrays, constraints, what has no mass."""
LONG = {"bouncing_ball", "block_on_belt"}
"""Those with so much code that to compile it with -O0 saves more than the runs take longer."""


def said(command: list[str], folder: Path) -> str:
    """What the host prints, which has nothing to complain of."""
    done = hosts.run(command, folder)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout[-2000:] + done.stderr[-4000:]
    return done.stdout


@pytest.mark.parametrize(("model", "arrays"), MODELS)
def test_random_calls(model: str, arrays: bool, exported, tmp_path: Path) -> None:
    """Wrong calls out of intermediate updates and out of the logger are among them."""
    flags = [*hosts.ADDRESS, *(["-O0"] if model in LONG else [])]
    program = str(hosts.with_host3(exported(model, fmi="3.0", arrays=arrays), tmp_path, ["gcc", *flags]))
    assert said([program, "cycles", "1000"], tmp_path) == "1000 cycles\n"
    met: Counter[tuple[str, str, str, str]] = Counter()
    for seed in SEEDS:
        for line in said([program, "random_calls", str(CALLS), str(seed)], tmp_path).splitlines():
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


def test_threads(exported, tmp_path: Path) -> None:
    """100 instances, each in a thread of its own, pass events like instances that are alone, bit for bit."""
    program = hosts.with_host3(exported("bouncing_ball", fmi="3.0", arrays=True), tmp_path, ["gcc", *hosts.THREAD])
    assert said([str(program), "threads", "100"], tmp_path) == "100 threads\n"


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="there is no valgrind on this machine")
def test_valgrind(exported, tmp_path: Path) -> None:
    """The library that is shipped, over impacts in event mode too: it reads nothing that was not written."""
    fmu = exported("bouncing_ball", fmi="3.0")
    unpack_sources(fmu, tmp_path)
    (tmp_path / "fmu.so").write_bytes(hosts.library(fmu))
    parts, tables = sections(tmp_path / "sources"), tmp_path / "own_tables.c"
    tables.write_text('#include "tables.h"\n' + parts["ports.c"] + parts["tables.c"], "utf-8")
    linked = [str(tmp_path / "fmu.so"), f"-Wl,-rpath,{tmp_path}"]
    program = hosts.build_host3(
        tmp_path, ["gcc", "-O1", "-g1", "-include", "prefix.h"], [tables], [*linked, *hosts.LIBRARIES]
    )
    checked = ["valgrind", "-q", "--error-exitcode=9", "--leak-check=full", str(program)]
    assert said([*checked, "cycles", "200"], tmp_path) == "200 cycles\n"
    said([*checked, "random_calls", "2000", "3"], tmp_path)


@pytest.mark.parametrize("compiler", COMPILERS)
def test_compilers_have_nothing_to_say(compiler: str, exported, tmp_path: Path) -> None:
    """The headers of the standard declare functions without prototypes; they count as those of a system."""
    source = unpack_sources(exported("bouncing_ball", fmi="3.0"), tmp_path)
    flags = [*STRICT, *UNOPTIMISED[compiler], "-shared", "-isystem", str(fmi_headers())]  # test_sources.py has -O2
    command = [*COMPILERS[compiler], *flags, str(source), "-lm", "-o", str(tmp_path / "fmu.so")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
