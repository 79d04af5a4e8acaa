"""The rooms of the engine, in C: each knows those below it alone, and only the drivers know a standard."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

import lag2fmu
from lag2fmu.resources import resource_folder

ENGINE = resource_folder("templates") / "engine"
FILES = sorted(ENGINE.rglob("*.[ch]"))
GATES = ("fmi2", "fmi3", "gate")
SEVERAL = (
    "solver_memory.h",
    "observer_memory.h",
    "directed_memory.h",
    "reverse_memory.h",
    "event_sizes.h",
    "step_matrix.h",
    "version.h",
    "version.c",
    "scale.h",
    "own_constants.h",
)
MOST_LINES, MOST_COLUMNS = 50, 120
SIZES = re.compile(r"^ *#if.*\b(N|SIZE)_\w+", re.MULTILINE)
OWN = re.compile(
    r"^static\b[^;{=(]*?\b(\w+)(?: ?\[[^;={]*\])*(?=[(;=]| =)|^typedef\b[^;{]*?(\w+)\)?(?:\(.*\)|\[\w+\])?;|^\} (\w+);"
    r"|^#define (\w+)",
    re.MULTILINE,
)
"""A static function or variable, a type, or a macro; each begins in the first column."""
ENUMERATION = re.compile(r"^(?:typedef )?enum \{([^}]*)\}", re.MULTILINE)
FUNCTION = re.compile(r"^\w[^;{}=]*\) \{\n.*?^\}\n", re.MULTILINE | re.DOTALL)

SMALL = re.compile(r"(?<![\w.])[\d.]+e-\d+")
STEERING = {
    "instance.c": {"1e-4"},
    "adaptive_steps.c": {"1e-5"},
    "ros2.c": {"3e-6"},
    "directed_ros2.c": {"3e-4"},
    "jumps.c": {"1e-3", "1e-4", "1e-5", "5e-7"},
    "event_steps.c": {"1e-3"},
    "settings.c": {"1e-6"},
    "constraint_start.c": {"1e-3"},
    "laws.c": {"1e-3"},
    "contact_modes.c": {"1e-12"},
    "settle_slips.c": {"1e-3"},
}
"""file -> its small numbers that are no tolerances: they steer a method, are the width of a difference, or a default"""

ROOMS = ("base", "laws", "system", "events", "integrate", "drivers")
"""Each room may include headers of those before it."""
MEMORIES = ("solver_memory", "mechanism")
"""What the State holds of a solver, which the solver's folder says."""


def _room(path: Path) -> str:
    return path.relative_to(ENGINE).parts[0]


def _included(path: Path) -> set[str]:
    """The stems of what a file includes of the runtime and of the generated files."""
    return set(re.findall(r'^#include "(\w+)\.h"', path.read_text("utf-8"), re.MULTILINE))


def _name(path: Path) -> str:
    return path.relative_to(ENGINE).as_posix()


def _gate(path: Path) -> str | None:
    """The gate of FMI that a file belongs to."""
    folder = path.relative_to(ENGINE).parts[1]
    return folder if folder in GATES else None


def test_rooms_know_those_below_them_alone() -> None:
    rooms = {other.stem: _room(other) for other in FILES if other.suffix == ".h" and other.stem not in MEMORIES}
    for path in FILES:
        used = {rooms[stem] for stem in _included(path) if stem in rooms}
        assert used <= set(ROOMS[: ROOMS.index(_room(path)) + 1]), _name(path)


def test_only_the_gates_know_the_standard_and_no_version_knows_another() -> None:
    """gate/ knows a version by its version.h alone."""
    gates = {file.stem for file in FILES if file.suffix == ".h" and _gate(file)}
    for path in FILES:
        other = {"gate": "fmi[23]", "fmi2": "fmi3", "fmi3": "fmi2", None: "fmi[23]"}[_gate(path)]
        assert re.search(other, path.read_text("utf-8")) is None, _name(path)
        assert _gate(path) is not None or not _included(path) & gates, _name(path)


def test_the_mechanism_is_no_question_of_the_preprocessor() -> None:
    assert [_name(path) for path in FILES if SIZES.search(path.read_text("utf-8"))] == []


def test_functions_and_lines_fit_a_screen() -> None:
    for path in FILES:
        text = path.read_text("utf-8")
        for function in FUNCTION.findall(text):
            assert function.count("\n") <= MOST_LINES, (_name(path), function.split("(")[0])
        assert max(map(len, text.split("\n"))) <= MOST_COLUMNS, _name(path)


def _code(path: Path) -> str:
    """The text of a C file without comments and strings."""
    return re.sub(r'/\*.*?\*/|"[^"\n]*"', "", path.read_text("utf-8"), flags=re.DOTALL)


def test_all_tolerances_stand_in_one_place() -> None:
    found = {path.name: numbers for path in FILES if (numbers := set(SMALL.findall(_code(path))))}
    assert found.pop("scale.h")
    assert found.pop("own_constants.h")  # coefficients
    assert found == STEERING


def test_there_are_few_tolerances() -> None:
    scales = [path for path in FILES if path.name == "scale.h"]
    names = [re.findall(r"\b([A-Z_]+) = |^#define (\w+) \(", _code(scale), re.MULTILINE) for scale in scales]
    assert 20 < len(names[0]) <= 30
    assert names[0] == names[1], "float has the tolerances of double"


def test_the_judge_has_no_tolerance_of_the_accused() -> None:
    """The direct integration has criteria of its own: one that it shared with the engine could hide a fault of it."""
    scale = next(path for path in FILES if path.name == "scale.h")
    names = set(re.findall(r"\b([A-Z_]+) = ", _code(scale)))
    assert len(names) > 20
    judge = sorted((Path(lag2fmu.__file__).parent / "reference").rglob("*.py"))
    words = {path.name: set(re.findall(r"\b[A-Z_]{2,}\b", path.read_text("utf-8"))) for path in judge}
    assert len(words) > 30
    assert {file: shared for file, found in words.items() if (shared := found & names)} == {}


def test_the_names_of_files_are_unique() -> None:
    """All of an FMU stand in one folder: families of solvers have own memories, events sizes, versions tables."""
    names = [path.name for path in FILES if path.name not in SEVERAL]
    assert len(names) == len(set(names))


def _own_names(path: Path) -> set[str]:
    """What a C file alone knows: its static functions and data, types, constants of enumerations and macros."""
    code = _code(path)
    found = {name for match in OWN.finditer(code) for name in match.groups() if name}
    for constants in ENUMERATION.findall(code):
        found |= set(re.findall(r"(?:^|,)\s*(\w+)", constants))
    return found - set(re.findall(r"^#undef (\w+)", code, re.MULTILINE))


@pytest.mark.parametrize("folder", ["engine", "ensemble"])
def test_files_can_be_joined_as_they_are(folder: str) -> None:
    """A name of one file means nothing else in another, so that one file may include several."""
    names = [name for path in sorted((ENGINE.parent / folder).rglob("*.c")) for name in _own_names(path)]
    assert len(names) > 20
    assert [name for name, times in Counter(names).items() if times > 1] == []


def test_there_are_no_circles_of_includes() -> None:
    """NAME.h and NAME.c are one; the memories of all solvers are."""
    graph: dict[str, set[str]] = {}
    for path in FILES:
        graph.setdefault(path.stem, set()).update(_included(path) - {path.stem})
    graph["mechanism"] = {"variables"}
    graph["tableau"] |= {"solver"}
    while graph:
        leaves = {stem for stem, included in graph.items() if not included & graph.keys()}
        assert leaves, f"a circle among {sorted(graph)}"
        graph = {stem: included for stem, included in graph.items() if stem not in leaves}
