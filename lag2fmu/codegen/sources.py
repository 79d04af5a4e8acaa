"""The source tree of an FMU: the runtime as it stands in templates/, and the files that depend on the mechanism."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lag2fmu.codegen.colours import Colouring
from lag2fmu.codegen.solvers import Method
from lag2fmu.codegen.templates import render
from lag2fmu.dynamics import Program
from lag2fmu.dynamics.operations import CODE
from lag2fmu.resources import resource_folder

GENERATED = ("mechanism.h", "mechanism.c", "tables.c")

_HELPERS = {
    "sign": "static double sign(double x) { return (double)((x > 0.0) - (x < 0.0)); }",
    "heaviside": "static double heaviside(double x) { return 0.5 * (1.0 + (double)((x > 0.0) - (x < 0.0))); }",
}


@dataclass(frozen=True)
class Slot:
    """What a value reference stands for: ``index`` in the vector of ``kind`` (a VariableKind of the runtime).

    ``minimum`` and ``maximum`` in SI units; ``output``: its time derivatives can be asked for.
    """

    name: str
    kind: str
    index: int
    minimum: float | None = None
    maximum: float | None = None
    output: bool = False


@dataclass(frozen=True)
class Tables:
    """The numbers and names of one mechanism; values in SI units, states are (q, qd), slots in value reference order.

    ``colours``: of the Jacobian of the accelerations by the states. ``continuous_states``: indices of those in (q, qd)
    that the FMU calls states. ``massless``: (constraint, coordinate) for each coordinate without mass and the equation
    that it follows from, holonomic ones first. ``vibrations``: those that a method gets wrong where its steps do not
    resolve them, (rad/s, index of the coordinate that moves most), the fastest first. ``motions`` says of the motion
    inputs, which are the last ones with two derivatives each, whether the equations contain these.
    ``default_solver_step`` and ``default_duration``, that of the experiment, are in s, ``stabilisation`` is the rate in
    1/s with which constraints that drift are pulled back.
    """

    model_name: str
    slots: tuple[Slot, ...]
    coordinate_names: tuple[str, ...]
    start_states: tuple[float, ...]
    nominal_states: tuple[float, ...]
    given_states: tuple[bool, ...]
    constraint_names: tuple[str, ...]
    holonomic: int
    continuous_states: tuple[int, ...]
    massless: tuple[tuple[int, int], ...]
    colours: Colouring
    start_inputs: tuple[float, ...]
    motions: tuple[bool, ...]
    start_parameters: tuple[float, ...]
    default_solver_step: float
    default_duration: float
    stabilisation: float
    vibrations: tuple[tuple[float, int], ...] = ()

    @property
    def massless_positions(self) -> int:
        """The number of coordinates without mass that follow from holonomic constraints."""
        return sum(k < self.holonomic for k, _ in self.massless)

    @property
    def bounded(self) -> list[Slot]:
        """The coordinates with a range."""
        kinds, n = ("VARIABLE_STATE", "VARIABLE_MASSLESS"), len(self.coordinate_names)
        slots = [s for s in self.slots if s.kind in kinds and s.index < n]
        return [s for s in slots if (s.minimum, s.maximum) != (None, None)]

    @property
    def starts(self) -> list[tuple[str, str, Sequence[float]]]:
        """(name in C, size in C, values) of the constant vectors."""
        return [
            ("START_STATES", "N_STATES", self.start_states),
            ("NOMINAL_STATES", "N_STATES", self.nominal_states),
            ("START_INPUTS", "N_SIGNALS", self.start_inputs),
            ("START_PARAMETERS", "SIZE_PARAMETERS", self.start_parameters),
        ]

    @property
    def vectors(self) -> list[tuple[str, list[str]]]:
        """(letter, names of the entries) of the vectors in the generated code."""
        letters = {"x": "VARIABLE_STATE", "u": "VARIABLE_INPUT", "p": "VARIABLE_PARAMETER", "y": "VARIABLE_LOCAL"}
        names = {letter: [s.name for s in self.slots if s.kind == kind] for letter, kind in letters.items()}
        states = {s.index: s.name for s in self.slots if s.kind in ("VARIABLE_STATE", "VARIABLE_MASSLESS")}
        return list({**names, "x": [states[i] for i in sorted(states)]}.items())


CONSTRAINT_FILES = "constraint_"
"""How the names of the runtime files begin, behind SOLVER_FILES if need be, that only constraints need."""

MASSLESS_FILES = "massless."
"""How those begin that only coordinates without mass need."""

SOLVER_FILES = "solver_"
"""How those begin that are needed if the chosen solver names them, or a needed file includes their header."""

_INCLUDED = re.compile(r'^#include "(\w+)\.h"', re.MULTILINE)


def render_sources(program: Program, tables: Tables, method: Method, guid: str) -> Mapping[str, str]:
    """{file name: text} of all C sources and headers, sorted; the headers of FMI are not among them.

    The runtime's files stand as they are in templates/runtime; ``guid`` is what the generated ones carry.
    """
    used = {
        program.graph.code[node] for f in program.functions for node in program.graph.cone(n for *_, n in f.results)
    }
    context = {
        "program": program,
        "tables": tables,
        "method": method,
        "guid": guid,
        "helpers": [text for name, text in _HELPERS.items() if CODE[name] in used],
    }
    files = _runtime_files(tables, method)
    files |= {name: render(f"mechanism/{name}.jinja", context) for name in (*GENERATED, *method.generated_files)}
    return dict(sorted(files.items()))


def _runtime_files(tables: Tables, method: Method) -> dict[str, str]:
    """{file name: text} of the runtime, as far as the mechanism and the method need it."""
    needed_for = {
        CONSTRAINT_FILES: tables.constraint_names,
        SOLVER_FILES + CONSTRAINT_FILES: tables.constraint_names,
        MASSLESS_FILES: tables.massless,
    }
    unused = tuple(beginning for beginning, there in needed_for.items() if not there)
    folder = resource_folder("templates") / "runtime"
    texts = {path.name: path.read_text("utf-8") for path in folder.glob("*.[ch]") if not path.name.startswith(unused)}
    wanted = {name for name in texts if not name.startswith(SOLVER_FILES)} | set(method.runtime_files)
    needed: set[str] = set()
    while wanted:
        name = wanted.pop()
        if name in texts and name not in needed:
            needed.add(name)
            wanted |= {f"{stem}.{ending}" for stem in _INCLUDED.findall(texts[name]) for ending in "ch"}
    return {name: texts[name] for name in needed}
