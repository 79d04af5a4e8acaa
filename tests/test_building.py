"""What compilers made is kept, and compilers end with those who started them."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path

import pytest
from click.testing import CliRunner

from lag2fmu.building import build_cache, folders, process
from lag2fmu.building.build_cache import kept, kept_files
from lag2fmu.cli import main
from lag2fmu.codegen import templates
from lag2fmu.fmu import compilers
from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import compile_library
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.formats.loading import load
from lag2fmu.reference import native
from lag2fmu.reference.composition import composition_of

posix = pytest.mark.skipif(os.name == "nt", reason="owners and modes are those of POSIX")


@pytest.fixture
def folder(monkeypatch, tmp_path) -> Path:
    """The folder of kept libraries, not made yet."""
    folders.say_once.cache_clear()
    monkeypatch.setenv(build_cache.VARIABLE, str(tmp_path / "kept"))
    return tmp_path / "kept"


@pytest.fixture
def commands(monkeypatch, folder) -> list[list[str]]:
    """The commands that were run, with an empty folder of kept libraries; each writes another library."""
    run: list[list[str]] = []

    def wrote(command, place) -> None:
        run.append(command)
        (place / command[command.index("-o") + 1]).write_bytes(b"library %d" % len(run))

    monkeypatch.setattr(compilers, "_run", wrote)
    return run


def compiled(text: str, name: str = "x", compiler: str = "zig") -> bytes:
    return compile_library({"a.c": text}, fmi_headers(), name, host_platform(), compiler)


def test_the_same_sources_are_compiled_once(commands, folder) -> None:
    made = [compiled("1"), compiled("2"), compiled("1"), compiled("1", "y")]
    assert made == [b"library 1", b"library 2", b"library 1", b"library 3"]
    assert len(commands) == len(kept_files(folder)) == 3


def test_templates_are_kept_too(folder, monkeypatch) -> None:
    """The second environment compiles none, and prints the same."""
    texts = []
    for _ in range(2):
        templates._environment.cache_clear()
        texts.append(templates.render("mechanism/step_control.h.jinja", {"control": {"SAFETY": 0.9}}))
        monkeypatch.setattr(templates.Environment, "compile", None)
    templates._environment.cache_clear()
    assert texts[0] == texts[1]
    assert len(kept_files(folder)) == 1


@pytest.mark.parametrize("off", ["", "off"])
def test_switched_off_and_by_other_compilers_nothing_is_kept(commands, monkeypatch, off) -> None:
    monkeypatch.setenv("CC", "true")
    assert compiled("1", compiler="host") != compiled("1", compiler="host")
    monkeypatch.setenv(build_cache.VARIABLE, off)
    assert compiled("1") != compiled("1")


def test_by_default_the_folder_is_in_the_users_cache(monkeypatch, tmp_path) -> None:
    monkeypatch.delenv(build_cache.VARIABLE)
    for name in ("XDG_CACHE_HOME", "HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(name, str(tmp_path))
    assert tmp_path in build_cache.place().parents


def test_a_folder_that_cannot_be_used_is_named_and_passed_by(commands, monkeypatch, tmp_path, caplog) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv(build_cache.VARIABLE, str(tmp_path / "file"))
    assert (compiled("1"), compiled("1")) == (b"library 1", b"library 2")
    assert caplog.text.count("file' cannot keep libraries: File exists; all is compiled anew") == 1


@posix
@pytest.mark.parametrize(
    ("mode", "owner", "reason"),
    [(0o777, 0, "other users may write to it"), (0o700, 1, "it belongs to another user, of number")],
)
def test_a_folder_of_others_is_not_used(folder, monkeypatch, caplog, mode, owner, reason) -> None:
    folder.mkdir()
    folder.chmod(mode)
    me = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: me + owner)
    assert kept("a", lambda: b"made") == b"made"
    assert kept_files(folder) == []
    assert reason in caplog.text


@posix
def test_a_new_folder_and_its_files_are_the_users_alone(folder) -> None:
    kept("a", lambda: b"made")
    ((file, found),) = kept_files(folder)
    assert (folder.stat().st_mode & 0o777, found.st_mode & 0o777) == (0o700, 0o600)
    file.chmod(0o666)
    assert kept("a", lambda: b"anew") == b"anew"


def test_a_full_disk_costs_nothing_but_time(folder, monkeypatch, caplog) -> None:
    monkeypatch.setattr(folders, "LEAST_FREE", 2**80)
    assert kept("a", lambda: b"made") == b"made"
    assert "its disk is full" in caplog.text
    monkeypatch.setattr(folders, "LEAST_FREE", 0)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    assert kept("a", lambda: b"made") == b"made"
    assert "did not take a library: No space left on device" in caplog.text
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("damage", [lambda b: b[:-1] + b"?", lambda b: b[:20], lambda _: b""])
def test_a_damaged_library_is_built_anew(folder, caplog, damage) -> None:
    kept("a", lambda: b"made")
    ((file, _),) = kept_files(folder)
    file.write_bytes(damage(file.read_bytes()))
    assert kept("a", lambda: b"anew") == b"anew"
    assert "its content has changed" in caplog.text
    assert kept("a", lambda: b"again") == b"anew"


def test_one_kept_library_does_not_stand_for_another(folder) -> None:
    kept("a", lambda: b"made")
    ((file, _),) = kept_files(folder)
    kept("b", lambda: b"other")
    other = next(place for place, _ in kept_files(folder) if place != file)
    other.write_bytes(file.read_bytes())
    assert kept("b", lambda: b"anew") == b"anew"


def test_what_was_not_used_for_long_goes_and_other_files_stay(folder, monkeypatch) -> None:
    monkeypatch.setattr(build_cache, "MOST", 3200)
    folder.mkdir(mode=0o700)
    (folder / "thesis.txt").write_text("mine" * 1000)
    for second, name in enumerate("abc"):
        before = kept_files(folder)
        kept(name, lambda: bytes(1000))
        ((new, _),) = [pair for pair in kept_files(folder) if pair[0] not in [file for file, _ in before]]
        os.utime(new, (second, second))
    kept("a", lambda: b"no")  # used again: b and c are older
    kept("d", lambda: bytes(900))
    assert [found.st_size for _, found in kept_files(folder)] == [1032, 1032, 932]
    assert (kept("a", lambda: b"no"), kept("b", lambda: b"gone")) == (bytes(1000), b"gone")
    assert (folder / "thesis.txt").exists()


def _made(number: int) -> bytes:
    return kept("same", lambda: time.sleep(0.3) or bytes([number]) * 10**6)  # type: ignore[func-returns-value]


def test_two_processes_build_the_same_at_once(folder) -> None:
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        assert all(len(set(made)) == 1 and len(made) == 10**6 for made in pool.map(_made, (1, 2)))
    assert len(kept_files(folder)) == 1


def test_the_verb_shows_and_empties(monkeypatch, folder, tmp_path) -> None:
    monkeypatch.setattr(folders, "cache_folder", lambda: tmp_path / "cache")
    kept("a", lambda: bytes(10**6))
    (folder / "thesis.txt").write_text("mine")
    (tmp_path / "cache" / "compiler").mkdir(parents=True)
    (tmp_path / "cache" / "compiler" / "part").write_bytes(bytes(2 * 10**6))
    (tmp_path / "cache" / "compiler" / "gone").symlink_to("nowhere")  # as what a compiler removes meanwhile
    assert "libraries: 1, 1.0 MB of at most 536.9 MB" in CliRunner().invoke(main, ["cache"]).output
    output = CliRunner().invoke(main, ["cache", "--empty"]).output
    assert "libraries: 0, 0.0 MB" in output
    assert "compiler: 0.0 MB" in output
    assert [file.name for file in folder.iterdir()] == ["thesis.txt"]


def test_the_terms_of_the_direct_integration_are_kept(monkeypatch, folder) -> None:
    """Beside the FMU's libraries: another process finds what this one compiled."""
    compiled_terms, composition = native.native_terms.__wrapped__, composition_of(load("pendulum"))
    assert compiled_terms(composition) is not None
    monkeypatch.setattr(native, "_library", lambda *_: pytest.fail("compiled twice"))
    assert compiled_terms(composition) is not None
    assert len(kept_files(folder)) == 1


# ---------------------------------------------------------------------------------------------------------- processes

SLEEPER = "import time; open('begun', 'w').close(); time.sleep({seconds}); open('ended', 'w').close()"
STARTER = """
import sys, signal
from pathlib import Path
from lag2fmu.building.process import compiling, run
signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
signal.signal(signal.SIGINT, signal.default_int_handler)
with compiling(1) as pool:
    pool.submit(run, [sys.executable, "-c", sys.argv[1]], Path(sys.argv[2])).result()
"""


@posix
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_compiler_ends_with_the_command(tmp_path, how) -> None:
    starter = subprocess.Popen(
        [sys.executable, "-c", STARTER, SLEEPER.format(seconds=2), str(tmp_path)], stderr=subprocess.DEVNULL
    )
    for _ in range(200):
        if (tmp_path / "begun").exists():
            break
        time.sleep(0.05)
    starter.send_signal(how)
    assert starter.wait(3) != 0
    time.sleep(2.2)
    assert not (tmp_path / "ended").exists()


def test_output_and_code_of_a_compiler(tmp_path) -> None:
    done = process.run([sys.executable, "-c", "import sys; print('out'); sys.exit('bad ä')"], tmp_path)
    assert (done.code, done.output.strip(), done.errors.strip()) == (1, "out", "bad ä")


@pytest.mark.skipif(not Path("/proc/locks").exists(), reason="only Linux tells who waits")
def test_waiting_for_a_lock_is_said(tmp_path, monkeypatch, caplog) -> None:
    import fcntl

    folders.say_once.cache_clear()
    monkeypatch.setattr(process, "_WATCHED", 0.2)
    with (tmp_path / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        script = "import fcntl; fcntl.flock(open('lock'), fcntl.LOCK_SH)"
        with process.compiling(1) as pool:
            waiting = pool.submit(process.run, [sys.executable, "-c", script], tmp_path)
            time.sleep(1.5)
            assert "another process compiles with the same compiler" in caplog.text
            fcntl.flock(lock, fcntl.LOCK_UN)
            assert waiting.result().code == 0


def test_the_version_of_the_compiler_is_that_of_its_package(monkeypatch, tmp_path) -> None:
    """It is read off a folder's name; where there is none or several, Python tells it."""
    installed = version("ziglang")
    assert process.zig_version() == installed
    monkeypatch.setattr(process, "zig", lambda: str(tmp_path / "ziglang" / "zig"))
    for beside, expected in (((), installed), (("1.2.3",), "1.2.3"), (("1.2.3", "1.2.4"), installed)):
        for number in beside:
            (tmp_path / f"ziglang-{number}.dist-info").mkdir(exist_ok=True)
        process.zig_version.cache_clear()
        assert process.zig_version() == expected


def test_installations_of_the_compiler_share_no_folder(monkeypatch, tmp_path) -> None:
    found = set()
    for place in ("one", "other"):
        monkeypatch.setattr(process, "zig", lambda place=place: str(tmp_path / place / "zig"))
        found.add(process.compiler_folder())
    assert len(found) == 2


@posix
def test_a_compiler_without_a_folder_of_its_own_gets_one_for_the_moment(monkeypatch, tmp_path, caplog) -> None:
    folders.say_once.cache_clear()
    monkeypatch.delenv(process.CACHE, raising=False)
    monkeypatch.setattr(process, "cache_folder", lambda: tmp_path / "file")
    (tmp_path / "file").touch()
    assert process._with_cache(tmp_path)[process.CACHE] == str(tmp_path / "cache")
    assert f"or set {process.CACHE} to a folder that can be written" in caplog.text
    monkeypatch.setenv(process.CACHE, "of the user")
    assert process._with_cache(tmp_path) == dict(os.environ)


def test_folders_of_old_weeks_and_of_removed_installations_go(monkeypatch, tmp_path) -> None:
    monkeypatch.delenv(process.CACHE, raising=False)
    monkeypatch.setattr(process, "cache_folder", lambda: tmp_path)
    gone = tmp_path / "compiler" / "0.1-gone"
    leaving = tmp_path / "compiler" / "0.1-leaving" / "place.txt"
    leaving.parent.mkdir(parents=True)
    leaving.symlink_to("nowhere")  # as where another process has just removed it
    kept_folder = process.compiler_folder()
    for place in (gone, kept_folder / "objects-12", tmp_path / "work"):
        place.mkdir(parents=True)
    kept_folder.chmod(0o700)
    (gone / "place.txt").write_text(str(tmp_path / "no" / "zig"), "utf-8")
    environment = process._with_cache(tmp_path / "work")
    assert environment[process.CACHE] == str(kept_folder)
    assert not gone.exists()
    assert [place.name for place in kept_folder.glob("objects-*")] == [Path(environment["ZIG_LOCAL_CACHE_DIR"]).name]


# ------------------------------------------------------------------------------------------------------ kept sources


def test_equal_sources_stand_at_one_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By which zig finds what it made of them; what was changed there is written anew."""
    monkeypatch.setenv(process.CACHE, str(tmp_path))
    files = {"a.c": '#include "a.h"\n', "a.h": "int a;\n"}
    folder = process.placed(files)
    assert folder is not None
    assert {file.name: file.read_text("utf-8") for file in folder.iterdir()} == files
    assert process.placed({**files, "a.h": "int b;\n"}) != folder
    (folder / "a.h").write_text("int c;\n", "utf-8")
    assert process.placed(files) == folder
    assert (folder / "a.h").read_text("utf-8") == files["a.h"]


@pytest.mark.skipif(os.name != "posix", reason="Windows guards the user's folders by itself")
def test_sources_are_kept_nowhere_where_others_may_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tmp_path.chmod(0o777)
    monkeypatch.setenv(process.CACHE, str(tmp_path))
    assert process.placed({"a.c": "int a;\n"}) is None
    assert list(tmp_path.iterdir()) == []
