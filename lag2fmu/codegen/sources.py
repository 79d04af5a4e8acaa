"""The source tree of an FMU: the engine as it stands in templates/, and the files that depend on the mechanism."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from lag2fmu.codegen.amalgamation import included
from lag2fmu.codegen.c import INTERVALS
from lag2fmu.codegen.listing import RUN, c_definition, is_long
from lag2fmu.codegen.reached import reached
from lag2fmu.codegen.step_control import step_control_header
from lag2fmu.codegen.tables import RuntimeTables
from lag2fmu.codegen.templates import render
from lag2fmu.dynamics.functions import Function, Program
from lag2fmu.dynamics.tables import lookups
from lag2fmu.graph.operations import CODE
from lag2fmu.resources import resource_folder
from lag2fmu.solvers.methods import Method, TimeStepping

if TYPE_CHECKING:
    from lag2fmu.graph.interpolants import Interpolant

GENERATED = ("mechanism.h", "tables.c")
"""The files whose templates have their names."""
FUNCTIONS = {
    "mechanism.c": ("", "the equations of this mechanism, M(q, t) qdd = f"),
    "derivatives.c": ("_tangent", "directional derivatives of its equations, M(q, t) qdd = f"),
    "locals_derivatives.c": ("_locals_tangent", "directional derivatives of what is calculated from its motion"),
    "second_derivatives.c": ("_second", "second time derivatives of its equations, M(q, t) qdd = f"),
    "adjoints.c": ("_adjoint", "adjoint derivatives of its equations, M(q, t) qdd = f"),
}
"""{generated file: (end of the names of its functions, its subject)}; the last ending that fits decides.

Compilers work on several files at once, and a page leaves out those of which it calls nothing.
"""

PORTS = ("ports_size.h", "ports.c")
"""The generated files that map value references to slots, for mechanisms whose ports differ from the slots."""

TIMED = ("timed_bounds.h", "timed_bounds.c")
"""The generated files that bound switches which depend on the time alone."""

OBSERVED = ("observed.h", "observed.c")
"""The generated files of an FMU that observes."""

_LISTING = ("listing.c", "listing.h")
_LOOKUP = ("lookup.c", "lookup.h")
_INTERVAL_LOOKUP = ("interval_lookup.c", "interval_lookup.h")

_HELPERS = {
    "sign": "double sign(double x) { return (double)((x > 0.0) - (x < 0.0)); }",
    "heaviside": "double heaviside(double x) { return 0.5 * (1.0 + (double)((x > 0.0) - (x < 0.0))); }",
    "power_or_zero": "double power_or_zero(double x, double exponent) "
    "{ return (x > 0.0 || x < 0.0) ? pow(x, exponent) : x * x; }",
}


def lookups_of(program: Program, functions: Sequence[Function] | None = None) -> list[tuple[int, Interpolant]]:
    """The tables that ``functions``, by default all of ``program``, look something up in, with their numbers."""
    graph = program.graph
    if not graph.tables:
        return []
    nodes = graph.cone(node for f in functions or program.functions for *_, node in f.results)
    used = [table for table, *_ in lookups(graph, nodes)]
    return [(number, table) for number, table in enumerate(graph.tables) if table in used]


def render_sources(
    program: Program, tables: RuntimeTables, method: Method, guid: str, gate: str = "fmi2"
) -> Mapping[str, str]:
    """{file name: text} of all C sources and headers, sorted; the headers of FMI are not among them.

    The files of the engine are copied from templates/engine; the generated ones contain the ``guid``. ``gate`` is
    the folder with the functions of one version of FMI.
    """
    context: dict[str, object] = {
        "program": program,
        "tables": tables,
        "method": method,
        "guid": guid,
        "intervals": INTERVALS,
        "coloured": _takes_jacobians(method, gate),
        "timed_lookups": lookups_of(program, [program.timed_bounds]) if program.timed_bounds else [],
    }
    kind = {
        "constraints": bool(tables.constraint_names),
        "massless": bool(tables.massless),
        "events": program.hybrid,
        "timed": program.timed_bounds is not None,
        "contacts": bool(program.places),
        "located": bool(program.places) and not isinstance(method, TimeStepping),
        "further": bool(tables.further),
        "tables": bool(program.arguments),
        "heap": tables.bound is None,
        "observer": tables.observer is not None,
    }
    needed = [*(_LOOKUP if lookups_of(program) else ()), *(_INTERVAL_LOOKUP if context["timed_lookups"] else ())]
    files = engine_files(method, kind, needed, gate, program.has_adjoints)
    generated = (*GENERATED, *(PORTS if tables.ports else ()), *method.generated_files)
    generated += TIMED if program.timed_bounds else ()
    if tables.observer:
        printed = context | _printed(tables.observer.program, tables.observer.program.functions)
        files |= {name: render(f"mechanism/{name}.jinja", printed) for name in OBSERVED}
    context["program"] = program = _called(program, "".join(files.values()), _asked_for(method, gate, kind["observer"]))
    files |= {name: render(f"mechanism/{name}.jinja", context) for name in generated}
    for name, functions in _by_file(program).items():
        printed = context | {"subject": FUNCTIONS[name][1]} | _printed(program, functions)
        files |= _texts_of("base", _LISTING) if printed["listed"] else {}
        files[name] = render("mechanism/mechanism.c.jinja", printed)
    return dict(sorted(files.items()))


def _called(program: Program, text: str, seldom: Collection[str]) -> Program:
    """``program`` with those of its functions that C ``text`` calls; those named in ``seldom`` are rare."""
    used = (f for f in program.functions if f"{f.name}(" in text)
    return program._replace(functions=tuple(replace(f, rare=f.rare or f.name in seldom) for f in used))


def _asked_for(method: Method, gate: str, observes: bool) -> tuple[str, ...]:
    """The functions that importers ask for between the steps of a ``method``; observers and studies ask within them."""
    if observes or not gate.startswith("fmi"):
        return ()
    jacobian = () if _takes_jacobians(method, gate) else ("mechanism_residual_tangent",)
    return ("mechanism_locals", *jacobian)


def _takes_jacobians(method: Method, gate: str) -> bool:
    """Whether the ``method`` or, of a study, its derivatives ask for the Jacobian of the equations."""
    return method.implicit or (method.variational and gate == "study")


def _by_file(program: Program) -> dict[str, list[Function]]:
    """{file of FUNCTIONS: the functions of ``program`` in it}, without empty files."""
    files: dict[str, list[Function]] = {}
    for function in program.functions:
        chosen = [name for name, (ending, _) in FUNCTIONS.items() if function.name.endswith(ending)]
        files.setdefault(chosen[-1], []).append(function)  # each ends with nothing
    return files


def _printed(program: Program, functions: Sequence[Function], *, patient: bool = False) -> dict[str, object]:
    """The context of templates that print ``functions`` of ``program``, with the tables and helpers that they use.

    ``patient`` is that of ``c_definition``.
    """
    part = program._replace(functions=tuple(functions))
    texts = [c_definition(program, function, patient=patient) for function in functions]
    listed = any(RUN in text for text in texts)
    return {"definitions": texts, "listed": listed, "lookups": lookups_of(part), "helpers": helpers_of(part)}


def page_sources(sources: Mapping[str, str], program: Program, functions: Mapping[str, Program]) -> Mapping[str, str]:
    """{file name: text} of the live page's C code: the ``sources`` of an FMU with another gate, and ``functions``.

    ``program`` is that of the FMU. Its long functions are listings, as a page computes 60 pictures a second at most.
    ``functions`` {file: program} has one program that computes the spots of the picture, and one that computes the
    power of work; each has one function.
    """
    gates = {path.name for folder in ("gate", "fmi2", "fmi3", "adjoints") for path in _paths(f"drivers/{folder}")}
    kept = {name: text for name, text in sources.items() if name not in {*gates, *PORTS}}
    files = kept | _texts("drivers/page")
    called = reached({name: text for name, text in files.items() if name not in FUNCTIONS}, public_names(["page.c"]))
    by_file = _by_file(program)
    for name in sorted(FUNCTIONS.keys() & files.keys()):
        wanted = [function for function in by_file.get(name, ()) if function.name in called]
        if not wanted:
            del files[name]  # the linker leaves out what calls them, which nothing does
        elif any(is_long(program, function) for function in wanted):
            files |= _page_file("mechanism", name, program, wanted, "Equations of the mechanism.")
    for name, other in functions.items():
        (function,) = other.functions
        files |= _page_file(name, f"{name}.c", other, other.functions, "A function of the live page.")
        context: dict[str, object] = {"name": name, "function": function, "size": max(1, len(function.results))}
        files[f"{name}.h"] = render("mechanism/page_function.h.jinja", context)
    return dict(sorted(files.items()))


def _page_file(header: str, file: str, program: Program, functions: Sequence[Function], subject: str) -> dict[str, str]:
    """{file name: text} of a ``file`` with ``functions`` of ``program`` for a page, and of what it includes."""
    context: dict[str, object] = {"name": header, "subject": subject} | _printed(program, functions, patient=True)
    parts = [*(_LOOKUP if context["lookups"] else ()), *(_LISTING if context["listed"] else ())]
    return {file: render("mechanism/page_functions.c.jinja", context)} | _texts_of("base", parts)


def component_sources(sources: Mapping[str, str]) -> Mapping[str, str]:
    """{file name: text} of a component's C code for WebAssembly: the ``sources`` of an FMU, and its calls.

    Adjoint derivatives are those of drivers/fmi3/wasm/adjoint_columns.c, so that the files with others are left out.
    """
    others = {path.name for path in _paths("drivers/adjoints") if path.suffix == ".c"} | {"adjoints.c"}
    return {name: text for name, text in sources.items() if name not in others} | _texts("drivers/fmi3/wasm")


def helpers_of(program: Program) -> list[str]:
    """The functions that C does not have, as far as ``program`` uses them; files with them may be joined."""
    graph = program.graph
    if {CODE[name] for name in _HELPERS}.isdisjoint(graph.code):  # in no function
        return []
    used = {graph.code[node] for f in program.functions for node in graph.cone(n for *_, n in f.results)}
    return [
        f"#ifndef HAS_{name.upper()}\n#define HAS_{name.upper()}\nstatic {text}\n#endif"
        for name, text in _HELPERS.items()
        if CODE[name] in used
    ]


ROOMS = ("base", "laws", "system", "events", "integrate")
"""The folders of the engine below its drivers; what stands in one calls nothing in those behind it."""

_METHODS = "integrate/methods"
_ADJOINTS = {
    (True, False): ("drivers/adjoints",),
    (True, True): ("drivers/adjoints", "drivers/study/gradients"),
}
"""{(whether there are adjoint derivatives, whether the gate is that of studies): folders}."""
_OBSERVERS = (("drivers/observer_none",), ("drivers/observer",))


def _paths(folder: str) -> list[Path]:
    """The C files in a ``folder`` of the engine and in its subfolders."""
    return sorted((resource_folder("templates") / "engine" / folder).rglob("*.[ch]"))


def engine_files(
    method: Method,
    kind: Mapping[str, bool],
    further: Sequence[str] = (),
    gate: str = "fmi2",
    adjoints: bool = False,
) -> dict[str, str]:
    """{file name: text} of the files of the engine that a solver and a kind of mechanism need, without folders.

    - ``kind``: {variant: whether the mechanism has it}.
    - ``further``: the files that generated code needs.
    - ``adjoints``: whether generated code has functions for adjoint derivatives.

    A folder that is named after a variant, or has _none behind its name, holds one alternative. Such folders in each
    room, the folder of the gate (of FMI, or of studies) and that of the solver's family are taken as a whole; gate and
    family also bring their subfolders for these variants, and the gate that for the family. Any other file is taken if
    an #include names it; NAME.h brings NAME.c along.
    """
    variants = [method.family, *(name if has else f"{name}_none" for name, has in kind.items())]
    chosen = [f"drivers/{gate}", f"{_METHODS}/{method.family}", *_ADJOINTS.get((adjoints, gate == "study"), ())]
    chosen += [folder for folder in _OBSERVERS[kind["observer"]] if gate.startswith("fmi")]
    wanted = set(texts := _texts(*chosen, *(f"{room}/{name}" for room in (*ROOMS, *chosen) for name in variants)))
    texts |= _texts(*ROOMS, "drivers", "drivers/gate", f"drivers/{gate.partition('/')[0]}", f"{_METHODS}/common")
    texts["step_control.h"] = step_control_header()
    wanted |= set(further)
    needed: dict[str, str] = {}
    while wanted:
        name = wanted.pop()
        if name in texts and name not in needed:
            needed[name] = texts[name]
            wanted |= {f"{header[:-1]}{ending}" for header in included(texts[name]) for ending in "ch"}
    return needed


def public_names(files: Iterable[str]) -> list[str]:
    """The functions and variables of the C ``files`` (names, without folders) that the linker sees, sorted.

    They stand in engine/public_names.txt, which a test compares with the symbols of the compiled files.
    """
    lines = (resource_folder("templates") / "engine" / "public_names.txt").read_text("utf-8").splitlines()
    names = {file: words for file, *words in map(str.split, lines)}
    return sorted(name for file in files for name in names.get(file, ()))


def engine_text(path: str) -> str:
    """The text of a file of the engine."""
    return (resource_folder("templates") / "engine" / path).read_text("utf-8")


def _texts(*folders: str) -> dict[str, str]:
    """{file name: text} of the C files in these folders of the engine, without their subfolders."""
    return {name: text for folder in folders for name, text in _folder_texts(folder).items()}


def _texts_of(folder: str, names: Iterable[str]) -> dict[str, str]:
    """{file name: text} of the C files with these ``names`` in a folder of the engine."""
    return {name: _folder_texts(folder)[name] for name in names}


@cache
def _folder_texts(folder: str) -> dict[str, str]:
    """The same of one folder, which no one changes."""
    place = resource_folder("templates") / "engine" / folder
    return {path.name: path.read_text("utf-8") for path in place.glob("*.[ch]")}
