"""Completion by the Tab key in the shells themselves, set up as the documentation says."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

pytestmark = pytest.mark.toolchain

SCRIPTS = Path(sys.executable).parent
PATIENCE = 60.0
"""s; a shell answers within two."""


def _environment(home: Path) -> dict[str, str]:
    return os.environ | {"HOME": str(home), "TERM": "dumb", "PATH": f"{SCRIPTS}{os.pathsep}{os.environ['PATH']}"}


def _said(command: Sequence[str], home: Path) -> str:
    """What a shell prints; it has to be there."""
    if shutil.which(command[0]) is None:
        pytest.skip(f"there is no {command[0]}")
    done = subprocess.run(command, env=_environment(home), capture_output=True, text=True, check=True, timeout=PATIENCE)
    return done.stdout


def test_bash_completes(tmp_path: Path) -> None:
    asked = "COMP_WORDS=(lag2fmu simu); COMP_CWORD=1; _lag2fmu_completion lag2fmu; echo ${COMPREPLY[@]}"
    assert _said(["bash", "-c", f'eval "$(_LAG2FMU_COMPLETE=bash_source lag2fmu)"; {asked}'], tmp_path) == "simulate\n"


def test_fish_completes(tmp_path: Path) -> None:
    folder = tmp_path / ".config" / "fish" / "completions"
    folder.mkdir(parents=True)
    setting = f"_LAG2FMU_COMPLETE=fish_source lag2fmu > {folder / 'lag2fmu.fish'}"
    asked = "complete -C 'lag2fmu simu'; complete -C 'lag2fmu export pendulum --solver rad'"
    said = _said(["fish", "-c", f"{setting}; {asked}"], tmp_path)
    assert [line.split("\t")[0] for line in said.splitlines() if line] == ["simulate", "radau5"]


def test_zsh_completes(tmp_path: Path) -> None:
    """At a terminal, where alone zsh completes."""
    pty = pytest.importorskip("pty", reason="only Unix has such terminals")
    setting = 'autoload -Uz compinit && compinit -u\neval "$(_LAG2FMU_COMPLETE=zsh_source lag2fmu)"\n'
    (tmp_path / ".zshrc").write_text(f"{setting}PS1=READY\n", "utf-8")
    shell = shutil.which("zsh")
    if shell is None:
        pytest.skip("there is no zsh")
    ours, theirs = pty.openpty()
    with subprocess.Popen([shell, "-i"], stdin=theirs, stdout=theirs, stderr=theirs, env=_environment(tmp_path)) as run:
        os.close(theirs)
        _heard(ours, b"READY")
        os.write(ours, b"lag2fmu simu\t")
        assert b"lag2fmu simulate" in _heard(ours, b"simulate")
        run.kill()
    os.close(ours)


def _heard(terminal: int, word: bytes) -> bytes:
    """What a terminal shows until ``word`` is there."""
    os.set_blocking(terminal, False)
    shown, end = b"", time.monotonic() + PATIENCE
    while word not in shown:
        assert time.monotonic() < end, shown
        try:
            shown += os.read(terminal, 4096)
        except BlockingIOError:
            time.sleep(0.02)
    return shown
