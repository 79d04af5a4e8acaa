"""Names taken out of the exports of libraries for macOS: gone for loader and tools, all else as it was."""

from __future__ import annotations

import functools
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import macho
import pytest
from compiling import UNOPTIMISED

from lag2fmu.building.process import of_processor_alone
from lag2fmu.fmu.mach import hide

if TYPE_CHECKING:
    import lief

pytestmark = [pytest.mark.fmu, pytest.mark.slow]

SOURCE = """
#include <string.h>
int count;
int fmi2Count(void) { return ++count; }
int fmi2CountTwice(void) { return fmi2Count() + fmi2Count(); }
int secret(const char *text) { return (int)strlen(text); }
int fmi2Secret(void) { return secret("secret"); }
"""
TARGETS = {"x86_64": "x86_64-macos.11.0", "aarch64": "aarch64-macos.11.0"}


@pytest.fixture(scope="module", params=TARGETS.values(), ids=TARGETS)
def library(request, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("mach")
    (folder / "x.c").write_text(SOURCE)
    command = [sys.executable, "-m", "ziglang", "cc", "-s", "-target", request.param, *UNOPTIMISED["zig"]]
    command += [*of_processor_alone(request.param), "-shared", "-o", "x.dylib", "x.c"]
    subprocess.run(command, cwd=folder, check=True)
    return Path(folder / "x.dylib").read_bytes()


@functools.cache
def parsed(data: bytes) -> lief.MachO.FatBinary:
    """Kept, because LIEF's objects are not alive without it."""
    import lief  # a large module, which the tests of 'make test' do not need

    found = lief.MachO.parse(list(data))
    assert found is not None
    return found


def read(data: bytes) -> lief.MachO.Binary:
    return parsed(data).at(0)


def defined(data: bytes, *, exported: bool) -> dict[str, int]:
    """The addresses of the symbols that are (not) marked as visible to other libraries, by name."""
    found = {s.name: (s.raw_type, s.value) for s in read(data).symbols if s.raw_type & 0x0E}
    return {name: value for name, (kind, value) in found.items() if bool(kind & 1) == exported}


OF_ZIG = {"_mh_dylib_header", "__dso_handle"}
NAMES = frozenset({"_secret", "_count", "__mh_dylib_header", "___dso_handle"})


def test_hidden_names_are_not_exported(library: bytes) -> None:
    hidden = hide(library, NAMES)
    all_names = macho.Library(library).exported
    assert all_names == {"count", "secret", "fmi2Count", "fmi2CountTwice", "fmi2Secret", *OF_ZIG}
    assert macho.Library(hidden).exported == {"fmi2Count", "fmi2CountTwice", "fmi2Secret"}
    assert set(defined(hidden, exported=True)) == {"_fmi2Count", "_fmi2CountTwice", "_fmi2Secret"}
    assert set(defined(hidden, exported=False)) >= NAMES


def test_addresses_stay(library: bytes) -> None:
    hidden = hide(library, NAMES)
    assert len(hidden) == len(library)
    everything = defined(library, exported=True) | defined(library, exported=False)
    assert defined(hidden, exported=True) | defined(hidden, exported=False) == everything
    before = {s.name: s.export_info.address for s in read(library).exported_symbols}
    after = {s.name: s.export_info.address for s in read(hidden).exported_symbols}
    assert after == {name: address for name, address in before.items() if name not in NAMES}
    # the words of the trie mean the places that the symbol table tells, counted from where the library begins
    assert after == {name: address - read(hidden).imagebase for name, address in defined(hidden, exported=True).items()}


def test_the_layout_is_sound(library: bytes) -> None:
    """By LIEF's copy of the checks of Apple's tools; the indirect symbols still mean the same names."""
    hidden = hide(library, NAMES)
    import lief

    assert lief.MachO.check_layout(read(hidden)) == (True, "")
    one, other = ([s.name for s in read(data).dynamic_symbol_command.indirect_symbols] for data in (library, hidden))
    assert one == other


def test_the_signature_fits(library: bytes) -> None:
    was = macho.Library(library)
    assert was.signed == (was.processor[0] == macho.ARM64)
    assert macho.Library(hide(library, NAMES)).signed == was.signed
    if was.signed:
        changed = bytearray(library)
        changed[len(library) // 3] ^= 1
        assert not macho.Library(bytes(changed)).signed


def test_what_is_not_exported_needs_no_hiding(library: bytes) -> None:
    assert macho.Library(hide(library, frozenset({"_no_such_name"}))).exported == macho.Library(library).exported
