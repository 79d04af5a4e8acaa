"""Runs of FMUs as one who meets lag2fmu for the first time makes them: the command line at its default tolerance."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import lag2fmu
from lag2fmu.reference.trajectory import Trajectory, read_csv

PROBLEMS = Path(__file__).parent / "problems"


@dataclass(frozen=True)
class Asked:
    """The solver and the tolerance that are asked for; None: the default."""

    solver: str | None = None
    tolerance: float | None = None

    def __str__(self) -> str:
        solver = "" if self.solver is None else f"--solver {self.solver} "
        return f"{solver}{'' if self.tolerance is None else f'--tolerance {self.tolerance:g}'}".strip() or "the default"


DEFAULT = Asked()


@dataclass(frozen=True)
class Run:
    """What an FMU did: its trajectory, and the CPU time (s) of fmpy and the FMU for the run alone."""

    trajectory: Trajectory
    seconds: float


def model_of(name: str) -> str:
    """What the command line calls a problem: its text in problems/, else the name of a bundled mechanism."""
    text = PROBLEMS / f"{name}.toml"
    return str(text) if text.is_file() else name


def run(
    name: str,
    stop: float,
    step: float,
    *,
    values: Mapping[str, float] | None = None,
    structure: Mapping[str, int] | None = None,
    outputs: Sequence[str] = (),
    asked: Asked = DEFAULT,
) -> Run:
    """Export the problem, and simulate its FMU by fmpy, both by the command line; then time the run, least of three.

    ``stop`` and ``step`` are in s, ``values`` in SI; ``outputs`` are recorded beside those of the FMU. Raises
    CalledProcessError where a command fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        fmu, table = Path(folder) / "problem.fmu", Path(folder) / "run.csv"
        sets = [part for key, value in (structure or {}).items() for part in ("--set", f"{key}={value}")]
        chosen = ["--solver", asked.solver] if asked.solver else []
        command("export", model_of(name), "-o", str(fmu), *sets, *chosen)
        options = ["--stop-time", repr(stop), "--step", repr(step), "-o", str(table)]
        options += [part for output in outputs for part in ("--output", output)]
        options += [part for key, value in (values or {}).items() for part in ("--set", f"{key}={value!r}")]
        options += [] if asked.tolerance is None else ["--tolerance", repr(asked.tolerance)]
        command("simulate", str(fmu), *options)
        times = []
        for _ in range(4):  # the first one loads what later ones have
            begun = time.process_time()
            lag2fmu.simulate(fmu, stop_time=stop, step=step, values=values, tolerance=asked.tolerance)
            times.append(time.process_time() - begun)
        return Run(read_csv(table), min(times[1:]))


def poles(name: str, *, at: str = "start", values: Mapping[str, float] | None = None) -> NDArray[np.complex128]:
    """The poles (1/s) of small motions about what ``at`` says, (2n,), by `lag2fmu linearize`."""
    return np.linalg.eigvals(np.array(linearized(name, at=at, values=values)["A"]))


def linearized(name: str, *, at: str = "start", values: Mapping[str, float] | None = None) -> dict[str, object]:
    """What `lag2fmu linearize -o x.json` writes: matrices as lists of rows, names, the state."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "small.json"
        sets = [part for key, value in (values or {}).items() for part in ("--set", f"{key}={value!r}")]
        command("linearize", model_of(name), "--at", at, "-o", str(file), *sets)
        read: dict[str, object] = json.loads(file.read_text("utf-8"))
        return read


def command(*words: str) -> str:
    """What ``lag2fmu`` with these words prints; raises CalledProcessError with its message."""
    done = subprocess.run([sys.executable, "-m", "lag2fmu", *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise subprocess.CalledProcessError(done.returncode, ["lag2fmu", *words], done.stdout, done.stderr)
    return done.stdout
