"""Program -> C on vectors of doubles: the statements that ``c`` prints, each for all lanes of a group at once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import TypeGuard

from lag2fmu.codegen.c import Dialect, c_function, c_prototype
from lag2fmu.codegen.sources import helpers_of, lookups_of, render_sources
from lag2fmu.codegen.step_control import step_control_header
from lag2fmu.codegen.tables import RuntimeTables
from lag2fmu.codegen.templates import render
from lag2fmu.dynamics.functions import Array, Function, Program, filling
from lag2fmu.dynamics.plain import KNOWNS, PlainFunctions
from lag2fmu.graph.graph import Node
from lag2fmu.graph.operations import COSINE, SINE
from lag2fmu.resources import resource_folder
from lag2fmu.solvers.collocation import Collocation
from lag2fmu.solvers.methods import Method
from lag2fmu.solvers.tableaus import Tableau

LaneMethod = Tableau | Collocation
"""The types of the methods that are written for lanes; of the collocation methods only the variational ones are."""

_LIBRARY = ("tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
"""Functions that the C library computes lane by lane."""

FEW_ANGLES = 4
"""With fewer angles than this, the C library computes the sines and cosines."""

LANES = Dialect(
    "Lanes",
    "lanes_of({})",
    {
        **{name: f"lanes_{name}({{0}})" for name in ("sqrt", "exp", "log", "sin", "cos", "abs", "sign")},
        **{name: f"lanes_library({name}, {{0}})" for name in _LIBRARY},
        **{name: f"lanes_{name}({{0}}, {{1}})" for name in ("min", "max", "power_or_zero")},
        "heaviside": "0.5 * (1.0 + lanes_sign({0}))",
        "atan2": "lanes_library_2(atan2, {0}, {1})",
        "power": "lanes_library_2(pow, {0}, {1})",
        "sloped": "lanes_select({1} == 0.0, lanes_of(0.0), {0} * {1})",
        "choice": "lanes_select({0} > 0.0, {1}, {2})",
        "lookup": "lanes_lookup",
        "lookup_2": "lanes_lookup_2",
    },
)


def runs_in_lanes(method: Method, program: Program, motions: int) -> TypeGuard[LaneMethod]:
    """Whether the motion is smooth, its accelerations have a formula, and the method is written for lanes.

    Variational methods run in lanes if there are no constraints and no prescribed ``motions`` whose velocity may jump.
    """
    free = not program.constraints and not motions
    written = isinstance(method, Tableau) or (isinstance(method, Collocation) and method.variational and free)
    return written and not program.hybrid and program.signals == len(program.inputs)


def render_lanes(program: Program, tables: RuntimeTables, method: LaneMethod, lanes: int) -> Mapping[str, str]:
    """{file name: text} of all C sources and headers of a library that runs batches in groups of ``lanes``."""
    functions = lane_functions(program)
    context = {
        "name": tables.model_name,
        "method": method,
        "lanes": lanes,
        "coordinates": len(tables.coordinate_names),
        "further": tables.further,
        "constraints": len(tables.constraint_names),
        "holonomic": tables.holonomic,
        "locals": len(program.locals),
        "signals": program.signals,
        "parameters": len(tables.start_parameters),
        "factor": program.factor_size,
        **_printing(program, functions),
    }
    explicit = isinstance(method, Tableau)
    left_out = {
        "lane_projection_none.c" if tables.constraint_names else "lane_projection.c",
        "lane_variational.c" if explicit else "lane_runge_kutta.c",
    }
    folder = resource_folder("templates") / "ensemble"
    files = {path.name: path.read_text("utf-8") for path in folder.glob("*.[ch]") if path.name not in left_out}
    files |= _lookup_files(program._replace(functions=functions))
    generated = ("lane_sizes.h", "lane_equations.h", "lane_equations.c")
    files |= {name: render(f"ensemble/{name}.jinja", context) for name in generated}
    files["step_control.h"] = step_control_header()
    files["lane_tableau.h"] = render(f"ensemble/lane_{'tableau' if explicit else 'collocation'}.h.jinja", context)
    return dict(sorted(files.items()))


def render_scalar(program: Program, tables: RuntimeTables, method: Method) -> Mapping[str, str]:
    """{file name: text} of a library that runs batches one by one: the engine of the FMU without its gate."""
    batch = (resource_folder("templates") / "ensemble" / "batch.h").read_text("utf-8")
    return {**render_sources(program, tables, method, "", "batch"), "batch.h": batch}


def lane_functions(program: Program) -> tuple[Function, ...]:
    """The functions of ``program`` that the integration needs, of the same form with and without constraints."""
    by_name = {function.name.removeprefix("mechanism_"): function for function in program.functions}
    accelerations, locals_, dynamics = (by_name[name] for name in ("accelerations", "locals", "dynamics"))
    state = dynamics.arguments
    if not program.constraints:
        accelerations = replace(
            accelerations,
            arguments=(*accelerations.arguments, Array("drift", ())),
            arrays=(*accelerations.arrays, "margins", "squares"),
        )
    n = sum(array == "f" for array, *_ in dynamics.results)
    masses = {index: node for array, index, node in dynamics.results if array == "M"}
    diagonal = tuple(("m", i, masses[i * (n + 1)]) for i in range(n))
    doc = "The diagonal m of the mass matrix."
    inertias = Function("mechanism_inertias", doc, state, ("m",), diagonal)
    resting = Function(
        "mechanism_further", "No further states: dz is empty.", (*state, locals_.arguments[-1]), ("dz",), ()
    )
    chosen = [accelerations, inertias, by_name.get("further", resting), locals_]
    chosen += [by_name[name] for name in ("constraints", "constrained", "solve") if program.constraints]
    chosen += [by_name[name] for name in ("canonical", "factor", "solve") if "canonical" in by_name]
    return tuple(replace(f, name=f.name.replace("mechanism_", "lanes_")) for f in chosen)


def render_function(functions: PlainFunctions, name: str, lanes: int, *, jacobian: bool) -> Mapping[str, str]:
    """{file name: text} of a library that evaluates one of ``functions`` at many points, in groups of ``lanes``.

    The Jacobians have a library of their own, as they take the compiler twenty times as long as the derivatives.
    """
    chosen = replace(functions.program.functions[jacobian], name="lanes_values")
    program = functions.program._replace(functions=(chosen,))
    sizes = _sizes(functions)
    results = sum(array != "pivots" for array, *_ in chosen.results)
    context = {**sizes, **_printing(program, (chosen,)), "name": name, "lanes": lanes, "results": results}
    templates = resource_folder("templates")
    files = {file: (templates / "ensemble" / file).read_text("utf-8") for file in ("lanes.h", "lane_math.h")}
    files["function_batch.c"] = (templates / "function" / "function_batch.c").read_text("utf-8")
    files |= _lookup_files(program)
    places = ("function/lane_sizes.h", "ensemble/lane_equations.h", "ensemble/lane_equations.c")
    return files | {place.split("/")[1]: render(f"{place}.jinja", context) for place in places}


def render_external(functions: PlainFunctions, name: str, vectors: Mapping[str, Sequence[str]]) -> Mapping[str, str]:
    """{file name: text} of ``functions`` by the C interface of CasADi; ``vectors`` names the entries of x, u and p."""
    sparsity = functions.sparsity
    lengths = [len(argument.entries) for argument in functions.program.functions[0].arguments]
    sizes = _sizes(functions)
    program, angles = with_angles(functions.program)
    context = {
        **sizes,
        "name": name,
        "vectors": vectors.items(),
        "program": program,
        "functions": program.functions,
        "angles": angles,
        "helpers": helpers_of(program),
        "lookups": lookups_of(program),
        "sizes": lengths,
        "patterns": {
            known: _pattern(int(str(sizes["states"])), length, sparsity[known])
            for known, length in zip(KNOWNS, lengths, strict=True)
        },
        "ends": list(accumulate(len(sparsity[known]) for known in KNOWNS)),
    }
    return {f"{name}.c": render("function/external.c.jinja", context), **_lookup_files(program)}


def with_angles(program: Program) -> tuple[Program, int]:
    """(program, number of angles): ``program`` with a first function ``angles``, whose sines the others are given.

    The angles are those that depend on no other sine or cosine. If there are fewer than FEW_ANGLES, the program is
    unchanged and the number is 0.
    """
    g, known = program.graph, program.functions[0].arguments
    circular = (SINE, COSINE)
    found: dict[Node, dict[int, Node]] = {}
    for node in g.cone([node for f in program.functions for *_, node in f.results]):
        if g.code[node] in circular:
            (angle,) = g.operands[node]
            found.setdefault(angle, {})[g.code[node]] = node
    chosen = [angle for angle in found if not any(g.code[node] in circular for node in g.cone([angle]))]
    if len(chosen) < FEW_ANGLES:
        return program, 0
    values = [
        Array(name, tuple(found[angle].get(code) or g.apply(function, angle) for angle in chosen))
        for name, code, function in (("sines", SINE, "sin"), ("cosines", COSINE, "cos"))
    ]
    functions = tuple(replace(f, arguments=(*f.arguments, *values)) for f in program.functions)
    first = filling("angles", "The angles a whose sines and cosines are needed.", known, a=chosen)
    return program._replace(functions=(first, *functions)), len(chosen)


def _pattern(rows: int, columns: int, places: Sequence[tuple[int, int]]) -> list[int]:
    """A sparsity pattern in CasADi's format: the sizes, the beginning of each column, and the row of each entry."""
    counts = Counter(j for _, j in places)
    return [rows, columns, *accumulate((counts[j] for j in range(columns)), initial=0), *(i for i, _ in places)]


def _sizes(functions: PlainFunctions) -> dict[str, object]:
    derivative = functions.program.functions[0]
    return {
        "states": len(derivative.arguments[1].entries),
        "signals": len(derivative.arguments[2].entries),
        "parameters": len(derivative.arguments[3].entries),
        "pivots": sum(array == "pivots" for array, *_ in derivative.results),
        "entries": sum(map(len, functions.sparsity.values())),
    }


def _printing(program: Program, functions: tuple[Function, ...]) -> dict[str, object]:
    """The context of the templates that print equations in lanes."""
    return {
        "functions": functions,
        "lookups": lookups_of(program._replace(functions=functions)),
        "lane_prototype": lambda function: c_prototype(function, LANES),
        "lane_function": lambda function: c_function(program, function, LANES),
    }


def _lookup_files(program: Program) -> dict[str, str]:
    """The files of the engine that look something up in tables, if ``program`` does."""
    base = resource_folder("templates") / "engine" / "base"
    return {name: (base / name).read_text("utf-8") for name in ("lookup.c", "lookup.h") if lookups_of(program)}
