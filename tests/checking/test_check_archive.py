"""Archives that are refused, rules on archives and libraries, and the exit codes of ``lag2fmu check``."""

from __future__ import annotations

import io
import random
import stat
import struct
import tempfile
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner
from faults import DESCRIPTION, files_of, spoiled, variable, written

from lag2fmu.checking import check_fmu
from lag2fmu.checking.binaries import read_libraries
from lag2fmu.cli import main
from lag2fmu.errors import LoadError
from lag2fmu.fmu import export
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.formats.loading import load

pytestmark = pytest.mark.fmu

BOMB = b"""<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>
<fmiModelDescription fmiVersion="2.0" modelName="&b;"/>"""


@pytest.fixture(scope="module")
def good(exported) -> Path:
    return exported("pendulum").path


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder for temporary files, which must be empty at the end."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def archive(*entries: tuple[zipfile.ZipInfo | str, bytes], description: bytes = b"") -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as target:
        if description:
            target.writestr(DESCRIPTION, description)
        for name, data in entries:
            target.writestr(name, data)
    return stream.getvalue()


def fmi(version: str) -> bytes:
    return f'<fmiModelDescription fmiVersion="{version}" modelName="x"/>'.encode()


def many_entries() -> bytes:
    return archive(*((f"resources/{i}", b"") for i in range(50_001)), description=fmi("2.0"))


def zip_bomb() -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as target:
        target.writestr(DESCRIPTION, fmi("2.0"))
        target.writestr("resources/zeros", bytes(40 << 20))
    return stream.getvalue()


def encrypted() -> bytes:
    data = bytearray(archive(description=fmi("2.0")))
    data[6] |= 1
    data[data.index(b"PK\x01\x02") + 8] |= 1
    return bytes(data)


REFUSED = {
    "no archive": (lambda: b"hello", "no archive"),
    "nothing": (lambda: b"", "no archive"),
    "no description": (lambda: archive(("x", b"")), "no modelDescription.xml"),
    "no XML": (lambda: archive(description=b"<a>"), "no well-formed XML"),
    "unknown encoding": (lambda: archive(description=b'<?xml version="1.0" encoding="foo"?><a/>'), "well-formed"),
    "another root": (lambda: archive(description=b"<a/>"), "it is no FMU"),
    "FMI 1": (lambda: archive(description=fmi("1.0")), "2.0 and 3.0 are read"),
    "FMI 4": (lambda: archive(description=fmi("4.0")), "2.0 and 3.0 are read"),
    "no version": (lambda: archive(description=b"<fmiModelDescription/>"), "2.0 and 3.0 are read"),
    "XML bomb": (lambda: archive(description=BOMB), "document type"),
    "out by ..": (lambda: archive(("resources/../../x", b""), description=fmi("2.0")), "outside of the folder"),
    "out by \\": (lambda: archive(("..\\x", b""), description=fmi("2.0")), "outside of the folder"),
    "out by /": (lambda: archive(("/etc/x", b""), description=fmi("2.0")), "outside of the folder"),
    "out by C:": (lambda: archive(("C:/x", b""), description=fmi("2.0")), "outside of the folder"),
    "zip bomb": (zip_bomb, "zip bomb"),
    "too many entries": (many_entries, "50002 entries"),
    "encrypted description": (encrypted, "encrypted"),
}


@pytest.mark.parametrize(("make", "sentence"), REFUSED.values(), ids=REFUSED.keys())
def test_what_is_no_fmu_or_not_safe(make, sentence: str, tmp_path: Path, temporary: Path) -> None:
    path = tmp_path / "x.fmu"
    path.write_bytes(make())
    done = CliRunner().invoke(main, ["check", str(path)], catch_exceptions=False)
    assert done.exit_code == 2
    assert sentence in done.output
    assert list(temporary.iterdir()) == []
    assert sorted(p.name for p in tmp_path.iterdir()) == ["temporary", "x.fmu"]


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.999])
def test_a_truncated_archive(share: float, good: Path, tmp_path: Path) -> None:
    data = good.read_bytes()
    (tmp_path / "x.fmu").write_bytes(data[: int(share * len(data))])
    with pytest.raises(LoadError, match="no archive"):
        check_fmu(tmp_path / "x.fmu")


def test_an_absent_file_and_a_folder(tmp_path: Path) -> None:
    for path, sentence in ((tmp_path / "absent.fmu", "there is no such file"), (tmp_path, "is not a regular file")):
        done = CliRunner().invoke(main, ["check", str(path)])
        assert done.exit_code == 2
        assert sentence in done.output


def test_exit_codes(good: Path, tmp_path: Path, temporary: Path) -> None:
    done = CliRunner().invoke(main, ["check", str(good)], catch_exceptions=False)
    assert done.exit_code == 0
    assert "0 errors, 0 warnings" in done.output
    bad = spoiled(good, tmp_path / "bad.fmu", lambda root: variable(root, "m")[0].set("max", "0"))
    done = CliRunner().invoke(main, ["check", "--no-run", str(bad)], catch_exceptions=False)
    assert done.exit_code == 1
    assert "start-range" in done.output
    assert "outside of min = 0, max = 0" in done.output
    assert list(temporary.iterdir()) == []


# ------------------------------------------------------------------------------------------------------------- rules


def entry(name: str, **attributes: int) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)
    for key, value in attributes.items():
        setattr(info, key, value)
    return info


ENTRIES = {
    "path-backslash": entry("resources/a"),  # the name is changed below: zipfile does not write backslashes everywhere
    "path-dot": entry("./resources/a"),
    "link": entry("resources/a", external_attr=(stat.S_IFLNK | 0o777) << 16, create_system=3),
    "compression": entry("resources/a", compress_type=zipfile.ZIP_LZMA),
    "top-level": entry("readme.md"),
    "extra": entry("extra/mine/a"),
    "path-case": entry("Model.png"),
    "path-duplicate": entry("model.png"),
    "binary-folder": entry("binaries/plan9/pendulum.so"),
    "binary-name": entry("binaries/linux32/other.so"),
    "sources-header": entry("sources/fmi2Functions.h"),
    "binary-format": entry("binaries/win32/pendulum.dll"),
}


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("rule", ENTRIES)
def test_rules_on_entries(rule: str, good: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.fmu"
    path.write_bytes(good.read_bytes())
    with zipfile.ZipFile(path, "a") as target:
        target.writestr(ENTRIES[rule], b"content")
    if rule == "path-backslash":
        path.write_bytes(path.read_bytes().replace(b"resources/a", b"resources\\a"))
    found = check_fmu(path, run=False)
    assert rule in {f.rule for f in found.findings}


def test_the_end_of_the_name(good: Path, tmp_path: Path) -> None:
    (tmp_path / "x.zip").write_bytes(good.read_bytes())
    assert [f.rule for f in check_fmu(tmp_path / "x.zip", run=False).findings] == ["suffix"]


def test_flags_and_versions_of_the_zip_format(good: Path, tmp_path: Path) -> None:
    data = bytearray(good.read_bytes())
    central = data.index(b"PK\x01\x02")
    struct.pack_into("<H", data, central + 6, 45)
    path = tmp_path / "x.fmu"
    path.write_bytes(data)
    assert [f.rule for f in check_fmu(path, run=False).findings] == ["zip-version"]


def test_a_damaged_file_is_a_finding(good: Path, tmp_path: Path) -> None:
    data = bytearray(good.read_bytes())
    with zipfile.ZipFile(good) as source:
        at = source.getinfo("documentation/index.html").header_offset
    data[at + 200] ^= 0xFF
    path = tmp_path / "x.fmu"
    path.write_bytes(data)
    found = check_fmu(path, run=False)
    assert ("entry-readable", "documentation/index.html") in {(f.rule, f.place) for f in found.findings}


def test_neither_library_nor_source(good: Path, tmp_path: Path) -> None:
    kept = {n: data for n, data in files_of(good).items() if not n.startswith(("binaries/", "sources/"))}
    found = check_fmu(written(kept, tmp_path / "x.fmu"))
    assert "binaries-missing" in {f.rule for f in found.findings}
    assert found.notes == ("not run: there is no library for this machine",)


def test_sources_that_nobody_lists(good: Path, tmp_path: Path) -> None:
    def fault(root) -> None:
        for kind in ("ModelExchange", "CoSimulation"):
            root.find(kind).remove(root.find(f"{kind}/SourceFiles"))

    path = spoiled(good, tmp_path / "x.fmu", fault)
    files = files_of(path)
    del files["sources/buildDescription.xml"]
    found = check_fmu(written(files, path), run=False)
    assert [f.rule for f in found.findings] == ["sources-unlisted"] * 2


# --------------------------------------------------------------------------------------------------------- libraries


@pytest.mark.slow
def test_libraries_for_all_platforms(tmp_path: Path) -> None:
    """Nothing is found in the right folders; in the wrong ones, format and processor are; none here, none is run."""
    path = export(load("pendulum"), tmp_path / "pendulum.fmu", platform="all").path
    assert check_fmu(path).findings == ()
    here = tuple(f"binaries/{folder}/" for folder in host_platform().folders)
    elsewhere = {name: data for name, data in files_of(path).items() if not name.startswith(here)}
    found = check_fmu(written(elsewhere, tmp_path / "elsewhere.fmu"))
    assert found.findings == ()
    assert "not run: there is no library for this machine" in found.notes
    files = files_of(path)
    so, arm = (files[f"binaries/{folder}/pendulum.so"] for folder in ("linux64", "aarch64-linux"))
    files |= {"binaries/linux64/pendulum.so": arm, "binaries/win64/pendulum.dll": so}
    found = check_fmu(written(files, path), run=False)
    assert {(f.rule, f.place) for f in found.findings} == {
        ("binary-processor", "binaries/linux64/pendulum.so"),
        ("binary-format", "binaries/win64/pendulum.dll"),
    }


def test_a_library_that_is_cut(good: Path, tmp_path: Path) -> None:
    files = files_of(good)
    (name,) = {n for n in files if n.startswith("binaries/")} - {"binaries/aarch64-darwin/pendulum.dylib"}
    for length in (0, 100, 300):
        found = check_fmu(written(files | {name: files[name][:length]}, tmp_path / "x.fmu"), run=False)
        assert next(f.rule for f in found.findings).startswith("binary-")


def test_a_damaged_library_is_read_as_far_as_it_goes(good: Path) -> None:
    """Bytes that were changed at random lead to no exception."""
    (library, *_) = (data for name, data in files_of(good).items() if name.startswith("binaries/"))
    generator = random.Random(1)
    assert read_libraries(library)
    for _ in range(50):
        damaged = bytearray(library)
        for _ in range(20):
            damaged[generator.randrange(64, generator.choice([512, len(library)]))] = generator.randrange(256)
        read_libraries(bytes(damaged))


def test_a_library_of_another_description(good: Path, tmp_path: Path) -> None:
    path = spoiled(good, tmp_path / "x.fmu", lambda root: root.set("guid", "{0123456789-0123456789}"))
    assert "binary-guid" in {f.rule for f in check_fmu(path, run=False).findings}
