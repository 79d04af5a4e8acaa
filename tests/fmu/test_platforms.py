"""FMUs for several platforms: the right files in the right folders, which export FMI's functions and need little."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import elf
import macho
import numpy as np
import pe
import pytest
from archives import functions_of_fmi

from lag2fmu import simulate
from lag2fmu.checking.binaries import read_libraries
from lag2fmu.cli import main
from lag2fmu.errors import BuildError
from lag2fmu.fmu import export
from lag2fmu.fmu.compilers import compile_library
from lag2fmu.fmu.mach import universal
from lag2fmu.fmu.platforms import CHOICES, DESKTOP, PLATFORMS, choose_platforms, host_platform
from lag2fmu.formats.loading import load

FILES = {
    "binaries/aarch64-darwin/double_pendulum.dylib",
    "binaries/aarch64-linux/double_pendulum.so",
    "binaries/darwin64/double_pendulum.dylib",
    "binaries/linux64/double_pendulum.so",
    "binaries/win64/double_pendulum.dll",
}
UNIVERSAL_C_RUNTIME = "api-ms-win-crt-"

slow = [pytest.mark.fmu, pytest.mark.slow]


def binaries(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist() if name.startswith("binaries/")}


@pytest.fixture(scope="module")
def everywhere(optimised: None, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The libraries of an FMU for all platforms; the first time a machine does it, this takes a quarter of a minute."""
    path = tmp_path_factory.mktemp("all") / "double_pendulum.fmu"
    return binaries(export(load("double_pendulum"), path, platform="all").path)


@pytest.mark.fmu
@pytest.mark.usefixtures("optimised")
def test_long_files_compile_without_vectors_of_scalars_to_the_same_bits(tmp_path, monkeypatch) -> None:
    """The library is another one, the motion the same."""
    runs, libraries = [], []
    for number, longest in enumerate((10**9, 0)):
        monkeypatch.setattr("lag2fmu.fmu.compilers.LONG", longest)
        fmu = export(load("six_axis_arm"), tmp_path / f"{number}.fmu", page="static")
        libraries.append(binaries(fmu.path))
        runs.append(simulate(fmu, stop_time=0.1).values)
    assert libraries[0] != libraries[1]
    assert np.array_equal(*runs)


class TestAll:
    pytestmark = slow

    def test_folders_and_nothing_beside_the_libraries(self, everywhere) -> None:
        assert set(everywhere) == FILES

    @pytest.mark.parametrize(
        ("name", "machine", "loader"),
        [("linux64", 62, "ld-linux-x86-64.so.2"), ("aarch64-linux", 183, "ld-linux-aarch64.so.1")],
    )
    def test_linux(self, name: str, machine: int, loader: str, everywhere) -> None:
        data = everywhere[f"binaries/{name}/double_pendulum.so"]
        found = elf.Library(data)
        assert int.from_bytes(data[18:20], "little") == machine
        assert found.exported == functions_of_fmi()
        assert found.needed <= {"libm.so.6", "libc.so.6", loader}
        versions = {tuple(map(int, v.removeprefix("GLIBC_").split("."))) for v in found.versions}
        assert max(versions) <= (2, 17)
        assert not found.search_paths

    def test_windows(self, everywhere) -> None:
        found = pe.Dll(everywhere["binaries/win64/double_pendulum.dll"])
        assert found.exported == functions_of_fmi()
        assert all(name.lower().startswith(UNIVERSAL_C_RUNTIME) for name in found.needed), "MinGW-w64 needs KERNEL32"
        assert found.functions_unwound > 100, "of nearly all functions a debugger of the importer finds the caller"

    def test_mac(self, everywhere) -> None:
        data = everywhere["binaries/darwin64/double_pendulum.dylib"]
        assert data == everywhere["binaries/aarch64-darwin/double_pendulum.dylib"]
        found = macho.libraries(data)
        assert set(found) == {macho.X86_64, macho.ARM64}
        for library in found.values():
            assert library.exported == functions_of_fmi()
            assert library.needed == {"/usr/lib/libSystem.B.dylib"}
            inner = {name for name in library.imported if name.startswith("__")}
            assert inner <= {"__bzero", "__memcpy_chk", "__sincos_stret"}, "those of libSystem, none of compiler-rt"
            assert library.minimum_system == (11, 0)
        assert found[macho.ARM64].signed, "Apple silicon loads signed libraries only"

    def test_the_checker_reads_the_same(self, everywhere) -> None:
        """``lag2fmu check`` reads libraries by LIEF; here they are read from the bytes."""
        for name, data in everywhere.items():
            if name.endswith(".dylib"):
                parts = macho.libraries(data)
                own = [parts[macho.X86_64], parts[macho.ARM64]]
            else:
                own = [elf.Library(data) if name.endswith(".so") else pe.Dll(data)]
            found = read_libraries(data)
            assert [part.exported for part in found] == [library.exported for library in own]
            assert [part.needed for part in found] == [library.needed for library in own]
            if name.endswith(".so"):
                versions = {tuple(map(int, v.removeprefix("GLIBC_").split("."))) for v in own[0].versions}
                assert found[0].glibc == max(versions)

    def test_no_path_of_this_machine(self, everywhere) -> None:
        for name, data in everywhere.items():
            for text in (str(Path.home()), "/tmp/", "lag2fmu-", ".pdb"):
                assert text.encode() not in data, (name, text)

    @pytest.mark.usefixtures("compiled_anew")
    def test_another_process_gives_the_same_bytes(self, everywhere, tmp_path) -> None:
        code = "import lag2fmu; lag2fmu.export(lag2fmu.load('double_pendulum'), 'x.fmu', platform='all')"
        environment = os.environ | {"PYTHONHASHSEED": "7", "TMPDIR": str(tmp_path)}
        subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)
        assert binaries(tmp_path / "x.fmu") == everywhere

    @pytest.mark.usefixtures("compiled_anew")
    def test_one_platform_gives_the_same_library(self, everywhere, tmp_path) -> None:
        path = export(load("double_pendulum"), tmp_path / "x.fmu", platform="win64").path
        name = "binaries/win64/double_pendulum.dll"
        assert binaries(path) == {name: everywhere[name]}


# ------------------------------------------------------------------------------------------------------ what is chosen


def test_choices() -> None:
    assert choose_platforms("host") == (host_platform(),)
    assert choose_platforms("all") == tuple(PLATFORMS[name] for name in DESKTOP)
    assert choose_platforms("win64") == (PLATFORMS["win64"],)
    assert choose_platforms("win32, linux64,win32") == (PLATFORMS["win32"], PLATFORMS["linux64"])
    with pytest.raises(BuildError, match=r"unknown platform 'qnx'; known are host, linux64, .*all, every"):
        choose_platforms("linux64,qnx")


@pytest.mark.parametrize("version", ["folders", "tuples"])
def test_every_platform_has_a_folder_of_its_own(version: str) -> None:
    chosen = choose_platforms("every")
    places = [folder for platform in chosen for folder in getattr(platform, version)]
    assert len(places) == len(set(places))
    assert {*PLATFORMS.values()} - {*chosen} == {PLATFORMS["linux64-musl"], PLATFORMS["wasm"]}


def test_glibc_and_musl_are_two_fmus() -> None:
    with pytest.raises(BuildError, match="stand in one folder of an FMU; name one of the two, or make two FMUs"):
        choose_platforms("all,linux64-musl")


def test_the_command_line_offers_all_platforms() -> None:
    (option,) = [p for p in main.commands["export"].params if p.name == "platform"]
    assert list(option.type.choices) == list(CHOICES)


@pytest.mark.parametrize(("machine", "folders"), [("arm64", ["aarch64-darwin", "darwin64"]), ("x86_64", ["darwin64"])])
def test_the_host_compiler_of_a_mac(machine: str, folders: list[str], monkeypatch) -> None:
    monkeypatch.setattr("platform.system", lambda: "Darwin")
    monkeypatch.setattr("platform.machine", lambda: machine)
    assert choose_platforms("host") == (PLATFORMS["darwin"],)
    (found,) = choose_platforms("host", "host")
    assert list(found.folders) == folders


def test_the_host_compiler_builds_for_the_host_only(monkeypatch) -> None:
    monkeypatch.setattr("platform.system", lambda: "Linux")
    monkeypatch.setattr("platform.machine", lambda: "x86_64")
    assert choose_platforms("linux64", "host") == (PLATFORMS["linux64"],)
    for choice in ("win64", "linux64,win64", "all"):
        with pytest.raises(BuildError, match="not for 'win64'; use --compiler zig"):
            choose_platforms(choice, "host")


def test_a_machine_that_is_not_supported(monkeypatch) -> None:
    monkeypatch.setattr("platform.system", lambda: "Plan9")
    with pytest.raises(BuildError, match="Plan9"):
        choose_platforms("host")
    assert len(choose_platforms("every")) > len(choose_platforms("all")), "zig builds for others even there"


def test_progress_is_told(tmp_path) -> None:
    told: list[tuple[int, int, str]] = []
    export(load("pendulum"), tmp_path / "pendulum.fmu", progress=lambda *what: told.append(what))
    assert told[0] == (0, len(host_platform().targets), "")
    assert [done for done, *_ in told] == list(range(len(told)))
    assert told[-1][0] == told[-1][1]


# --------------------------------------------------------------------------------------------------- universal files


def mach_library(processor: int, size: int) -> bytes:
    return b"".join(n.to_bytes(4, "little") for n in (0xFEEDFACF, processor, 3, 6, 0)) + bytes(size)


def test_a_universal_file_holds_its_libraries() -> None:
    parts = [mach_library(macho.X86_64, 50_000), mach_library(macho.ARM64, 17)]
    found = macho.libraries(universal(parts))
    assert [found[processor].data for processor in (macho.X86_64, macho.ARM64)] == parts


def test_one_library_needs_no_universal_file() -> None:
    assert universal([b"any"]) == b"any"


def test_what_is_no_mach_library() -> None:
    with pytest.raises(ValueError, match="not a Mach-O library of 64 bit: it begins with 0x464c457f"):
        universal([mach_library(macho.ARM64, 8), b"\x7fELF" + bytes(60)])


@pytest.mark.parametrize("reader", [elf.Library, pe.Dll, macho.Library, macho.libraries])
def test_the_readers_refuse_other_files(reader) -> None:
    with pytest.raises(ValueError, match="not a"):
        reader(json.dumps({"no": "library"}).encode() * 10)


@pytest.mark.usefixtures("compiled_anew")
def test_no_room_for_temporary_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "absent"))
    with pytest.raises(BuildError, match="set TMPDIR to another folder"):
        compile_library({}, tmp_path, "x", PLATFORMS["linux64"])
