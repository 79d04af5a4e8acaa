"""Adjoint derivatives beside the evaluation of what they are the derivatives of: operations and run time.

Run with `make bench` or `python -m benchmarks.adjoints [MODEL ...]`. An evaluation gives the accelerations and all that
is calculated; an adjoint gives the derivatives of their weighted sum by the time and all states, inputs and
parameters. The bar: at most 4 times the operations of the generated code. Times are the least of many short rounds, in
turn: of an evaluation with the first adjoint where nothing is known at the point, of a further adjoint there, and of
a directional derivative. Where mechanisms are small, the dense solvers of constraints take most of them.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.running import KERNELS
from lag2fmu.codegen import DEFAULT_SOLVER
from lag2fmu.dynamics import Program, derive, lower
from lag2fmu.dynamics.adjoint import with_adjoints
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.compilers import FLAGS
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.formats.loading import load

CALLS, ROUNDS = 200, 300
MODELS = (
    *("pendulum", "double_pendulum", "cart_pole", "n_pendulum", "six_axis_arm", "humanoid_planar"),
    *("four_bar_linkage", "andrews_squeezer", "bricard", "whipple_bicycle", "slides_problem_5_small", "falling_rod"),
)


def build(model: str, folder: Path) -> tuple[Path, Program]:
    """The C host with the sources of ``model``, compiled as an FMU is, and its program."""
    mechanism = load(model)
    equations = derive(mechanism)
    program = with_adjoints(lower(equations))
    _, sources = describe(mechanism, equations, program, DEFAULT_SOLVER)
    for name, text in sources.items():
        (folder / name).write_text(text, "utf-8")
    units = [name for name in sources if name.endswith(".c")]
    flags = [flag for flag in FLAGS if flag != "-fPIC"]
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", host_platform().targets[0]]
    command = [*zig, *flags, "-I.", f"-I{fmi_headers()}", "-o", "host"]
    subprocess.run([*command, *units, str(KERNELS / "adjoints.c"), "-lm"], cwd=folder, check=True)
    return folder / "host", program


def measure(host: Path) -> list[float]:
    """The least times (ns) of an evaluation, one with its adjoint, a further adjoint, and a further tangent."""
    done = subprocess.run([str(host), str(CALLS), str(ROUNDS)], check=True, capture_output=True, text=True)
    rounds = [[float(word) for word in line.split()] for line in done.stdout.splitlines()]
    return [min(column) for column in zip(*rounds, strict=True)]


def operations(program: Program) -> float:
    """Those of the generated functions of an adjoint, as a multiple of those of an evaluation."""
    system = "constrained" if program.constraints else "factor"
    known = {f.name for f in program.functions}

    def total(*names: str) -> int:
        return sum(program.operations(name) for name in (f"mechanism_{n}" for n in names) if name in known)

    evaluation = total(system if program.places else "accelerations", "locals", "further", "dependent")
    return total(system, "solve", "unknowns_adjoint", "adjoint", "dependent_adjoint") / evaluation


def main() -> None:
    """Measure and print."""
    table = Table(title="an evaluation, and adjoints as multiples of it", title_justify="left")
    headings = ("operations", "evaluation (ns)", "with the first adjoint", "a further adjoint", "a further tangent")
    for heading in ("model", *headings):
        table.add_column(heading, justify="right")
    for model in sys.argv[1:] or MODELS:
        with tempfile.TemporaryDirectory() as folder:
            host, program = build(model, Path(folder))
            evaluation, *others = measure(host)
        ratios = [f"{time / evaluation:.2f}" for time in others]
        table.add_row(model, f"{operations(program):.2f}", f"{evaluation:.0f}", *ratios)
    Console().print(table)


if __name__ == "__main__":
    main()
