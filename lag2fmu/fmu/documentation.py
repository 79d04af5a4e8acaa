"""The folder ``documentation/`` of an FMU: a page to read offline, and the licences."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from itertools import chain, islice
from typing import TYPE_CHECKING, NamedTuple

from lag2fmu.analysis.report import analysis_sections
from lag2fmu.archives import PAGE
from lag2fmu.codegen.templates import render
from lag2fmu.dynamics.blocks import united
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.formulas import Formula, formulas, printed
from lag2fmu.dynamics.functions import Program
from lag2fmu.fmu.backends.backend import Content
from lag2fmu.fmu.contents import EQUATIONS
from lag2fmu.fmu.elements import ENUMERATIONS
from lag2fmu.fmu.live.document import licences
from lag2fmu.fmu.live.page import live_document
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.sketch import sketch
from lag2fmu.lazy import latest
from lag2fmu.picture.scene import Scene
from lag2fmu.procedure.hybrid import Hybrid
from lag2fmu.procedure.length import rounded, symbols
from lag2fmu.resources import resource_folder
from lag2fmu.solvers.methods import METHODS

if TYPE_CHECKING:
    from lag2fmu.fmu.live.samples import Samples

Row = dict[str, str]

MOST_LAWS = 40
"""The most laws of contacts and their like on a page: a heap of 60 spheres has 1830."""
MOST_SYMBOLS = 4000
"""The most symbols, numbers and operations in formulas of laws: heights of a robot's feet would fill pages."""


class Subject(NamedTuple):
    """The subject of a page: the ``equations``, their ``program``, and the ``content`` that a backend made.

    - ``stiffness``: a phrase on the stiffness of the motion, "" if it is not known.
    - ``scene``: the mechanism at its start, None if nothing can be drawn.
    - ``samples``: a direct integration, with which a live page compares its trajectory.
    - ``without``: the names of the parts that the FMU leaves out.
    """

    equations: EquationsOfMotion
    program: Program
    content: Content
    stiffness: str
    scene: Scene | None
    samples: Samples | None = None
    without: Collection[str] = ()


def documentation(of: Subject) -> dict[str, bytes]:
    """{name in the archive: content} of the page and the licences. Source of names: FMI 2.0.5 specification, 2.3."""
    folder = resource_folder("templates") / "documentation"
    files = {"license.txt": folder / "license.txt"}
    if of.content.live is not None:
        files |= {path.name: path for path in licences(of.content.live.spatial)}
    return {
        PAGE: page_text(of).encode(),
        **{f"documentation/licenses/{name}": path.read_text("utf-8").encode() for name, path in files.items()},
    }


def page_text(of: Subject) -> str:
    """The page as HTML; it is live if the content of the FMU has a live page."""
    content, scene = of.content, of.scene
    description = content.description
    mechanism = description.mechanism
    context: dict[str, object] = {
        "mechanism": mechanism,
        "solver": METHODS[description.solver].title,
        "stiffness": of.stiffness,
        "states": sum(v.state for v in description.variables),
        "massless": any(_is_massless(v) for v in description.variables),
        "nomenclature": [(heading, rows) for heading, rows in _nomenclature(description.variables) if rows],
        "sketch": None if scene is None else (sketch(scene), scene.notes),
        "without": of.without,
        **({} if EQUATIONS in of.without else on_equations(of.equations, of.program)),
        "kinds": description.interface.capabilities,
        "binaries": content.binaries,
        "resources": content.resources,
        "taken": content.taken,
        "version": description.version,
        "fmi": description.fmi,
        "arrays": [(port.name, [v.name for v in port.members]) for port in description.ports if port.is_array],
    }
    if content.live is not None:
        return live_document(context, description, content.live, of.samples)
    return render("documentation/index.html.jinja", context)


@latest
def on_equations(equations: EquationsOfMotion, program: Program) -> Mapping[str, object]:
    """The variables of the template on the equations and on their analysis; no other thread may work on the graph."""
    return {
        "formulas": _formulas(equations),
        "laws": _laws(equations),
        "structure": _structure(equations, program),
        "analysis": analysis_sections(equations, closed_forms=False),
    }


def _nomenclature(variables: Iterable[ScalarVariable]) -> list[tuple[str, list[Row]]]:
    """(heading, rows) for each kind of variable; variables with the attribute 'derivative' are left out."""
    variables = list(variables)
    massless = [v for v in variables if _is_massless(v)]
    shown = [v for v in variables if v.derivative_of is None and v not in massless]

    def rows(causality: str, state: bool = False) -> list[Row]:
        return [_row(v) for v in shown if v.causality == causality and v.state == state]

    return [
        ("Coordinates and velocities: states and outputs", rows("output", state=True)),
        ("Without mass: outputs that follow from the states; the start is a guess", [_row(v) for v in massless]),
        ("Inputs", rows("input")),
        ("Parameters", rows("parameter")),
        ("Parameters that follow from others", rows("calculatedParameter")),
        ("Further outputs", rows("output")),
        ("Local variables", rows("local")),
    ]


def _is_massless(variable: ScalarVariable) -> bool:
    """Whether it is a coordinate or velocity that follows from the states because it has no mass."""
    return variable.causality == "output" and variable.initial == "approx" and not variable.state


def _row(variable: ScalarVariable) -> Row:
    start = "" if variable.start is None else f"{variable.start:.12g}"
    unit = variable.unit.si_name if variable.unit is not None else ""
    if variable.unit is not None and variable.unit.name != unit and variable.start is not None:
        start += f" = {variable.unit.from_si(variable.start):.12g} {variable.unit.name}"
    doc = variable.doc
    if variable.type in ENUMERATIONS:
        items = ENUMERATIONS[variable.type].items
        doc += f" ({', '.join(f'{value}: {name}' for name, (value, _) in items.items())})"
    return {"name": variable.name, "unit": unit, "start": start, "doc": doc}


def _formulas(equations: EquationsOfMotion) -> list[tuple[str, tuple[Formula, ...]]]:
    """(heading, formulas), nothing for a mechanism whose formulas would fill pages."""
    found = formulas(equations)
    if found is None:
        return []
    groups = [
        ("Energies", found.energies),
        ("Mass matrix", (found.mass_matrix,)),
        ("Equations of motion", found.motion),
        ("Further states", found.further),
        ("Forces that carry prescribed motions", found.drives),
        ("Constraints", found.constraints),
    ]
    return [(heading, group) for heading, group in groups if group]


def _laws(equations: EquationsOfMotion) -> list[tuple[str, tuple[Formula, ...]]]:
    """(sentence, formulas) of the laws of contacts, stops, latches, dry frictions and tables, MOST_LAWS of them.

    Formulas are written out as long as they have no more than MOST_SYMBOLS together.
    """
    hybrid = Hybrid(equations.mechanism)
    laws = list(islice(chain(hybrid.contacts(), hybrid.forces()), MOST_LAWS + 1))
    told, left = [], MOST_SYMBOLS
    for law in laws[:MOST_LAWS]:
        length = sum(symbols(right) for _, right in law.formulas)
        fits = length <= left
        left -= length if fits else 0
        sentence = law.sentence if fits else f"{law.sentence}; {rounded(length)} symbols are not written out"
        told.append((sentence, printed(equations, law.formulas if fits else ())))
    return [*told, ("and more, which are not written out here", ())] if len(laws) > MOST_LAWS else told


def _operations(program: Program) -> str:
    """The number of operations as a phrase; without a formula, a phrase on what is evaluated instead."""
    formula = program.operations("mechanism_accelerations")
    return str(formula) if formula else f"{program.operations('mechanism_dynamics')} and a linear system"


def _structure(equations: EquationsOfMotion, program: Program) -> list[tuple[str, str]]:
    """Facts on equations that are too long to be written out: sizes, sparsity, method, operations."""
    n, zero = len(equations.forcing), equations.graph.zero
    filled = sum(entry != zero for row in equations.mass_matrix for entry in row)
    return [
        ("generalized coordinates", str(n)),
        ("entries of M that are not identically zero", f"{filled} of {n * n}"),
        ("blocks of coordinates that M couples", str(_blocks(equations))),
        ("accelerations by", program.method),
        ("operations of the accelerations", _operations(program)),
        ("operations of M and f alone", str(program.operations("mechanism_dynamics"))),
    ]


def _blocks(equations: EquationsOfMotion) -> int:
    """The number of groups of coordinates that M does not couple with each other."""
    n, zero = len(equations.forcing), equations.graph.zero
    return len(united({i, *(j for j in range(n) if row[j] != zero)} for i, row in enumerate(equations.mass_matrix)))
