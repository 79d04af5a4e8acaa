"""From a mechanism to plain C for firmware: derive, lower, render, and write a folder."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from lag2fmu.codegen.firmware import (
    HEADER,
    REALS,
    SIZE,
    FirmwareStyle,
    FirmwareVariable,
    firmware_files,
    firmware_sources,
    probe_text,
)
from lag2fmu.codegen.tables import StepBound
from lag2fmu.errors import ExportError
from lag2fmu.fmu.advice import damping, moved_starts, steps_over_impacts
from lag2fmu.fmu.backends.backend import identifier_of
from lag2fmu.fmu.builder import VariableTable
from lag2fmu.fmu.compilers import constant
from lag2fmu.fmu.deriving import Derived, derived
from lag2fmu.fmu.realtime import bounded, step_bound
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.variables import build_table
from lag2fmu.formats.loading import as_mechanism
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.progress import telling
from lag2fmu.solvers.methods import METHODS
from lag2fmu.writing import replacing

_LEFT_OUT = frozenset({"VARIABLE_SETTING", "VARIABLE_CLOCK", "VARIABLE_INDICATOR"})
"""The kinds of variables that plain C has no use for."""


@dataclass(frozen=True)
class Firmware:
    """A folder of plain C: the files by name, the solver, the bytes of an instance, and remarks on both ("" for none).

    ``bound`` is that of a step, ``real`` the type of numbers. ``probe`` is a program that runs the ``mechanism`` and
    prints step by step the values of ``outputs``, {name: SI unit}.
    """

    files: Mapping[str, str]
    solver: str
    size: int
    bound: StepBound
    real: str
    mechanism: Mechanism
    outputs: Mapping[str, str]
    probe: str
    remarks: str = ""
    moved_starts: str = ""


@telling("writing C")
def firmware(  # noqa: PLR0913 (choices of the user)
    model: Mechanism | str | Path,
    *,
    solver: str | None = None,
    step: float | None = None,
    solver_steps: int | None = None,
    real: str = "double",
    own_math: bool = False,
    prefix: str | None = None,
    outputs: Sequence[str] = (),
    compiler: str = "zig",
    ram: int | None = None,
    values: Mapping[str, float] | None = None,
) -> Firmware:
    """The mechanism of ``model``, or of what ``load`` takes, in plain C99 for firmware; see ``write_folder``.

    - ``solver``: one with steps of fixed length; by default one that suits the motion at the start.
    - ``step`` (s): the longest step of the program, by default that of the experiment.
    - ``solver_steps``: the solver steps in it, by default as many as an FMU takes.
    - ``real``: the type of numbers, 'double' or 'float'; ``own_math``: sines and the like with the same bits anywhere.
    - ``prefix``: of all names in C, by default the name of the mechanism.
    - ``outputs``: local variables that main.c prints beside the outputs.
    - ``compiler``: 'zig' or 'host', which tells the bytes of an instance; ``ram``: the most that there may be.
    - ``values``: other parameters and starts, in SI units.

    Raises LoadError, ExportError, DerivationError or BuildError.
    """
    mechanism = as_mechanism(model, values)
    style = FirmwareStyle(_prefix(mechanism, prefix), real, own_math)
    if real not in REALS:
        raise ExportError(f"--real {real}: known are {', '.join(REALS)}")
    if solver is not None and solver not in METHODS:
        raise ExportError(f"unknown solver '{solver}'; known are {', '.join(METHODS)}")
    found = derived(mechanism, solver, outputs=outputs, bounded=True)
    table = build_table(found.equations, found.program)
    bound = step_bound(found.mechanism, table.tables.default_solver_step, step, solver_steps)
    tables = bounded(table.tables._replace(vibrations=found.vibrations), bound)
    sources = firmware_sources(found.program, tables, METHODS[found.solver], style)
    size = constant(sources, HEADER, SIZE, compiler)
    if ram is not None and ram <= 0:
        raise ExportError(f"--ram {ram}: expected a positive number of bytes")
    if ram is not None and size > ram:
        raise ExportError(
            f"an instance of mechanism '{mechanism.name}' takes {size} bytes, and --ram allows {ram}; take "
            f"{'a smaller mechanism' if real == 'float' else '--real float'}, or a processor with more memory"
        )
    at_events = steps_over_impacts(mechanism, METHODS[found.solver])
    remarks = "; ".join(filter(None, [found.choice, damping(found.missed, METHODS[found.solver]), at_events]))
    told = _told(found, table, bound, remarks)
    files, probe = firmware_files(sources, style, size, told), probe_text(style, told)
    shown = {v.name: _unit(v) for v in _outputs(table)}
    moved = moved_starts(mechanism, found.equations)
    return Firmware(files, found.solver, size, bound, real, found.mechanism, shown, probe, remarks, moved)


def _prefix(mechanism: Mechanism, prefix: str | None) -> str:
    """The prefix of all names; raises ExportError for one that is no identifier, or the name of the program."""
    chosen = identifier_of(mechanism.name) if prefix is None else prefix
    if re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,40}", chosen) is None:
        raise ExportError(
            f"--prefix '{chosen}': expected a letter, then letters, digits and underscores, 41 together at most, as "
            "names in C begin with it"
        )
    if chosen.lower() == "main":
        raise ExportError(f"--prefix '{chosen}': main.c is the program beside the mechanism; name another prefix")
    return chosen


def _told(found: Derived, table: VariableTable, bound: StepBound, remarks: str) -> dict[str, object]:
    """What the files say of the mechanism."""
    variables = _kept(table)
    names = _c_names(variables)
    entries = {v.name: FirmwareVariable(v.value_reference, names[v.name], _words(v)) for v in variables}
    experiment = found.mechanism.experiment
    return {
        "title": found.mechanism.title,
        "name": found.mechanism.name,
        "entries": list(entries.values()),
        "outputs": [entries[v.name] for v in _outputs(table)],
        "inputs": [entries[v.name] for v in variables if v.causality == "input"],
        "step": bound.longest,
        "solver_steps": bound.solver_steps,
        "solver": found.solver,
        "steps": max(1, round(experiment.stop_time / bound.longest)),
        "remarks": remarks,
    }


def _kept(table: VariableTable) -> list[ScalarVariable]:
    """The variables of plain C."""
    kinds = {slot.name: slot.kind for slot in table.tables.slots}
    return [v for v in table.variables if v.derivative_of is None and kinds.get(v.name, "") not in _LEFT_OUT]


def _outputs(table: VariableTable) -> list[ScalarVariable]:
    """Those that main.c prints."""
    return [v for v in _kept(table) if v.causality == "output"]


def _words(variable: ScalarVariable) -> str:
    """What a variable is: its unit, its kind, its sentence."""
    fixed = "fixed " if variable.variability == "fixed" else ""
    return "; ".join(filter(None, [_unit(variable), f"{fixed}{variable.causality}", variable.doc]))


def _unit(variable: ScalarVariable) -> str:
    return variable.unit.si_name if variable.unit is not None else ""


def _c_names(variables: Sequence[ScalarVariable]) -> dict[str, str]:
    """{name: a part of an identifier in C}, all of them different."""
    found: dict[str, str] = {}
    for variable in variables:
        plain = re.sub(r"[^A-Za-z0-9_]", "_", variable.name)
        taken = set(found.values())
        found[variable.name] = plain if plain not in taken else f"{plain}_{variable.value_reference}"
    return found


def write_folder(files: Mapping[str, str], folder: Path, *, force: bool = False) -> None:
    """Write ``files`` {name: text} to a ``folder``, which is made if there is none.

    Raises ExportError where one of them exists, unless ``force``, and for a folder that cannot be written.
    """
    there = [name for name in files if (folder / name).exists()]
    if there and not force:
        raise ExportError(f"'{folder / there[0]}' exists; overwrite with --force, or choose another folder with -o")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            with replacing(folder / name) as new:
                new.write_text(text, "utf-8", newline="\n")
    except OSError as error:
        raise ExportError(f"cannot write to '{folder}': {error.strerror}; choose another folder with -o") from error
