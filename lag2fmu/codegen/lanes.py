"""Program -> C on vectors of doubles: the same statements as ``c`` prints, each for all lanes of a group at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lag2fmu.codegen.c import Dialect, c_function, c_prototype
from lag2fmu.codegen.sources import RuntimeTables, lookups_of, render_sources
from lag2fmu.codegen.templates import render
from lag2fmu.dynamics.functions import Array, Function, Program
from lag2fmu.resources import resource_folder
from lag2fmu.solvers.methods import Method
from lag2fmu.solvers.tableaus import Tableau

_LIBRARY = ("tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
"""Functions that the C library computes lane by lane."""

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
        "choice": "lanes_select({0} > 0.0, {1}, {2})",
        "lookup": "lanes_lookup",
        "lookup_2": "lanes_lookup_2",
    },
)


def runs_in_lanes(program: Program, method: object) -> bool:
    """Whether the motion is smooth and has a formula, and the method is written out for lanes."""
    return isinstance(method, Tableau) and not program.hybrid and program.signals == len(program.inputs)


def render_lanes(program: Program, tables: RuntimeTables, method: Tableau, lanes: int) -> Mapping[str, str]:
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
        "functions": functions,
        "lookups": lookups_of(replace(program, functions=functions)),
        "lane_prototype": lambda function: c_prototype(function, LANES),
        "lane_function": lambda function: c_function(program, function, LANES),
    }
    left_out = "lane_projection_none.c" if tables.constraint_names else "lane_projection.c"
    folder = resource_folder("templates") / "ensemble"
    files = {path.name: path.read_text("utf-8") for path in folder.glob("*.[ch]") if path.name != left_out}
    if context["lookups"]:
        runtime = resource_folder("templates") / "runtime" / "core"
        files |= {name: (runtime / name).read_text("utf-8") for name in ("lookup.c", "lookup.h")}
    generated = ("lane_sizes.h", "lane_equations.h", "lane_equations.c", "lane_tableau.h")
    files |= {name: render(f"ensemble/{name}.jinja", context) for name in generated}
    return dict(sorted(files.items()))


def render_scalar(program: Program, tables: RuntimeTables, method: Method) -> Mapping[str, str]:
    """{file name: text} of a library that runs batches one by one: the runtime of the FMU without its gate."""
    batch = (resource_folder("templates") / "ensemble" / "batch.h").read_text("utf-8")
    return {**render_sources(program, tables, method, "", "ensemble"), "batch.h": batch}


def lane_functions(program: Program) -> tuple[Function, ...]:
    """The functions of ``program`` that motions take, all of one form whether there are constraints or not."""
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
    return tuple(replace(f, name=f.name.replace("mechanism_", "lanes_")) for f in chosen)
