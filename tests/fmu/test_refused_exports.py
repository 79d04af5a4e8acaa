"""Exports that cannot be done: one error that says why, and no file that is half written."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import pytest

import lag2fmu
from lag2fmu.errors import BuildError, ExportError
from lag2fmu.fmu import export
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Mechanism

pytestmark = pytest.mark.fmu
on_linux = pytest.mark.skipif(sys.platform != "linux", reason="reads ELF libraries")


@pytest.fixture
def pendulum() -> Mechanism:
    return load("pendulum")


def compiler(folder: Path, script: str) -> str:
    """A compiler that is a shell script."""
    path = folder / "compiler"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


@pytest.fixture
def target(tmp_path) -> Iterator[Path]:
    """A path in an empty folder that must be empty afterwards."""
    folder = tmp_path / "target"
    folder.mkdir()
    yield folder / "pendulum.fmu"
    assert list(folder.iterdir()) == []


needs_shell = pytest.mark.skipif(os.name != "posix", reason="the failing compilers are shell scripts")


@needs_shell
def test_a_failing_compiler(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler(tmp_path, "echo 'mechanism.c:7: made up' >&2; exit 3"))
    with pytest.raises(BuildError, match=r"exit code 3[\s\S]*mechanism\.c:7: made up"):
        export(pendulum, target, compiler="host")


@needs_shell
def test_a_compiler_that_fails_without_a_word(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler(tmp_path, "exit 1"))
    with pytest.raises(BuildError, match="failed with exit code 1"):
        export(pendulum, target, compiler="host")


@needs_shell
def test_a_compiler_that_is_killed(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler(tmp_path, "kill -9 $$"))
    with pytest.raises(BuildError, match="failed with exit code 137"):
        export(pendulum, target, compiler="host")


@needs_shell
def test_a_compiler_that_writes_nothing(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("CC", compiler(tmp_path, "exit 0"))
    with pytest.raises(BuildError, match="wrote no library"):
        export(pendulum, target, compiler="host")


def test_no_compiler_at_all(pendulum, target, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(BuildError, match=r"no C compiler found; looked for \$CC = no-such-compiler, cc, gcc, clang"):
        export(pendulum, target, compiler="host")


@pytest.mark.parametrize("keyword", [{"compiler": "msvc"}, {"solver": "euler"}])
def test_unknown_compiler_or_solver(pendulum, target, keyword) -> None:
    with pytest.raises((BuildError, ExportError), match=f"unknown {next(iter(keyword))} .*known are"):
        export(pendulum, target, **keyword)


def test_a_failed_export_leaves_the_older_file_alone(pendulum, tmp_path, exported) -> None:
    target = tmp_path / "pendulum.fmu"
    before = exported("pendulum").path.read_bytes()
    target.write_bytes(before)
    with pytest.raises(BuildError):
        export(load("double_pendulum"), target, compiler="msvc")
    assert target.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["pendulum.fmu"]


@pytest.mark.parametrize(
    ("path", "sentence"),
    [
        ("folder.fmu", "is a folder"),
        ("missing/pendulum.fmu", "does not exist"),
        ("pendulum.zip", "does not end in .fmu"),
        ("pendulum", "does not end in .fmu"),
        ("file/pendulum.fmu", "does not exist"),
    ],
)
def test_paths_that_cannot_be_written(path: str, sentence: str, pendulum, tmp_path) -> None:
    (tmp_path / "folder.fmu").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(ExportError, match=sentence) as caught:
        export(pendulum, tmp_path / path)
    assert str(tmp_path) in str(caught.value)
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "folder.fmu"]


def test_a_version_of_fmi_is_a_text(pendulum, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"unknown version of FMI 3\.0; give it as a text, '3\.0'"):
        export(pendulum, tmp_path / "x.fmu", fmi=3.0)  # type: ignore[arg-type]


def test_a_page_in_no_folder_is_refused_before_the_work(pendulum, tmp_path: Path) -> None:
    with (
        pytest.raises(ExportError, match=r"x\.html': its folder does not exist; create it"),
        mock.patch("lag2fmu.fmu.live.paging.derived", side_effect=AssertionError),
    ):
        lag2fmu.page(pendulum, tmp_path / "none" / "x.html")


@on_linux
def test_a_folder_that_takes_no_files(pendulum) -> None:
    """/proc takes none even from root."""
    with pytest.raises(ExportError, match=r"cannot write '/proc/pendulum\.fmu'"):
        export(pendulum, "/proc/pendulum.fmu")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_an_unwritable_folder(pendulum, target) -> None:
    target.parent.chmod(0o555)
    try:
        with pytest.raises(ExportError, match="cannot write"):
            export(pendulum, target)
    finally:
        target.parent.chmod(0o755)
