"""Plain C on processors that are no PC's, under QEMU and Wine: with own sines the bits are those of this machine.

Cortex-M4F and M7 run bare, without an operating system; Windows is Wine; the others run by QEMU's user mode, with the
C library of Debian's cross packages, or else with zig's musl, which takes a minute to build for each of them.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from wine import wine

from lag2fmu.fmu.firmware import firmware

pytestmark = [pytest.mark.toolchain, pytest.mark.fmu, pytest.mark.slow]

HERE = Path(__file__).parent / "cortex"
MODELS = ("cart_pole", "six_axis_arm", "four_bar_linkage", "woodpecker", "sliding_sphere")
STEPS = 500
ZIG = (sys.executable, "-m", "ziglang", "cc")
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
CASES = [(model, real) for model in MODELS for real in ("double", "float")]


@pytest.fixture(scope="module", params=CASES, ids="_".join)
def files(request: pytest.FixtureRequest) -> Mapping[str, str]:
    model, real = request.param
    return firmware(model, real=real, own_math=True).files


@pytest.fixture(scope="module")
def here(files: Mapping[str, str], tmp_path_factory: pytest.TempPathFactory) -> str:
    """What this machine prints."""
    folder = tmp_path_factory.mktemp("here")
    for name, text in files.items():
        (folder / name).write_text(text, "utf-8")
    return run(folder, (*ZIG, *FLAGS))


@pytest.fixture
def folder(files: Mapping[str, str], tmp_path: Path) -> Path:
    for name, text in files.items():
        (tmp_path / name).write_text(text, "utf-8")
    return tmp_path


def run(folder: Path, command: tuple[str, ...], *start: str, environment: Mapping[str, str] | None = None) -> str:
    """What the program that ``command`` makes in ``folder`` prints, if ``start`` runs it in the ``environment``."""
    units = sorted(path.name for path in folder.glob("*.c"))
    built = subprocess.run(
        [*command, *units, "-lm", "-o", "run.exe"], cwd=folder, capture_output=True, text=True, check=False
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


@pytest.mark.parametrize("board", CORTEX)
def test_bits_on_a_bare_processor(board: str, request: pytest.FixtureRequest, folder: Path, here: str) -> None:
    if not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")):
        pytest.skip("no qemu-system-arm with gcc-arm-none-eabi on this machine")
    shutil.copy(HERE / "startup.c", folder)
    command = ("arm-none-eabi-gcc", *FLAGS, *CORTEX[board], *BARE, "-Wl,--gc-sections", "-T", str(HERE / "cortex.ld"))
    options = ("-M", board, "-nographic", "-semihosting-config", "enable=on,target=native", "-kernel")
    found = run(folder, command, "qemu-system-arm", *options)
    if any(board == b and f"{m}_{real}" in request.node.name for b, real, m in ROUNDED_WRONG):
        assert _numbers(found) == pytest.approx(_numbers(here), rel=AGREEMENT, abs=AGREEMENT)
    else:
        assert found == here
    assert np.isfinite(np.array(here.splitlines()[-1].split(","), float)).all()


def _numbers(printed: str) -> list[float]:
    """Those of the last line that a program printed."""
    return [float(word) for word in printed.splitlines()[-1].split(",")]


@pytest.mark.parametrize("processor", USER)
def test_bits_on_other_processors(processor: str, folder: Path, here: str) -> None:
    if shutil.which(f"qemu-{processor}") is None:
        pytest.skip(f"no qemu-{processor} on this machine")
    library, target, *flags = USER[processor]
    root, start = Path("/usr", library), [f"qemu-{processor}"]
    if root.is_dir():
        target, start = library.replace("i686", "x86"), [*start, "-L", str(root)]
    assert run(folder, (*ZIG, "-target", target, *FLAGS, *flags), *start) == here


@pytest.mark.skipif(sys.platform == "win32", reason="Windows needs no Wine")
@pytest.mark.parametrize("platform", WINDOWS)
def test_bits_on_windows(platform: str, folder: Path, here: str) -> None:
    bits, target, *flags = WINDOWS[platform]
    loader, environment = wine(bits)
    assert run(folder, (*ZIG, "-target", target, *FLAGS, *flags), loader, environment=environment) == here
