"""The library inside an FMU: what it shows, what it needs, what it holds."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from archives import functions_of_fmi, library, xml
from elf import Library
from stepping import Stepping

import lag2fmu
from lag2fmu.fmu import Fmu, export
from lag2fmu.formats.loading import load

pytestmark = pytest.mark.fmu
on_linux = pytest.mark.skipif(sys.platform != "linux", reason="reads ELF libraries")


@on_linux
def test_the_library_shows_the_functions_of_fmi_and_nothing_else(fmu: Fmu) -> None:
    found = Library(library(fmu))
    assert len(functions_of_fmi()) == 44
    assert found.exported == functions_of_fmi()


@on_linux
@pytest.mark.parametrize(("model", "arguments"), [("double_pendulum", {}), ("n_pendulum", {"n": "5"})])
def test_the_library_is_small_and_stripped(model: str, arguments: dict[str, str], exported) -> None:
    data = library(exported(model, optimised=True, **arguments))
    assert len(data) < 100_000
    assert Library(data).stripped


@on_linux
def test_the_library_runs_on_old_systems(fmu: Fmu) -> None:
    found = Library(library(fmu))
    versions = {tuple(map(int, v.removeprefix("GLIBC_").split("."))) for v in found.versions if v.startswith("GLIBC_")}
    assert versions, "the C library is versioned"
    assert max(versions) <= (2, 17)
    assert found.needed <= {"libm.so.6", "libc.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
    assert not found.search_paths


def test_the_library_holds_the_guid_and_no_path_of_this_machine(fmu: Fmu) -> None:
    data = library(fmu)
    assert data.count(xml(fmu).attrib["guid"].encode()) >= 1
    for folder in (str(Path.home()), str(Path(lag2fmu.__file__).parents[1]), "/tmp", "lag2fmu-"):
        assert f"{folder}/".encode() not in data


@on_linux
@pytest.mark.usefixtures("host_compiler")
def test_the_host_compiler_gives_the_same_motion(exported, tmp_path) -> None:
    """Another compiler and C library: equal to rounding, not to the bit."""
    host_built = export(load("double_pendulum"), tmp_path / "double_pendulum.fmu", compiler="host")
    assert Library(library(host_built)).exported == functions_of_fmi()
    with Stepping(host_built.path) as one, Stepping(exported("double_pendulum").path) as other:
        one.start(tolerance=1e-8)
        other.start(tolerance=1e-8)
        assert one.step(3.0) == pytest.approx(other.step(3.0), rel=1e-10)
