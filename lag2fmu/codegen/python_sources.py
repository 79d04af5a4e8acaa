"""The Python files of an FMU of the python backend: the equations of the mechanism, and the runtime of all of them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from fractions import Fraction

from lag2fmu.codegen.python import BUILT_IN, ORDINARY, python_body, used_functions
from lag2fmu.codegen.sources import lookups_of
from lag2fmu.codegen.tables import RuntimeTables, Slot
from lag2fmu.codegen.templates import render
from lag2fmu.dynamics.functions import Function, Program, with_held_inputs
from lag2fmu.resources import resource_folder
from lag2fmu.solvers.tableaus import Tableau

PRINTED = {
    "mechanism_dynamics": (("t", "x", "u", "p"), ("M", "f")),
    "mechanism_locals": (("t", "x", "u", "p", "qdd"), ("y",)),
    "mechanism_further": (("t", "x", "u", "p", "qdd"), ("dz",)),
    "mechanism_dependent": (("p",), ("c",)),
}
"""The functions of a Program that the python backend prints, with their arguments and results.

A mechanism without further states has no ``mechanism_further``.
"""


def printable(program: Program) -> bool:
    """Whether ``program`` has all functions of PRINTED with the arguments and results given there."""
    found = {f.name: (tuple(a.name for a in f.arguments), f.arrays) for f in program.functions}
    return all(found.get(name, signature) == signature for name, signature in PRINTED.items()) and (
        PRINTED.keys() - found.keys() <= {"mechanism_further"}
    )


def runtime_files() -> tuple[str, dict[str, str]]:
    """The name of the runtime package, with a hash of its content, and its files {file name: text}."""
    folder = resource_folder("templates") / "python" / "runtime"
    files = {path.name: path.read_text("utf-8") for path in sorted(folder.glob("*.py"))}
    return f"lag2fmu_runtime_{hashlib.sha256(repr(files).encode()).hexdigest()[:12]}", files


def render_mechanism(
    program: Program,
    tables: RuntimeTables,
    tableau: Tableau,
    guid: str,
    texts: Mapping[str, str],
    meanings: Mapping[str, tuple[str, str]],
) -> str:
    """The module with the equations; ``texts`` are title and source, ``meanings`` {variable: (unit, doc)}."""
    program = with_held_inputs(program, PRINTED)
    functions = [f for name in PRINTED for f in program.functions if f.name == name]
    used = used_functions(program, functions)
    labels = {
        "M": tables.coordinate_names,
        "f": tables.coordinate_names,
        "y": program.locals,
        "c": program.dependent,
        "dz": tables.further_names,
    }
    n = len(tables.coordinate_names)
    connected = {slot.index for slot in tables.slots if slot.kind == "VARIABLE_INPUT"}
    context = {
        **texts,
        "guid": repr(guid),
        "runtime": runtime_files()[0],
        "lookups": lookups_of(program),
        "math_functions": sorted(used & ORDINARY),
        "runtime_functions": sorted(used - ORDINARY - BUILT_IN),
        "bodies": {f.name: python_body(program, f, n, _labels_of(f, labels)) for f in functions},
        "variables": [_variable(slot, tables, meanings) for slot in tables.slots],
        "tableau": tableau,
        "rows": [_fractions(row[:i]) for i, row in enumerate(tableau.a)],
        "weights": {
            "b": _fractions(tableau.b),
            "c": _fractions(tableau.c),
            "e": _fractions(tableau.error_weights or ()),
            "second": _fractions(tableau.second_weights or ()),
        },
        "model_name": repr(tables.model_name),
        "nominal": [repr(x) for x in tables.nominal_states[:n]],
        "nominal_further": [repr(x) for x in tables.nominal_states[2 * n :]],
        "default_step": repr(tables.default_solver_step),
        "default_duration": repr(tables.default_duration),
        "kept_inputs": {i: x for i, x in enumerate(tables.start_inputs) if i not in connected},
        "first_motion": len(tables.start_inputs) - 3 * len(tables.motions),
    }
    return render("python/mechanism.py.jinja", context)


def _labels_of(function: Function, labels: Mapping[str, Sequence[str]]) -> dict[str, Sequence[str]]:
    return {array: labels[array] for array in function.arrays}


def _fractions(weights: Sequence[Fraction]) -> list[str]:
    """Exact coefficients as text: divisions of whole numbers, which Python rounds once."""
    return [f"{w.numerator} / {w.denominator}" if w.denominator > 1 else str(w.numerator) for w in weights]


def _variable(slot: Slot, tables: RuntimeTables, meanings: Mapping[str, tuple[str, str]]) -> list[str]:
    """The arguments of a Variable of the runtime; those that have their default are left out."""
    unit, doc = meanings[slot.name]
    vectors = {
        "VARIABLE_STATE": tables.start_states,
        "VARIABLE_INPUT": tables.start_inputs,
        "VARIABLE_PARAMETER": tables.start_parameters,
    }
    start = vectors[slot.kind][slot.index] if slot.kind in vectors else None
    optional = {"start": start, "minimum": slot.minimum, "maximum": slot.maximum, "unit": unit, "doc": doc}
    shown = [f"{key}={value!r}" for key, value in optional.items() if value not in (None, "")]
    return [repr(slot.name), repr(slot.kind.removeprefix("VARIABLE_").lower()), str(slot.index), *shown]
