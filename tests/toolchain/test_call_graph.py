"""The compiler's call graph of the C code: files call those of rooms below, in no circle; no function reaches itself.

The calls of files are those of the object's relocations, where taking an address counts as a call. Those of functions
are gcc's own, static functions included.
"""

from __future__ import annotations

import re
import subprocess
from collections import defaultdict
from collections.abc import Container, Iterator, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest
from compiling import COMPILERS

from lag2fmu.analysis.observation import observation
from lag2fmu.analysis.observing import Observing
from lag2fmu.codegen.firmware import FirmwareStyle, firmware_sources
from lag2fmu.codegen.lanes import render_scalar
from lag2fmu.codegen.sources import ROOMS, component_sources, page_sources, render_sources
from lag2fmu.codegen.tables import StepBound
from lag2fmu.dynamics.adjoint import with_adjoints
from lag2fmu.dynamics.balance import with_balance
from lag2fmu.dynamics.functions import Program
from lag2fmu.fmu.backends.native import describe, fmi_headers
from lag2fmu.fmu.deriving import derived
from lag2fmu.fmu.live.spots import no_spots
from lag2fmu.fmu.live.work import work
from lag2fmu.fmu.observers import OBSERVERS_SOLVER
from lag2fmu.fmu.translation_units import c_files
from lag2fmu.fmu.variables import build_table
from lag2fmu.fmu.versions import VERSIONS
from lag2fmu.formats.loading import as_mechanism, load
from lag2fmu.formats.text import read
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.resources import bundled, resource_folder
from lag2fmu.solvers.methods import METHODS
from lag2fmu.studies.library import SOLVERS

pytestmark = [
    pytest.mark.toolchain,
    pytest.mark.fmu,
    pytest.mark.skipif("gcc" not in COMPILERS, reason="no gcc: it writes the call graph"),
]

FAMILIES = ("dopri5", "ros2", "radau5", "gauss4")
"""A solver of each family that every mechanism takes; time stepping is for contacts."""
TABLE = """
[mechanism]
name = "table"
[coordinates]
x = {}
[inputs]
u = {}
[energy]
kinetic = "x_dot**2/2"
[tables.f]
columns = [[0.0, 1.0, 2.0], [0.0, 2.0, 1.0]]
interpolation = "cubic"
outside = "error"
[forces]
x = "f(u) + if(f(1 + sin(t)) > 1.5, 1, 0)"
"""
"""A mechanism that looks values up in a table of data, and whose condition on one depends on nothing but the time."""
SECTION = re.compile(r"Relocation section '\.rela\.(?:text|data|rodata|bss)\.(\S+)'")
USED = re.compile(r"[0-9a-f]{8,} .* R_\S+ +[0-9a-f]+ +(\S+)")
"""Lines of readelf: the section of a function or a datum, and a symbol whose address is in it."""
CALL = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')

Graph = dict[str, set[str]]
ENGINE = resource_folder("templates") / "engine"
LIST = ENGINE / "public_names.txt"
HEIGHT = {path.name: ROOMS.index(room) for room in ROOMS for path in (ENGINE / room).rglob("*.c")}
HEIGHT |= {path.name: len(ROOMS) for path in (ENGINE / "drivers").rglob("*.c")}
"""The height of each file's room; generated files are below all."""


def _circle(graph: Graph) -> list[str]:
    """A circle of ``graph``, empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


class Objects(NamedTuple):
    """What a compiler made of C files.

    ``home`` is the file of each symbol. ``uses`` are the symbols whose address is in the code or the data of each
    symbol. ``edges`` are calls of functions, and ``seen`` the symbols that the linker sees.
    """

    home: dict[str, str]
    uses: Graph
    edges: Graph
    seen: set[str]

    def used_by(self, symbol: str) -> Iterator[str]:
        """The symbols of files that ``symbol`` uses, also by functions that headers hold."""
        for used in self.uses[symbol]:
            if self.home[used].endswith(".h"):
                yield from self.used_by(used)
            else:
                yield used


def _compiled(folder: Path, files: Sequence[str]) -> Objects:
    """What gcc makes of ``files`` in ``folder`` as one unit, in which each function and datum has its own section.

    A unit takes a third of the time of its files. The line of a symbol's definition tells its file.
    """
    (folder / "unit.c").write_text("".join(f'#include "{file}"\n' for file in files), "utf-8")
    headers = [f"-I{fmi_headers(version)}" for version in VERSIONS.values()]
    apart = ["-ffunction-sections", "-fdata-sections"]
    _said(folder, "gcc", "-std=c99", "-O0", "-w", "-g", *apart, "-c", "-fcallgraph-info", *headers, "unit.c")
    home, seen = dict[str, str](), set[str]()
    for line in _said(folder, "nm", "-l", "unit.o").splitlines():
        symbol, _, place = line.partition("\t")
        *_, kind, name = symbol.split()
        if kind != "U":
            home[name] = Path(place.rpartition(":")[0]).name
            seen |= {name} if kind in "TDBRC" else set()
    assert all(home.values())
    uses, user = defaultdict[str, set[str]](set), ""
    for line in _said(folder, "readelf", "-rW", "unit.o").splitlines():
        if line.startswith("Relocation section"):
            section = SECTION.match(line)
            user = _symbol(section[1], home) if section else ""
        elif user and (used := USED.match(line)):
            uses[user] |= {_symbol(used[1], home)} - {""}
    edges = defaultdict[str, set[str]](set)
    for caller, called in CALL.findall((folder / "unit.ci").read_text("utf-8")):
        edges[caller].add(called)
    return Objects(home, uses, edges, seen)


def _said(folder: Path, *command: str) -> str:
    """The output of ``command`` in ``folder``."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def _symbol(name: str, known: Container[str]) -> str:
    """The symbol that is ``known`` by this name, or whose section has it; "" for strings and parts of the C library."""
    while name and name not in known:
        _, _, name = name.partition(".")
    return name


def circles(folder: Path, sources: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """A circle of files and one of functions among the C ``sources``, each empty if there is none."""
    for name, text in sources.items():
        (folder / name).write_text(text, "utf-8")
    found = _compiled(folder, c_files(sources))
    calls: Graph = {file: set() for file in c_files(sources)}
    for symbol, file in found.home.items():
        if file in calls:
            calls[file] |= {found.home[used] for used in found.used_by(symbol)} - {file}
    upward = [f"{a} calls {b}" for a in calls for b in calls[a] if HEIGHT.get(a, len(ROOMS)) < HEIGHT.get(b, 0)]
    assert upward == []
    return _circle(calls), _circle(found.edges)


def _trees(folder: Path) -> Iterator[tuple[Path, Mapping[str, str]]]:
    """Folders and C sources that together have all files of the engine: FMUs, the page's module, studies, batches."""
    cases = [(load(model), solver) for model in ("woodpecker", "double_pendulum") for solver in FAMILIES]
    cases += [(load("newtons_cradle"), "moreau"), (load("four_bar_linkage"), "gauss4"), (read(TABLE, ""), "dopri5")]
    cases += [(load("slides_problem_5_small"), "dopri5"), (load("whipple_bicycle"), "dopri5")]  # the last: listings
    for model, solver in cases:
        found = derived(model, solver)
        trees = {fmi: _sources(model, solver, fmi) for fmi in VERSIONS}
        table, method = build_table(found.equations, found.program), METHODS[solver]
        references = {v.name: v.value_reference for v in table.variables if v.derivative_of is None}
        extra = {"picture": no_spots(), "work": work(found.equations, references)}
        trees["page"] = page_sources(trees["2.0"], found.program, extra)
        trees["batch"] = render_scalar(found.program, table.tables, method)
        if METHODS[solver].error_order == 0:
            bounded = table.tables._replace(bound=StepBound(0.01, 10))
            trees["firmware"] = firmware_sources(found.program, bounded, method, FirmwareStyle("a", own_math=True))
        if solver in SOLVERS:
            studied = with_adjoints(with_balance(found.program))
            trees["study"] = render_sources(studied, table.tables, method, "", "study")
        if model.name == "double_pendulum" and solver == "dopri5":
            trees["observer"] = _observer_sources(model)
            trees["component"] = component_sources(trees["3.0"])
        for name, sources in trees.items():
            (place := folder / f"{model.name}_{solver}_{name}").mkdir()
            yield place, sources


def _observer_sources(model: Mechanism) -> Mapping[str, str]:
    """The C sources of an FMU that observes."""
    found = derived(model, OBSERVERS_SOLVER)
    asked = Observing("ukf", dict.fromkeys([found.mechanism.coordinates[0].name], 0.1))
    seen = observation(found.equations, asked)
    return describe(found.mechanism, found.equations, found.program, found.solver, observed=seen)[1]


def test_names_that_the_linker_sees_are_listed(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    """With --update the list is written anew. Files of the engine, and equal texts of others, are compiled once."""
    names: dict[str, set[str]] = {}
    seen = set[str]()
    for folder, sources in _trees(tmp_path):
        for name, text in sources.items():
            (folder / name).write_text(text, "utf-8")
        keys = {name: name if name in HEIGHT else f"{name}\n{sources[name]}" for name in c_files(sources)}
        new = [name for name, key in keys.items() if key not in seen]
        seen.update(keys.values())
        names |= {file: set() for file in new if file not in names}
        found = _compiled(folder, new)
        for name in found.seen:
            if not name.startswith("fmi"):
                names[found.home[name]].add(name)
    assert names.keys() >= HEIGHT.keys()
    text = "".join(f"{' '.join([file, *sorted(found)])}\n" for file, found in sorted(names.items()) if found)
    if request.config.getoption("--update"):
        LIST.write_text(text, "utf-8")
    assert LIST.read_text("utf-8") == text, "if this is meant, run pytest tests/toolchain/test_call_graph.py --update"


def _kind(program: Program) -> tuple[bool, ...]:
    """What decides which files of the engine a mechanism gets, beside its solver."""
    return (
        bool(program.constraints),
        program.hybrid,
        bool(program.places),
        program.timed_bounds is not None,
        bool(program.arguments),
        program.has_adjoints,
    )


def _sources(model: str | Mechanism, solver: str | None, fmi: str) -> Mapping[str, str]:
    found = derived(as_mechanism(model), solver)
    return describe(found.mechanism, found.equations, found.program, found.solver, found.vibrations, VERSIONS[fmi])[1]


def test_circles_are_found(tmp_path: Path) -> None:
    """Two files in a circle, and a function that calls itself by another one."""
    one = "int two(int); int one(int i) { return two(i); }"
    two = "int one(int); static int odd(int); static int even(int i) { return i ? odd(i - 1) : 1; }"
    two += " static int odd(int i) { return i ? even(i - 1) : 0; } int two(int i) { return even(i) ? one(i) : i; }"
    files, functions = circles(tmp_path, {"one.c": one, "two.c": two})
    assert set(files) == {"one.c", "two.c"}
    assert {"unit.c:even", "unit.c:odd"} <= set(functions) or {"one", "two"} <= set(functions)


def test_calls_by_an_address_and_by_a_header_count(tmp_path: Path) -> None:
    """The one file has the address of a function in its data, the other one calls back by a function of a header."""
    one = "int two(int); int (*const CALLED[])(int) = {two}; int one(int i) { return i; }"
    header = "int one(int); static inline int by_header(int i) { return one(i); }"
    two = '#include "both.h"\nint two(int i) { return by_header(i); }'
    files, functions = circles(tmp_path, {"one.c": one, "two.c": two, "both.h": header})
    assert (set(files), functions) == ({"one.c", "two.c"}, [])
    assert circles(tmp_path, {"one.c": one, "two.c": two.replace("by_header(i)", "i"), "both.h": header})[0] == []


@pytest.mark.parametrize("solver", [solver for solver in FAMILIES if solver != "dopri5"])
def test_calls_form_a_tree_with_every_family_of_solvers(solver: str, tmp_path: Path) -> None:
    """By FMI 2.0; dopri5 is the solver of most bundled mechanisms, below."""
    assert circles(tmp_path, _sources("woodpecker", solver, "2.0")) == ([], [])


def test_calls_form_a_tree_with_time_stepping_and_in_runs_apart_from_fmus(tmp_path: Path) -> None:
    """Time stepping in a component for WebAssembly, the library of studies, and that of batches without lanes."""
    assert circles(tmp_path, component_sources(_sources("newtons_cradle", "moreau", "3.0"))) == ([], [])
    for name, gate in (("gripper", "study"), ("four_bar_linkage", "study")):
        found = derived(load(name), "dopri5")
        tables = build_table(found.equations, found.program).tables
        (apart := tmp_path / name).mkdir()
        assert circles(apart, render_sources(with_adjoints(found.program), tables, METHODS["dopri5"], "", gate)) == (
            [],
            [],
        )
        (batch := tmp_path / f"{name}_batch").mkdir()
        assert circles(batch, render_scalar(found.program, tables, METHODS["dopri5"])) == ([], [])


def test_calls_form_a_tree_in_every_bundled_mechanism(tmp_path: Path) -> None:
    """One mechanism of each kind, as bundled mechanisms of one kind have the same files, with the solver that suits."""
    tried = set()
    for model in bundled():
        found = derived(load(model), None)
        if (kind := (found.solver, _kind(found.program))) not in tried:
            tried.add(kind)
            (folder := tmp_path / model).mkdir()
            assert circles(folder, _sources(model, None, "3.0")) == ([], []), model
    assert len(tried) > len(FAMILIES)
