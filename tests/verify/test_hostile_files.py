"""Files that are made to hurt: each is answered by one sentence, in bounded time and memory."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from lag2fmu import xml_tree
from lag2fmu.checking import apart, check_fmu, process
from lag2fmu.cli import main
from lag2fmu.fmu import MECHANISM_ENTRY

HEAD = '<fmiModelDescription fmiVersion="2.0" modelName="x" guid="1"><CoSimulation modelIdentifier="x"/>'
VERBS = ("check", "validate", "simulate")


def run(*arguments: str | Path) -> Result:
    done = CliRunner().invoke(main, [str(a) for a in arguments], catch_exceptions=False)
    assert done.exit_code == 2
    assert len(done.output.strip().splitlines()) == 1
    return done


def archive(path: Path, description: str, mechanism: bytes = b"", method: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", method) as target:
        target.writestr("modelDescription.xml", description)
        target.writestr(MECHANISM_ENTRY, mechanism)
    return path


@pytest.mark.skipif(os.name == "nt", reason="there are no named pipes")
@pytest.mark.parametrize("verb", VERBS)
def test_a_pipe_is_not_waited_for(verb: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x.fmu")
    assert "is not a regular file" in run(verb, tmp_path / "x.fmu").output


def test_a_description_of_many_elements(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xml_tree, "MOST_ELEMENTS", 1000)
    path = archive(tmp_path / "x.fmu", f"{HEAD}{'<a/>' * 1000}</fmiModelDescription>")
    for verb in ("check", "simulate"):
        assert "more than 1000 elements" in run(verb, path).output


def test_what_is_large_is_read_in_a_process_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same findings as without, and an end where reading takes too long."""
    path = archive(tmp_path / "x.fmu", f"{HEAD}{'<a/>' * 1000}</fmiModelDescription>")
    near = check_fmu(path, run=False)
    monkeypatch.setattr(apart, "_LARGE_CONTENT", 1000)
    assert set(check_fmu(path, run=False).findings) == set(near.findings)
    assert len(near.findings) > 3
    monkeypatch.setattr(apart, "MOST_TIME", 0.0)
    monkeypatch.setattr(process, "_START", 0.05)
    assert "reading it was given up, as no FMU needs so much: it does not come back" in run("check", path).output


def test_a_tag_of_many_attributes(tmp_path: Path) -> None:
    attributes = " ".join(f'a{i}="{i * 7919 % 10007}"' for i in range(500_000))
    path = archive(tmp_path / "x.fmu", f"{HEAD}<a {attributes}/></fmiModelDescription>")
    assert "a tag of more than 4194304 bytes" in run("check", path).output


@pytest.mark.parametrize("verb", VERBS)
def test_sizes_are_looked_at_before_texts_are_read(verb: str, tmp_path: Path) -> None:
    """The archive says that it holds more than is read; what it holds does not matter."""
    path = archive(tmp_path / "x.fmu", HEAD, b"mechanism")
    data = bytearray(path.read_bytes())
    name = MECHANISM_ENTRY if verb == "validate" else "modelDescription.xml"
    entry = data.rindex(name.encode()) - 46
    assert data[entry : entry + 4] == b"PK\x01\x02"
    data[entry + 20 : entry + 28] = (1 << 20).to_bytes(4, "little") + (65 << 20).to_bytes(4, "little")
    path.write_bytes(data)
    assert f"{65 << 20} bytes; at most {64 << 20} are read" in run(verb, path).output


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        ("text", "is not UTF-8"),
        ("encryption", "encrypted"),
        ("method", "compression"),
    ],
)
def test_a_mechanism_that_cannot_be_read(spoil: str, sentence: str, tmp_path: Path) -> None:
    path = archive(tmp_path / "x.fmu", HEAD, b"[mechanism]\nname = '\xff'")
    data = bytearray(path.read_bytes())
    for signature, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        start = data.rindex(signature)
        if spoil == "encryption":
            data[start + flags] |= 1
        elif spoil == "method":
            data[start + flags + 2] = 97
    path.write_bytes(data)
    assert sentence in run("validate", path).output


def test_names_that_no_file_system_takes(tmp_path: Path) -> None:
    name = "x" * 300
    assert "too long" in run("export", "pendulum", "-o", tmp_path / f"{name}.fmu").output
    assert "too long" in run("check", tmp_path / f"{name}.fmu").output
    assert "too long" in run("simulate", tmp_path / f"{name}.fmu").output
    assert "too long" in run("simulate", "pendulum", "--plot", tmp_path / f"{name}.png").output
    assert "too long" in run("validate", "pendulum", "--report", tmp_path / f"{name}.json").output
    assert "too long" in run("simulate", "pendulum", "-o", tmp_path / f"{name}.csv").output


def test_a_terminated_command_leaves_nothing(tmp_path: Path) -> None:
    """SIGTERM while the FMU runs: the folder that it was unpacked to goes away."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    command = [sys.executable, "-m", "lag2fmu", "simulate", "pendulum", "--stop-time", "5e3", "--step", "1e-3"]
    process = subprocess.Popen(command, env=os.environ | {"TMPDIR": str(temporary)}, stderr=subprocess.DEVNULL)
    while process.poll() is None and not any(temporary.glob("*/*/*")):
        time.sleep(0.05)
    process.terminate()
    assert process.wait(60) == 128 + signal.SIGTERM
    assert list(temporary.iterdir()) == []
