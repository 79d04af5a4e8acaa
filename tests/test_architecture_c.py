"""The rooms of the C runtime: what stands in core knows no standard, files include each other in no circle."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lag2fmu.resources import resource_folder

RUNTIME = resource_folder("templates") / "runtime"
FILES = sorted(RUNTIME.rglob("*.[ch]"))
GATES = ("fmi2", "fmi3", "gate")
PHYSICS = [path for path in FILES if path.relative_to(RUNTIME).parts[0] not in GATES]
SEVERAL = ("solver_memory.h", "event_sizes.h", "version.h", "version.c")
MOST_LINES, MOST_COLUMNS = 50, 120
SIZES = re.compile(r"^ *#if.*\b(N|SIZE)_\w+", re.MULTILINE)
FUNCTION = re.compile(r"^\w[^;{}=]*\) \{\n.*?^\}\n", re.MULTILINE | re.DOTALL)

ROOMS = {
    "core": {"variants", "solvers"},
    "variants": {"core", "solvers"},
    "solvers": {"core", "variants"},
    "adjoints": {"core", "variants"},
    "ensemble": {"core", "variants"},
    "page": {"core", "variants"},
    "studies": {"core", "variants", "solvers"},
}
"""room -> the others whose headers it may include; the interfaces of variants and solvers are theirs"""


def _room(path: Path) -> str:
    return path.relative_to(RUNTIME).parts[0]


def _included(path: Path) -> set[str]:
    """The stems of what a file includes of the runtime and of the generated files."""
    return set(re.findall(r'^#include "(\w+)\.h"', path.read_text("utf-8"), re.MULTILINE))


def _name(path: Path) -> str:
    return path.relative_to(RUNTIME).as_posix()


@pytest.mark.parametrize("path", PHYSICS, ids=_name)
def test_only_the_gate_knows_the_standard(path: Path) -> None:
    assert re.search("fmi[23]", path.read_text("utf-8")) is None
    rooms = {other.stem: _room(other) for other in FILES if other.suffix == ".h"}
    used = {rooms[stem] for stem in _included(path) if stem in rooms}
    assert used <= ROOMS[_room(path)] | {_room(path)}


@pytest.mark.parametrize("path", [path for path in FILES if _room(path) in GATES], ids=_name)
def test_the_versions_share_what_names_no_function_of_theirs(path: Path) -> None:
    """gate/ knows a version by its version.h alone, and no version knows another."""
    other = {"gate": "fmi[23]", "fmi2": "fmi3", "fmi3": "fmi2"}[_room(path)]
    assert re.search(other, path.read_text("utf-8")) is None
    rooms = {other.stem: _room(other) for other in FILES if other.suffix == ".h" and other.name not in SEVERAL}
    assert {rooms[stem] for stem in _included(path) if stem in rooms} <= {_room(path), "gate", *ROOMS}


@pytest.mark.parametrize("path", FILES, ids=_name)
def test_the_mechanism_is_no_question_of_the_preprocessor(path: Path) -> None:
    assert SIZES.search(path.read_text("utf-8")) is None


@pytest.mark.parametrize("path", FILES, ids=_name)
def test_functions_and_lines_fit_a_screen(path: Path) -> None:
    text = path.read_text("utf-8")
    for function in FUNCTION.findall(text):
        assert function.count("\n") <= MOST_LINES, function.split("(")[0]
    assert max(map(len, text.split("\n"))) <= MOST_COLUMNS


def test_the_names_of_files_are_unique() -> None:
    """All of an FMU stand in one folder: families of solvers have own memories, events sizes, versions tables."""
    names = [path.name for path in FILES if path.name not in SEVERAL]
    assert len(names) == len(set(names))


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
