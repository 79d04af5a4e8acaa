"""The folder sources/: declared in both places, complete, and rebuilt by several compilers with the same results."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Iterable
from pathlib import Path

import pytest
from archives import functions_of_fmi, xml
from compiling import COMPILERS
from delivered import before_joining, sections
from elf import Library
from fmpy.build import build_platform_binary
from fmpy.model_description import read_build_description
from headers import headers_of_fmi
from stepping import Stepping, bits

from lag2fmu.codegen.sources import ROOMS
from lag2fmu.fmu import Fmu
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.sources import ALL
from lag2fmu.fmu.translation_units import including

pytestmark = pytest.mark.fmu
on_linux = pytest.mark.skipif(sys.platform != "linux", reason="reads ELF libraries")

STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
IN_ORDER = [f"{room}.c" for room in (*ROOMS, "drivers")]
"""The files of rooms; a smooth mechanism has no laws of contacts."""
MODELS = ["double_pendulum", "motion_driven_pendulum", "slides_problem_6"]


@pytest.fixture(params=MODELS)
def fmu(request, exported) -> Fmu:
    return exported(request.param)


@pytest.fixture
def folder(fmu: Fmu, tmp_path: Path) -> Path:
    """The FMU, unpacked."""
    with zipfile.ZipFile(fmu.path) as archive:
        archive.extractall(tmp_path / "unpacked")
    return tmp_path / "unpacked"


def library_of(folder: Path) -> Path:
    (path,) = (folder / "binaries").glob("*/*.*")
    return path


def build(folder: Path, *command: str, files: Iterable[str] = (ALL,)) -> bytes:
    """Put the library that ``command`` makes of the sources in the place of the one that was shipped; its bytes.

    Compiled are ``files``, by default the one that includes all.
    """
    library = library_of(folder)
    library.unlink()
    arguments = [*command, f"-I{fmi_headers()}", "-shared", "-fPIC", "-o", str(library), *files, "-lm"]
    subprocess.run(arguments, cwd=folder / "sources", check=True)
    return library.read_bytes()


def packed(folder: Path) -> Path:
    target = folder.parent / "rebuilt.fmu"
    with zipfile.ZipFile(target, "w") as archive:
        for path in sorted(folder.rglob("*")):
            archive.write(path, path.relative_to(folder).as_posix())
    return target


def run(path: Path) -> list[list[float]]:
    """States in co-simulation, with a force, and after it."""
    with Stepping(path) as host:
        host.start(tolerance=1e-9)
        found = host.steps(10, 0.1)
        host.set({name: 0.5 for name in host.references if name.startswith("Q_")})
        return found + host.steps(10, 0.1)


# --------------------------------------------------------------------------------------------------------- what is said


def test_source_files_are_declared_in_both_places(fmu: Fmu) -> None:
    with zipfile.ZipFile(fmu.path) as archive:
        names = {name.removeprefix("sources/") for name in archive.namelist() if name.startswith("sources/")}
        described = ET.fromstring(archive.read("sources/buildDescription.xml"))
    compiled = sorted(name for name in names if name.endswith(".c"))
    assert {ALL, "mechanism.c"} < set(compiled) <= {ALL, "mechanism.c", *IN_ORDER}
    assert {name.rpartition(".")[2] for name in names} == {"c", "h", "xml"}
    assert not any(name.startswith("fmi2") and name.endswith(".h") for name in names), (
        "FMI's headers are the importer's"
    )
    for kind in ("ModelExchange", "CoSimulation"):
        assert [f.get("name") for f in xml(fmu).find(kind).find("SourceFiles")] == [ALL]
    assert [f.get("name") for f in described.iter("SourceFile")] == [ALL]
    assert described.find("BuildConfiguration").get("modelIdentifier") == fmu.description.model_identifier


def test_fmpy_reads_the_build_description(fmu: Fmu) -> None:
    """With validation against the schema of FMI 3.0."""
    (configuration,) = read_build_description(str(fmu.path))
    (file_set,) = configuration.sourceFileSets
    assert file_set.language == "C99"
    assert file_set.preprocessorDefinitions[0].name == "FMI2_OVERRIDE_FUNCTION_PREFIX"


def test_one_file_includes_the_others(folder: Path) -> None:
    """The prefix first, FMI's included (FMI 2.0.5, section 2.1.1), and then each file once, in the order of rooms."""
    others = {path.name for path in (folder / "sources").glob("*.[ch]")} - {ALL}
    lines = (folder / "sources" / ALL).read_text("utf-8").split("\n", 1)[1]
    order = ["prefix.h", "mechanism.h", *(file for file in IN_ORDER if file in others), "mechanism.c"]
    assert set(order) == others
    assert lines == including(order)
    assert "#define FMI2_FUNCTION_PREFIX " in (folder / "sources" / "prefix.h").read_text("utf-8")


def test_nothing_of_the_engine_is_lost(folder: Path, request: pytest.FixtureRequest) -> None:
    """Each file that the mechanism needs is there once, as it stands, but for guards and what includes others."""
    (model,) = (name for name in MODELS if name in request.node.name)
    _, before = before_joining(model)
    found = sections(folder / "sources")
    assert found.keys() == before.keys()
    for name, text in before.items():
        guard = f"{name.removesuffix('.h').upper()}_H"
        left_out = {f"#ifndef {guard}", f"#define {guard}", "#endif", ""}
        kept = [line for line in text.splitlines() if not re.match(r'#include "(?!fmi)', line)]
        assert [line for line in found[name].splitlines() if line not in left_out] == [
            line for line in kept if line not in left_out
        ], name


# -------------------------------------------------------------------------------------------------------------- rebuilt


@pytest.mark.parametrize("compiler", COMPILERS)
def test_other_compilers_give_the_same_motion(compiler: str, fmu: Fmu, folder: Path) -> None:
    build(
        folder,
        *COMPILERS[compiler],
        "-std=c99",
        "-O2",
        "-ffp-contract=off",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Werror",
    )
    for one, other in zip(run(packed(folder)), run(fmu.path), strict=True):
        assert one == pytest.approx(other, rel=1e-8, abs=1e-8)


@pytest.mark.skipif(shutil.which("cmake") is None, reason="fmpy compiles with CMake, which is not on this machine")
def test_fmpy_compiles(fmu: Fmu, folder: Path, tmp_path: Path) -> None:
    library_of(folder).unlink()
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    expected = run(fmu.path)
    for one, other in zip(run(packed(folder)), expected, strict=True):
        assert one == pytest.approx(other, rel=1e-8, abs=1e-8)
    assert len({bits(states) for states in expected}) > 1


@on_linux
@pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no gcc on this machine")
def test_the_prefix_and_its_override(fmu: Fmu, folder: Path, tmp_path: Path) -> None:
    """With the header of FMI 2.0.5, whose macros these are: prefixed names for linking, plain ones for a library."""
    headers = headers_of_fmi(tmp_path)
    prefix = f"{fmu.description.model_identifier}_"
    flags = ("gcc", f"-I{headers}", "-fvisibility=hidden")
    plain = build(folder, *flags, "-DFMI2_OVERRIDE_FUNCTION_PREFIX")
    assert Library(plain).exported == functions_of_fmi()
    prefixed = build(folder, *flags)
    assert Library(prefixed).exported == {prefix + name for name in functions_of_fmi()}


@on_linux
@pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no gcc on this machine")
def test_a_library_that_hides_no_symbol_calls_its_own_functions(fmu: Fmu, folder: Path) -> None:
    """The program and the C library come first when names are bound, and the C library has a function ``warn``."""
    library = Library(build(folder, "gcc", "-std=c99", "-O0"))
    prefix = f"{fmu.description.model_identifier}_"
    assert {name for name in library.exported if not name.startswith(prefix)} == functions_of_fmi()
    with Stepping(packed(folder)) as host:
        host.unit.setDebugLogging(True, ["logStatusWarning", "logWeather"])
        assert [(status, sentence.split(":")[0]) for status, _, sentence in host.log] == [(1, "fmi2SetDebugLogging")]
