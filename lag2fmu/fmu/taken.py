"""What a mechanism takes in real time: memory, stack, code and constants, and the bounds of its loops."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from lag2fmu.codegen.tables import StepBound

_ENUMERATION = re.compile(r"^enum \{([^}]*)\};", re.MULTILINE)
_BOUND = re.compile(r"\b(MOST_\w+) = (?:REAL_TIME \? (\d+) : \d+|(\d+))(?=[,\s]|$)")


@dataclass(frozen=True)
class Footprint:
    """What a file takes on a ``processor``, in bytes: its ``code``, ``constants``, and the deepest ``stack``.

    ``path`` are the functions of the deepest stack, the first one is called from outside.
    """

    processor: str
    code: int
    constants: int
    stack: int
    path: tuple[str, ...]


@dataclass(frozen=True)
class Taken:
    """What the mechanism ``name`` takes with a ``solver``, whose steps have a ``bound``, in numbers of type ``real``.

    ``size``: the bytes of an instance; ``prints``: what the code takes; ``bounds``: {name in C: most iterations}.
    """

    name: str
    solver: str
    real: str
    bound: StepBound
    size: int
    prints: tuple[Footprint, ...]
    bounds: tuple[tuple[str, int], ...]

    @property
    def facts(self) -> Iterator[tuple[str, str]]:
        """(what, text) of the step and the memory."""
        count = self.bound.solver_steps
        yield "numbers", f"{self.real}; solver {self.solver}"
        yield "a step", f"{self.bound.longest:g} s at most, {count} solver step{'s' if count > 1 else ''} in it"
        yield "memory of an instance", f"{self.size} bytes with 64-bit pointers; nothing else is allocated"

    @property
    def markdown(self) -> list[str]:
        """All of it as lines of Markdown."""
        return [
            f"# What {self.name} takes in real time",
            "",
            *(f"- {what}: {text}" for what, text in self.facts),
            "",
            *self._printed(),
            *self._bounded(),
        ]

    def _printed(self) -> list[str]:
        if not self.prints:
            return ["Stack and code were not measured: no listing of these platforms tells them.", ""]
        return [
            "| processor | code, bytes | constants, bytes | deepest stack, bytes |",
            "|---|---|---|---|",
            *(f"| {f.processor} | {f.code} | {f.constants} | {f.stack} |" for f in self.prints),
            "",
            "Code is that of the whole file; a linker with `--gc-sections` leaves out what is not called. The C",
            "library, and the compiler's own functions where a processor lacks an operation, are not in these numbers.",
            "",
            f"Deepest path, {self.prints[0].processor}: {' > '.join(self.prints[0].path)}",
            "",
        ]

    def _bounded(self) -> list[str]:
        if not self.bounds:
            return []
        rows = (f"| {name} | {number} |" for name, number in self.bounds)
        return ["| iterations end after | times |", "|---|---|", *rows, ""]


def bounds_of(text: str) -> tuple[tuple[str, int], ...]:
    """(name, most iterations) of the loops in C ``text`` that iterate, sorted."""
    return tuple(
        sorted(
            (bound, int(bounded or other))
            for block in _ENUMERATION.findall(text)
            for bound, bounded, other in _BOUND.findall(block)
            if re.search(rf"(for|while) \(.*<=? {bound}\b", text)
        )
    )
