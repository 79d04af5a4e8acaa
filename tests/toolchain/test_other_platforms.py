"""Libraries for other platforms, run on this machine against linux64: win64 under Wine, those of Linux under qemu."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import hosts
import numpy as np
import pytest
from delivered import before_joining
from numpy.typing import NDArray
from wine import alone, wine

from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import compile_libraries
from lag2fmu.fmu.platforms import PLATFORMS

pytestmark = [
    pytest.mark.toolchain,
    pytest.mark.fmu,
    pytest.mark.slow,
    pytest.mark.skipif(
        sys.platform != "linux" or os.uname().machine != "x86_64", reason="the emulators are used on linux64"
    ),
]

SYSROOT = Path("/usr/aarch64-linux-gnu")
"""Of Debian's libc6-arm64-cross: the C library that qemu gives to programs for aarch64."""
AGREEMENT = 1e-9
"""Relative, per number: a run of 2 s with tolerance 1e-9, where C libraries differ in last places of sin and cos."""


@dataclass(frozen=True)
class Machine:
    """How programs for a platform are built and started."""

    target: str
    libraries: tuple[str, ...]
    start: tuple[str, ...]
    environment: dict[str, str]

    def libraries_in(self, folder: Path) -> tuple[str, ...]:
        """What programs are linked with, where something of it may be written to the ``folder``."""
        return alone(folder) if "windows" in self.target else self.libraries


def linux64() -> Machine:
    return Machine("x86_64-linux-gnu.2.17", ("-ldl", "-lpthread", "-lm"), (), {})


def windows(bits: int, target: str) -> Callable[[], Machine]:
    """A machine for ``target``: Wine for programs of ``bits`` bits."""

    def machine() -> Machine:
        loader, environment = wine(bits)
        return Machine(target, (), (loader,), environment)

    return machine


def aarch64_linux() -> Machine:
    if shutil.which("qemu-aarch64") is None or not SYSROOT.is_dir():
        pytest.skip("qemu or a C library for it is not on this machine (Debian: qemu-user, libc6-arm64-cross)")
    start = ("qemu-aarch64", "-L", str(SYSROOT))
    return Machine("aarch64-linux-gnu.2.17", ("-ldl", "-lpthread", "-lm"), start, {})


MACHINES = {"linux64": linux64, "win64": windows(64, "x86_64-windows-gnu"), "aarch64-linux": aarch64_linux}


def emulated(program: str, root: str, target: str) -> Callable[[], Machine]:
    """A machine for ``target``: qemu's ``program`` with the C library below the folder ``root``."""

    def machine() -> Machine:
        if shutil.which(program) is None or not Path(root).is_dir():
            pytest.skip(f"there is no {program}, or no C library in {root} (Debian: qemu-user, libc6-*-cross)")
        return Machine(target, ("-ldl", "-lpthread", "-lm"), (program, "-L", root), {})

    return machine


def musl() -> Machine:
    if not Path("/lib/ld-musl-x86_64.so.1").exists():
        pytest.skip("the C library musl is not on this machine (Debian: musl)")
    return Machine("x86_64-linux-musl", ("-dynamic",), (), {})


FURTHER = {
    "win32": windows(32, "x86-windows-gnu"),
    "linux32": emulated("qemu-i386", "/usr/i686-linux-gnu", "x86-linux-gnu.2.17"),
    "aarch32-linux": emulated("qemu-arm", "/usr/arm-linux-gnueabihf", "arm-linux-gnueabihf.2.17"),
    "riscv64-linux": emulated("qemu-riscv64", "/usr/riscv64-linux-gnu", "riscv64-linux-gnu.2.27"),
    "linux64-musl": musl,
}
"""Platforms on which one mechanism is tried; nothing here runs libraries for aarch64-windows."""


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Platform -> the host for it, built when it is first needed."""
    folder = tmp_path_factory.mktemp("programs")
    built: dict[str, Path] = {}

    class Programs(dict[str, Path]):
        def __missing__(self, platform: str) -> Path:
            machine = (MACHINES | FURTHER)[platform]()
            name = folder / f"{platform}.exe"
            libraries = machine.libraries_in(folder)
            self[platform] = hosts.build(name, hosts.zig(machine.target), hosts.HOST, *libraries)
            return self[platform]

    return Programs(built)


Lines = list[NDArray[np.float64]]


def run(folder: Path, platform: str, program: Path, *arguments: str) -> str:
    """What ``program`` for ``platform`` prints, run in ``folder``."""
    machine = (MACHINES | FURTHER)[platform]()
    out, wrong = folder / "out.txt", folder / "err.txt"
    with out.open("w") as output, wrong.open("w") as error:  # files: Wine's servers would hold pipes open
        done = subprocess.run(
            [*machine.start, str(program), *arguments],
            cwd=folder,
            env=os.environ | machine.environment,
            stdout=output,
            stderr=error,
            timeout=300,
            check=False,
        )
    assert done.returncode == 0, out.read_text()[-2000:] + wrong.read_text()
    return out.read_text()


def numbers(text: str) -> Lines:
    """An array a line."""
    return [np.array([float.fromhex(word) for word in line.split()]) for line in text.splitlines()]


class Installed:
    """An FMU in ``folder``, for several ``platforms``."""

    def __init__(
        self, model: str, exported, folder: Path, programs: dict[str, Path], platforms: Iterable[str] = MACHINES
    ) -> None:
        fmu = exported(hosts.representative(model))
        self.folder, self.programs = folder, programs
        _, sources = before_joining(hosts.representative(model))
        libraries = compile_libraries(sources, fmi_headers(), model, [PLATFORMS[name] for name in platforms])
        for name, library in zip(platforms, libraries, strict=True):
            (folder / f"{name}{PLATFORMS[name].suffix}").write_bytes(library)
        (folder / "fmu.txt").write_text(hosts.description(fmu))

    def numbers(self, platform: str, *action: str) -> Lines:
        """What the host for ``platform`` printed, as numbers."""
        return numbers(self.run(platform, *action))

    def run(self, platform: str, *action: str) -> str:
        """What the host for ``platform`` printed."""
        library = f"./{platform}{PLATFORMS[platform].suffix}"
        return run(self.folder, platform, self.programs[platform], library, "fmu.txt", *action)


@pytest.fixture
def installed(exported, tmp_path: Path, programs: dict[str, Path]):
    return lambda model: Installed(model, exported, tmp_path, programs)


def difference(one: Lines, other: Lines) -> float:
    """The greatest relative difference of two lists of arrays."""
    assert [len(row) for row in one] == [len(row) for row in other]
    pairs = zip(one, other, strict=True)
    return max(float((np.abs(a - b) / np.maximum(1.0, np.abs(a))).max(initial=0.0)) for a, b in pairs)


@pytest.mark.parametrize("model", hosts.REPRESENTATIVE)
def test_other_platforms_agree_with_linux64(model: str, installed) -> None:
    """Co-simulation, derivatives and their Jacobian; then from a state that linux64 saved; then random calls."""
    fmu = installed(model)
    expected = fmu.numbers("linux64", "move")
    assert len(expected) > 200
    assert float(np.ptp([row[0] for row in expected[:200]])) > 1e-3, "it moves"
    fmu.run("linux64", "save", "state.bin")
    assert difference(fmu.numbers("linux64", "go_on", "state.bin"), expected[100:200]) == 0.0
    reached = []
    for platform in ("win64", "aarch64-linux"):
        try:
            assert difference(fmu.numbers(platform, "move"), expected) < AGREEMENT
        except pytest.skip.Exception:
            continue
        reached.append(platform)
        assert difference(fmu.numbers(platform, "go_on", "state.bin"), expected[100:200]) < AGREEMENT
        fmu.run(platform, "save", "back.bin")
        assert difference(fmu.numbers("linux64", "go_on", "back.bin"), expected[100:200]) < AGREEMENT
        fmu.run(platform, "random_calls", "10000", "7")
    if not reached:
        pytest.skip("there is neither Wine nor qemu on this machine (Debian: wine64, qemu-user, libc6-arm64-cross)")


@pytest.mark.parametrize("platform", FURTHER)
def test_further_platforms_agree_with_linux64(platform: str, exported, tmp_path: Path, programs) -> None:
    """Also from a state that linux64 saved: its bytes are the same where pointers have 32 bits."""
    FURTHER[platform]()
    fmu = Installed("cart_pole", exported, tmp_path, programs, ["linux64", platform])
    expected = fmu.numbers("linux64", "move")
    fmu.run("linux64", "save", "state.bin")
    assert difference(fmu.numbers(platform, "move"), expected) < AGREEMENT
    assert difference(fmu.numbers(platform, "go_on", "state.bin"), expected[100:200]) < AGREEMENT
    fmu.run(platform, "random_calls", "10000", "7")


def test_fmi_3_agrees_with_linux64(exported, tmp_path: Path) -> None:
    """A ball that bounces, with event mode and arrays; also from a state that linux64 saved, and random calls."""
    fmu, reached, expected = exported("bouncing_ball", fmi="3.0", arrays=True), [], []
    for platform, machine_of in MACHINES.items():
        try:
            machine = machine_of()
        except pytest.skip.Exception:
            continue
        folder = tmp_path / platform
        folder.mkdir()
        program = hosts.with_host3(fmu, folder, hosts.zig(machine.target), machine.libraries_in(folder))
        found = numbers(run(folder, platform, program, "move"))
        expected = expected or found
        assert difference(found, expected) < AGREEMENT
        if platform == "linux64":
            run(folder, platform, program, "save", "../state.bin")
        rest = numbers(run(folder, platform, program, "go_on", "../state.bin"))
        assert difference(rest, expected[-1 - len(rest) : -1]) < AGREEMENT
        run(folder, platform, program, "random_calls", "5000", "7")
        reached.append(platform)
    assert len(expected) > 103, "100 steps, and a line at each impact"
    if len(reached) == 1:
        pytest.skip("there is neither Wine nor qemu on this machine (Debian: wine64, qemu-user, libc6-arm64-cross)")
