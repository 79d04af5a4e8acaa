"""What a step takes on this machine: floating-point operations and instructions, counted over a run.

Operations are those that the compiler left in its intermediate code: each block of this code adds what it holds to a
counter. So linear algebra and own sines are in it, with what vectors compute at once. Instructions are counted by
callgrind where valgrind is on the machine. Source: N. Nethercote, J. Seward, Valgrind: a framework for heavyweight
dynamic binary instrumentation, PLDI 2007.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lag2fmu.building.process import run
from lag2fmu.errors import BuildError
from lag2fmu.fmu.compilers import compile_unit, host_target
from lag2fmu.fmu.firmware import Firmware

Floats = NDArray[np.float64]

_COUNTER = "counted_operations"
_OPERATION = re.compile(
    r"^  (?:%\S+ = )?(?:(?:tail |musttail |notail )?call \S.*?@"
    r"(?:llvm\.(?:sqrt|pow|exp|log|sin|cos|fma|fmuladd|vector\.reduce\.f(?:add|mul))\.|(?:sin|cos|tan|asin|acos|atan|atan2|sinh|cosh|tanh|exp|log|pow|hypot|fmod)f?\()"
    r"|f(?:add|sub|mul|div|rem) )"
)
"""A line of LLVM's intermediate code that adds, subtracts, multiplies, divides, takes a root, or calls a function."""
_AS_IT_IS = ("-Xclang", "-disable-llvm-passes")
"""The options by which the compiler takes intermediate code as it is: it has been optimised before the counts."""
_LANES = re.compile(r"<(\d+) x (?:double|float)>")
_BLOCK = re.compile(r"^(?:define .*\{|[\w.$-]+:.*|\"[^\"]+\":.*)$")
_FIRST = re.compile(r"^(?:define|[\w.$\"-]+:|  %\S+ = phi )")
"""The lines of a block before which nothing can stand."""


@dataclass(frozen=True)
class Counted:
    """A run over the experiment: ``values`` (m, outputs) at its m steps and the start, SI units, and what steps took.

    ``operations`` (m - 1,) in floating point; ``instructions`` (m - 1,), None where nothing counted them.
    """

    values: Floats
    operations: Floats
    instructions: Floats | None = None


def counted(made: Firmware, *, instructions: bool = True) -> Counted:
    """Run what was ``made`` over its experiment on this machine; the run ends with a step that fails.

    Raises BuildError with the compiler's output if it fails, or for a run that does not begin.
    """
    name = _name(made)
    files = {**made.files, "probe.c": made.probe}
    target = (host_target(),)
    optimised = compile_unit(files, f"{name}.c", target, "-S", "-emit-llvm").decode()

    def program(code: str, *options: str) -> bytes:
        both = {**files, f"{name}.ll": code}
        return compile_unit(both, f"{name}.ll", target, *options, *_AS_IT_IS, "probe.c", "-lm")

    values, operations = _rows(_printed(program(counting(optimised), "-DCOUNTED")))
    taken = _by_callgrind(program(optimised), name) if instructions else None
    return Counted(values, operations, taken)


def instructions_of(made: Firmware) -> Floats | None:
    """The instructions (m - 1,) of ``counted`` alone, after one compilation in place of three; raises BuildError."""
    name = _name(made)
    files = {**made.files, "probe.c": made.probe}
    return _by_callgrind(compile_unit(files, f"{name}.c", (host_target(),), "probe.c", "-lm"), name)


def _name(made: Firmware) -> str:
    """The name of the C file of what was ``made``, without its ending."""
    return next(name for name in made.files if name.endswith(".h")).removesuffix(".h")


def counting(code: str) -> str:
    """LLVM's intermediate ``code`` with a global counter to which each block adds its floating-point operations."""
    lines = re.sub(r" ?\bmemory\([^)]*\)", "", code).splitlines()  # functions that write a counter are not pure
    return "\n".join([*_with_counts(lines), f"@{_COUNTER} = global i64 0", ""])


def _with_counts(lines: list[str]) -> Iterator[str]:
    """The ``lines`` with those that count, each before the first line of its block that it may stand before."""
    block: list[str] = []
    for number, line in enumerate(lines):
        if _BLOCK.match(line) or line == "}":
            yield from _added(block, number)
            block = []
        block.append(line)
    yield from block


def _added(block: list[str], number: int) -> Iterator[str]:
    """The lines of a ``block`` with its count; ``number`` makes the names unique."""
    count = sum(_lanes(line) for line in block if _OPERATION.match(line))
    first = next((i for i, line in enumerate(block) if line and not _FIRST.match(line)), len(block))
    yield from block[:first]
    if count:
        yield f"  %counted.{number} = load i64, ptr @{_COUNTER}"
        yield f"  %adding.{number} = add i64 %counted.{number}, {count}"
        yield f"  store i64 %adding.{number}, ptr @{_COUNTER}"
    yield from block[first:]


def _lanes(line: str) -> int:
    """How many numbers a line of code computes."""
    found = _LANES.search(line)
    return int(found[1]) if found else 1


def _printed(program: bytes, *before: str) -> str:
    """What the ``program`` of the probe prints, started by ``before``."""
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as folder:
        return _ran(program, Path(folder), *before)


def _ran(program: bytes, folder: Path, *before: str) -> str:
    path = folder / "probe.exe"
    path.write_bytes(program)
    path.chmod(0o755)
    return run([*before, str(path)], folder).output


def _rows(printed: str) -> tuple[Floats, Floats]:
    """The values (m, outputs) and the operations (m - 1,) of what the probe ``printed``."""
    rows = np.array([line.split(",") for line in printed.splitlines()], float)
    if len(rows) < 2:
        raise BuildError("the mechanism does not begin with its start values; 'lag2fmu simulate' tells why")
    return rows[:, 1:], rows[1:, 0]


def _by_callgrind(program: bytes, name: str) -> Floats | None:
    """The instructions of each step of the ``program``, None where there is no valgrind."""
    if shutil.which("valgrind") is None:
        return None
    step = f"{name}_step"
    with tempfile.TemporaryDirectory(prefix="lag2fmu-") as text:
        folder = Path(text)
        options = (f"--toggle-collect={step}", f"--dump-after={step}", "--combine-dumps=yes", "--dump-line=no")
        _ran(program, folder, "valgrind", "--tool=callgrind", "--callgrind-out-file=counts", *options)
        counts = re.findall(r"^totals: (\d+)", (folder / "counts").read_text("utf-8", "replace"), re.MULTILINE)
    taken = np.array(counts[:-1], float)  # the last one is what follows the last step
    return taken if len(taken) else None
