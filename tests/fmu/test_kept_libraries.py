"""Libraries that are kept where LAG2FMU_LIBRARIES says so."""

import pytest

from lag2fmu import kept_libraries
from lag2fmu.errors import BuildError
from lag2fmu.fmu import compilers
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import compile_library, host_platform
from lag2fmu.formats.loading import load
from lag2fmu.reference import native


@pytest.fixture
def commands(monkeypatch, tmp_path) -> list[list[str]]:
    """The commands that were run, with an empty folder of kept libraries; each writes another library."""
    monkeypatch.setenv(kept_libraries.VARIABLE, str(tmp_path / "kept"))
    run: list[list[str]] = []

    def wrote(command, folder) -> None:
        run.append(command)
        (folder / command[command.index("-o") + 1]).write_bytes(b"library %d" % len(run))

    monkeypatch.setattr(compilers, "_run", wrote)
    return run


def compiled(text: str, name: str = "x", compiler: str = "zig") -> bytes:
    return compile_library({"a.c": text}, fmi_headers(), name, host_platform(), compiler)


def test_the_same_sources_are_compiled_once(commands, tmp_path) -> None:
    assert [compiled("1"), compiled("2"), compiled("1"), compiled("1", "y")] == [
        b"library 1",
        b"library 2",
        b"library 1",
        b"library 3",
    ]
    assert len(commands) == len(list((tmp_path / "kept").iterdir())) == 3


def test_without_a_folder_and_by_other_compilers_nothing_is_kept(commands, monkeypatch) -> None:
    monkeypatch.setenv("CC", "true")
    assert compiled("1", compiler="host") != compiled("1", compiler="host")
    monkeypatch.delenv(kept_libraries.VARIABLE)
    assert compiled("1") != compiled("1")


def test_a_folder_that_cannot_be_used_is_named(commands, monkeypatch, tmp_path) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv(kept_libraries.VARIABLE, str(tmp_path / "file"))
    with pytest.raises(BuildError, match=r"file' of LAG2FMU_LIBRARIES cannot be used: .*name another one, or none"):
        compiled("1")


def test_the_terms_of_the_direct_integration_are_kept(monkeypatch, tmp_path) -> None:
    """Beside the FMU's libraries: another process finds what this one compiled."""
    monkeypatch.setenv(kept_libraries.VARIABLE, str(tmp_path))
    compiled_terms, mechanism = native._compiled.__wrapped__, load("pendulum")
    assert compiled_terms(mechanism) is not None
    monkeypatch.setattr(native, "_library", lambda *_: pytest.fail("compiled twice"))
    assert compiled_terms(mechanism) is not None
    assert len(list(tmp_path.iterdir())) == 1
