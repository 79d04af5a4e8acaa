"""Plain C on processors that are no PC's, under QEMU and Wine: with own sines the bits are those of this machine.

Cortex-M4F and M7 run bare, without an operating system; Windows is Wine; the others run by QEMU's user mode, with the
C library of Debian's cross packages, or else with zig's musl, which takes a minute to build for each of them.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from compiling import TARGET, UNOPTIMISED
from wine import alone, wine

from lag2fmu.building.process import of_processor_alone
from lag2fmu.fmu.firmware import firmware
from lag2fmu.fmu.platforms import PLATFORMS

pytestmark = [pytest.mark.toolchain, pytest.mark.fmu, pytest.mark.slow]

HERE = Path(__file__).parent / "cortex"
MODELS = ("cart_pole", "six_axis_arm", "four_bar_linkage", "woodpecker", "sliding_sphere")
STEPS = 500
ZIG = (sys.executable, "-m", "ziglang", "cc", "-s")
"""With -s, as for libraries of FMUs, zig has the parts of the C library already."""
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-DMAIN_SILENT", f"-DMAIN_STEPS={STEPS}")
BARE = (
    "-mthumb",
    "-mfloat-abi=hard",
    "-ffunction-sections",
    "-fdata-sections",
    "-nostartfiles",
    "--specs=rdimon.specs",
)
CORTEX = {
    "mps2-an386": ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"),
    "mps2-an500": ("-mcpu=cortex-m7", "-mfpu=fpv5-d16"),
}
"""QEMU's board -> its processor"""
USER = {
    "arm": ("arm-linux-gnueabihf", "arm-linux-musleabihf"),
    "aarch64": ("aarch64-linux-gnu", "aarch64-linux-musl"),
    "riscv64": ("riscv64-linux-gnu", "riscv64-linux-musl"),
    "i386": ("i686-linux-gnu", "x86-linux-musl", "-msse2", "-mfpmath=sse"),
}
"""QEMU's processor -> Debian's name of the C library, zig's target with musl, flags"""
WINDOWS = {"win64": (64, "x86_64-windows-gnu"), "win32": (32, "x86-windows-gnu", "-msse2", "-mfpmath=sse")}
"""Platform -> the bits of its programs, zig's target and flags"""
REALS = ("float", "double")
OPTIMISED = (True, False)


def crossed(targets: Iterable[str]) -> list[Any]:
    """(model, real, optimised, target): each model on each of the ``targets``, in each way on each of them by turns."""
    turns = [(i, j, model, target) for i, model in enumerate(MODELS) for j, target in enumerate(targets)]
    cases = [(model, REALS[(i + j) % 2], OPTIMISED[(i // 2 + j) % 2], target) for i, j, model, target in turns]
    return [pytest.param(*case, id=f"{case[0]}_{case[1]}-{case[3]}{'-optimised' if case[2] else ''}") for case in cases]


@cache
def files(model: str, real: str) -> Mapping[str, str]:
    """{name: text} of the mechanism and its main program."""
    return firmware(model, real=real, own_math=True).files


@cache
def here(model: str, real: str) -> str:
    """What this machine prints. Not optimised: bits that an optimisation changed elsewhere would differ from these."""
    with TemporaryDirectory() as folder:
        return run(written(Path(folder), model, real), (*compiler(False), *TARGET))


def compiler(optimised: bool) -> tuple[str, ...]:
    """The command of zig."""
    return (*ZIG, *FLAGS, *(() if optimised else UNOPTIMISED["zig"]))


def written(folder: Path, model: str, real: str) -> Path:
    """The ``folder`` with the files in it."""
    for name, text in files(model, real).items():
        (folder / name).write_text(text, "utf-8")
    return folder


def run(
    folder: Path,
    command: tuple[str, ...],
    *start: str,
    libraries: tuple[str, ...] = ("-lm",),
    environment: Mapping[str, str] | None = None,
) -> str:
    """What the program that ``command`` makes in ``folder`` prints, if ``start`` runs it in the ``environment``."""
    units = sorted(path.name for path in folder.glob("*.c"))
    built = subprocess.run(
        [*command, *units, *libraries, "-o", "run.exe"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stderr
    printed, variables = folder / "printed.txt", {**os.environ, **(environment or {})}
    with printed.open("w") as output:  # a file: Wine's servers would hold a pipe open
        subprocess.run([*start, folder / "run.exe"], stdout=output, env=variables, check=True, timeout=300)
    return printed.read_text()


ROUNDED_WRONG = {("mps2-an386", "double", "woodpecker")}
"""Runs on a processor without doubles that meet a difference which GCC's own arithmetic does not round right.

In libgcc of GCC 12.2 1 - x is wrong by an ulp for every other x of about 2^-33. The runs then agree to rounding.
"""
AGREEMENT = 1e-9
"""Of such runs, relative to 1."""


@pytest.mark.parametrize(("model", "real", "optimised", "board"), crossed(CORTEX))
def test_bits_on_a_bare_processor(model: str, real: str, optimised: bool, board: str, tmp_path: Path) -> None:
    if not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")):
        pytest.skip("no qemu-system-arm with gcc-arm-none-eabi on this machine")
    shutil.copy(HERE / "startup.c", tmp_path)
    gcc = ("arm-none-eabi-gcc", *FLAGS, *(() if optimised else UNOPTIMISED["gcc"]))
    command = (*gcc, *CORTEX[board], *BARE, "-Wl,--gc-sections", "-T", str(HERE / "cortex.ld"))
    options = ("-M", board, "-nographic", "-semihosting-config", "enable=on,target=native", "-kernel")
    found, expected = run(written(tmp_path, model, real), command, "qemu-system-arm", *options), here(model, real)
    if (board, real, model) in ROUNDED_WRONG:
        assert _numbers(found) == pytest.approx(_numbers(expected), rel=AGREEMENT, abs=AGREEMENT)
    else:
        assert found == expected
    assert np.isfinite(np.array(expected.splitlines()[-1].split(","), float)).all()


def _numbers(printed: str) -> list[float]:
    """Those of the last line that a program printed."""
    return [float(word) for word in printed.splitlines()[-1].split(",")]


@pytest.mark.parametrize(("model", "real", "optimised", "processor"), crossed(USER))
def test_bits_on_other_processors(model: str, real: str, optimised: bool, processor: str, tmp_path: Path) -> None:
    if shutil.which(f"qemu-{processor}") is None:
        pytest.skip(f"no qemu-{processor} on this machine")
    library, target, *flags = USER[processor]
    root, start = Path("/usr", library), [f"qemu-{processor}"]
    if root.is_dir():
        # the target of libraries of FMUs: zig has the parts of this glibc already
        begin = f"{library.replace('i686', 'x86')}."
        target = next(t for platform in PLATFORMS.values() for t in platform.targets if t.startswith(begin))
        start += ["-L", str(root)]
    command = (*compiler(optimised), "-target", target, *of_processor_alone(target), *flags)
    assert run(written(tmp_path, model, real), command, *start) == here(model, real)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows needs no Wine")
@pytest.mark.parametrize(("model", "real", "optimised", "platform"), crossed(WINDOWS))
def test_bits_on_windows(model: str, real: str, optimised: bool, platform: str, tmp_path: Path) -> None:
    bits, target, *flags = WINDOWS[platform]
    loader, environment = wine(bits)
    command = (*compiler(optimised), "-target", target, *flags)
    (apart := tmp_path / "apart").mkdir()
    found = run(written(tmp_path, model, real), command, loader, libraries=alone(apart), environment=environment)
    assert found == here(model, real)
