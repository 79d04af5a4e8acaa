"""C files joined to few translation units: starting a compiler for each of forty files costs more than compiling them.

Files are joined by inclusion, as they are: what one of them keeps to itself has a name that no other one has. What
calls each other at each stage of a solver stands in one unit, where the compiler sees both sides of the calls. What is
generated for a mechanism stands apart from the engine, and so do the laws and the rest of what knows no sizes: other
mechanisms have the same units, which the compiler finds again.

What does not run in the steps of a solver is compiled for size, which takes a third less time.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

from lag2fmu.codegen.amalgamation import included
from lag2fmu.resources import resource_folder

MOST = 100_000
"""No file joins a unit with more characters, so that several units are compiled side by side.

Beside a longer file, others may join units up to its length.
"""
FEW = MOST
"""Files with no more characters together are one unit."""
HOT = ("integrate", "system")
"""The rooms of the engine that work at each stage of a solver."""
OF_CALLS = ("drivers/fmi2", "drivers/fmi3", "drivers/gate")
"""The folders of the engine whose files run once a communication step."""
OF_EVENTS = frozenset(
    {
        *("chattering.c", "constraint_kinks.c", "constraint_start.c", "diagnosis.c", "failure.c"),
        *("failure_sentence.c", "further.c", "gap_jumps.c", "importer_steps.c", "instance.c", "late_impacts.c"),
        *("listing.c", "multiplier_rates.c", "names.c", "notice_sentence.c", "notices.c", "policy.c"),
        *("settle_laws.c", "settle_modes.c", "settle_slips.c", "shared_loads.c", "step_failure.c"),
        *("stopping_slips.c", "values.c"),
    }
)
"""Files of other folders that run as seldom, or at starts, events and failures.

Impacts are not among them: some runs consist of impacts.
"""
SEARCHES = frozenset(
    {
        *("central_path.c", "choices.c", "complementarity.c", "cones.c", "elimination.c", "islands.c"),
        *("laws.c", "least_norm.c", "newton.c", "newton_many.c", "newton_step.c", "shares.c"),
        "step_matrix.c",
    }
)
"""Files that search the modes of contacts: seldom, but half of the time of some runs."""
OF_STAGES = "tableau.c"
"""The generated file that works at each stage as well; it depends on the solver and on sizes alone."""


def translation_units(sources: Mapping[str, str]) -> dict[str, str]:
    """{file: text} to compile in place of the .c files in ``sources`` {file: text}; each includes some of them."""
    names = c_files(sources)
    few = sum(len(sources[name]) for name in names) <= FEW
    groups: dict[tuple[int, str], list[str]] = {}
    for name in names:
        groups.setdefault((0, "") if few else _group(name, sources), []).append(name)
    units = [unit for _, group in sorted(groups.items()) for unit in _packed(group, sources)]
    return {f"unit_{i}.c": _unit(unit) for i, unit in enumerate(units, start=1)}


def shared_files(unit: str, sources: Mapping[str, str]) -> dict[str, str] | None:
    """{file: text} of all that a ``unit`` of ``sources`` includes, itself among them; None if some of it is generated.

    Other mechanisms of the same kind and size have the same.
    """
    found = _reached(unit, sources)
    known = {unit, OF_STAGES, *_folders()}
    return None if any(name not in known for name in c_files(found)) else found


def _reached(file: str, sources: Mapping[str, str]) -> dict[str, str]:
    """{file: text} of all of ``sources`` that a ``file`` of theirs includes, itself among them."""
    found, waiting = {}, [file]
    while waiting:
        name = waiting.pop()
        if name in sources and name not in found:
            found[name] = sources[name]
            waiting += included(sources[name])
    return found


def _packed(names: Iterable[str], sources: Mapping[str, str]) -> list[list[str]]:
    """The ``names`` in lists of about MOST characters together; each name in the first one that has room."""
    names = list(names)
    most = max(MOST, *(len(sources[name]) for name in names))
    units: list[list[str]] = []
    for name in names:
        room = (unit for unit in units if sum(len(sources[other]) for other in (*unit, name)) <= most)
        unit = next(room, None)
        if unit is None:
            units.append([name])
        else:
            unit.append(name)
    return units


def c_files(sources: Iterable[str]) -> list[str]:
    """The .c files among ``sources``, in the order of the alphabet."""
    return sorted(name for name in sources if name.endswith(".c"))


def including(files: Iterable[str]) -> str:
    """The text of a C file that includes ``files``."""
    return "".join(f'#include "{name}"\n' for name in files)


def _unit(files: Iterable[str]) -> str:
    """The text of a unit of ``files``; clang is told which functions run seldom."""
    return "".join(_attributed(name) for name in files)


def _attributed(name: str) -> str:
    """The text that includes the file ``name``."""
    included_alone = including([name])
    if name in SEARCHES:
        return _ATTRIBUTED.format("cold", included_alone)
    if name in OF_EVENTS or _folders().get(name, "").startswith(OF_CALLS):
        return _ATTRIBUTED.format("minsize", included_alone)
    return included_alone


_ATTRIBUTED = """#if defined(__clang__)
#pragma clang diagnostic ignored "-Wpragma-clang-attribute" /* of a file without functions */
#pragma clang attribute push(__attribute__(({})), apply_to = function)
#endif
{}#if defined(__clang__)
#pragma clang attribute pop
#endif
"""


def _group(name: str, sources: Mapping[str, str]) -> tuple[int, str]:
    """What the C file ``name`` of ``sources`` may stand in one unit with; units come in the order of their groups."""
    room = room_of(name)
    if room in HOT or name == OF_STAGES:
        return (0, "stages of solvers")
    if not room:
        return (3, "generated")
    if _reached(name, sources).keys() - _folders().keys():
        return (2, "the mechanism's sizes")
    return (1, "laws" if room == "laws" else "what knows no sizes")


def room_of(name: str) -> str:
    """The room of the engine with the file ``name``; "" for one that is written for a mechanism."""
    return _folders().get(name, "").split("/")[0]


@cache
def _folders() -> dict[str, str]:
    """{file: folder} of the engine's files; a folder's first part is its room."""
    engine = resource_folder("templates") / "engine"
    found = ((Path(folder).relative_to(engine).as_posix(), names) for folder, _, names in os.walk(engine))
    return {name: folder for folder, names in found for name in names if name.endswith((".c", ".h"))}
