"""A mechanism in plain C, compiled, by default without optimisation, and called from Python."""

from __future__ import annotations

import ctypes
import re
import subprocess
from collections.abc import Mapping
from pathlib import Path

from compiling import UNOPTIMISED, compiled

FLAGS = (
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Wshadow",
    "-Werror",
)


class Bare:
    """An instance of the mechanism in ``files`` {name: text}, as a library of ``compiler``, compiled in ``folder``."""

    def __init__(self, files: Mapping[str, str], folder: Path, compiler: str = "zig", shift: int = 0) -> None:
        """The memory of the instance begins ``shift`` bytes behind what malloc gives."""
        self.name = next(file for file in files if file.endswith(".h")).removesuffix(".h")
        self.header = files[f"{self.name}.h"]
        sources = {file: files[file] for file in (f"{self.name}.h", f"{self.name}.c")}
        self.library = compiled(folder, sources, compiler, options=("-Wshadow", *UNOPTIMISED[compiler]))
        self.real = (
            ctypes.c_float if "typedef float" in self.header or " float value" in self.header else ctypes.c_double
        )
        (size,) = re.findall(r"unsigned char bytes\[(\d+)\]", self.header)
        self.size = int(size)
        self.memory = ctypes.create_string_buffer(self.size + shift)
        self.numbers = {name: int(n) for name, n in re.findall(r"_VAR_(\w+) = (\d+),", self.header)}
        self.function("init").restype = ctypes.c_void_p
        self.function("time").restype = self.real
        self.it = self.init(ctypes.addressof(self.memory) + shift, self.size)

    def function(self, name: str):
        """The function NAME_``name``."""
        return getattr(self.library, f"{self.name}_{name}")

    def init(self, address: int | None, size: int) -> int | None:
        """What NAME_init returns."""
        return self.function("init")(ctypes.c_void_p(address), ctypes.c_size_t(size))

    def status(self, name: str) -> int:
        """The number of a status."""
        constants = re.search(r"typedef enum \{((?:(?!typedef)[^}])*)\} \w+_Status", self.header)[1]
        return re.findall(rf"^ +{self.name}_([A-Z_]+)", constants, re.MULTILINE).index(name)

    def set(self, variable: str | int, value: float) -> int:
        """Give a variable a value; the status."""
        number = variable if isinstance(variable, int) else self.numbers[variable]
        return self.function("set")(ctypes.c_void_p(self.it), number, self.real(value))

    def get(self, variable: str | int, found: float = -1.0) -> tuple[int, float]:
        """The status, and the value, which is ``found`` where there is none."""
        value = self.real(found)
        number = variable if isinstance(variable, int) else self.numbers[variable]
        return self.function("get")(ctypes.c_void_p(self.it), number, ctypes.byref(value)), value.value

    def start(self, time: float = 0.0) -> int:
        """Begin; the status."""
        return self.function("start")(ctypes.c_void_p(self.it), self.real(time))

    def step(self, length: float) -> int:
        """Take a step (s); the status."""
        return self.function("step")(ctypes.c_void_p(self.it), self.real(length))

    @property
    def time(self) -> float:
        """The present time, s."""
        return self.function("time")(ctypes.c_void_p(self.it))

    def notices(self) -> int:
        """The notices so far, as bits."""
        return self.function("notices")(ctypes.c_void_p(self.it))

    def failure(self) -> int:
        """Why the last call failed."""
        return self.function("failure")(ctypes.c_void_p(self.it))


def program(files: Mapping[str, str], folder: Path, *command: str, options: tuple[str, ...] = ()) -> Path:
    """The program of main.c and the mechanism, compiled by ``command`` in ``folder``."""
    for name, text in files.items():
        (folder / name).write_text(text, "utf-8")
    units = sorted(name for name in files if name.endswith(".c"))
    done = subprocess.run(
        [
            *command,
            *FLAGS,
            *UNOPTIMISED["zig" if "ziglang" in command else "gcc"],
            *options,
            *units,
            "-o",
            "run",
            "-lm",
        ],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return folder / "run"
