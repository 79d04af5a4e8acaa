"""From a mechanism to an FMU: derive, lower, render, compile, pack."""

from __future__ import annotations

import hashlib
import importlib.metadata
import re
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from lag2fmu.codegen import DEFAULT_SOLVER, METHODS, STIFF_SOLVER, Method, Tables, render_sources, takes
from lag2fmu.dynamics import EquationsOfMotion, Program, derive, lower
from lag2fmu.dynamics.lagrange import complete
from lag2fmu.errors import BuildError, ExportError
from lag2fmu.fmu.compilers import Progress, choose_platforms, compile_libraries
from lag2fmu.fmu.documentation import binaries_text, documentation
from lag2fmu.fmu.model_description import ModelDescription, to_xml
from lag2fmu.fmu.pack import pack, read_entry
from lag2fmu.fmu.python_backend import binaries_of_pythonfmu, check_choices, python_fmu
from lag2fmu.fmu.sources import compiled_files, source_files
from lag2fmu.fmu.terminals import terminals
from lag2fmu.fmu.variables import build_table, promotable
from lag2fmu.mechanism import Mechanism
from lag2fmu.mechanism.loading import as_mechanism
from lag2fmu.mechanism.text import read
from lag2fmu.mechanism.write import write
from lag2fmu.version import VERSION

if TYPE_CHECKING:
    from lag2fmu.dynamics.analysis import Vibration

BACKENDS = ("c", "python")
MECHANISM_ENTRY = "extra/org.lag2fmu/mechanism.toml"
_NOT_IN_XML = re.compile("[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that no XML document can hold (XML 1.0, production 2)."""


@dataclass(frozen=True)
class Fmu:
    """An FMU that was exported: where it is, what it says, and the mechanism it was made of."""

    path: Path
    description: ModelDescription
    solver_choice: str = ""
    """Why the solver was chosen, if it was not asked for, and what it does to fast vibrations: a phrase or nothing."""

    def __repr__(self) -> str:
        """One line: where it is, of what, with which solver."""
        return f"<Fmu {self.path}: {self.mechanism.title}, solver {self.description.solver}>"

    def _repr_html_(self) -> str:
        """The same and the variables, for a notebook."""
        from html import escape

        rows = "".join(
            f"<tr><td>{v.name}</td><td>{v.causality}</td><td>{v.unit.si_name if v.unit else ''}</td>"
            f"<td>{escape(v.doc)}</td></tr>"
            for v in self.description.variables
            if v.causality != "local"
        )
        return f"<p>{escape(repr(self)[1:-1])}</p><table>{rows}</table>"

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism inside."""
        return self.description.mechanism


def export(
    model: Mechanism | str | Path,
    path: str | Path | None = None,
    *,
    solver: str | None = None,
    compiler: str = "zig",
    platform: str = "host",
    backend: str = "c",
    outputs: Sequence[str] = (),
    extra: Mapping[str, bytes] | None = None,
    progress: Progress | None = None,
) -> Fmu:
    """Write the FMU of ``model``, a mechanism or what ``load`` takes, to ``path`` (default: NAME.fmu here).

    ``solver`` is the integrator of co-simulation (see METHODS), by default one that suits the motion at the start;
    ``compiler`` is 'zig' or 'host', ``platform`` 'host', a name in PLATFORMS or 'all', ``backend`` 'c' or 'python' (a
    slave of PythonFMU). ``outputs`` names local variables to be outputs too ('all' for each of them), ``extra`` holds
    further files {name in the archive: content}, ``progress`` is told how the compiler gets on.
    Raises LoadError, ExportError, DerivationError or BuildError.
    """
    mechanism = as_mechanism(model)
    if solver is not None and solver not in METHODS:
        raise ExportError(f"unknown solver '{solver}'; known are {', '.join(METHODS)}")
    if backend not in BACKENDS:
        raise ExportError(f"unknown backend '{backend}'; known are {', '.join(BACKENDS)}")
    contribute = (
        _native(platform, compiler, progress)
        if backend == "c"
        else _python(solver or DEFAULT_SOLVER, platform, compiler)
    )
    target = Path(path) if path is not None else Path(f"{mechanism.name}.fmu")
    _check_target(target)
    _check_texts(mechanism)
    equations = derive(mechanism)
    suited, reason = suited_solver(mechanism, backend)
    solver, choice = (solver, "") if solver else (suited, reason)
    _check_solver(equations.mechanism, METHODS[solver])
    program = lower(equations, promotable(equations, outputs), METHODS[solver].variational)
    mechanism = complete(mechanism, equations)
    description, binaries, own_files = contribute(mechanism, equations, program, solver)
    files = {
        **own_files,
        "modelDescription.xml": to_xml(description),
        MECHANISM_ENTRY: write(mechanism).encode(),
        "terminalsAndIcons/terminalsAndIcons.xml": terminals(mechanism),
        **documentation(description, equations, program, binaries, reason),
        **(extra or {}),
    }
    pack(files, target)
    return Fmu(target, description, "; ".join(filter(None, [choice, damping(equations, METHODS[solver])])))


def suited_solver(mechanism: Mechanism, backend: str) -> tuple[str, str]:
    """The solver for a mechanism whose user named none, and why, as a phrase; "" where its start tells nothing.

    It derives equations of its own: what it adds to their graph must not show in the FMU, which is the same file as if
    the solver had been named.
    """
    from lag2fmu.dynamics.analysis import stiffness

    found = stiffness(derive(mechanism))
    if found is None:
        return DEFAULT_SOLVER, ""
    if not found.stiff:
        return DEFAULT_SOLVER, "the motion is not stiff at its start"
    reason = f"the motion is stiff at its start, with decays of {found.rate:.2g} /s among {found.pace:.2g} /s"
    if backend == "c":
        return STIFF_SOLVER, reason
    return DEFAULT_SOLVER, f"{reason}; only --backend c has {STIFF_SOLVER}"


def damping(equations: EquationsOfMotion, method: Method) -> str:
    """What ``method`` does to fast undamped vibrations about the start, a phrase; empty if there is nothing to say."""
    found = damped_vibrations(equations, method)
    if not found:
        return ""
    others = f" and {len(found) - 3} slower ones" if len(found) > 3 else ""
    listed = ", ".join(map(str, found[:3]))
    return (
        f"it damps the vibrations of {listed}{others} where its steps are longer than an eighth of a period; "
        "solver_max_step bounds them"
    )


def damped_vibrations(equations: EquationsOfMotion, method: Method) -> tuple[Vibration, ...]:
    """The fast undamped vibrations about the start that ``method`` damps if its steps do not resolve them."""
    from lag2fmu.dynamics.analysis import undamped_vibrations

    return undamped_vibrations(equations) if method.implicit else ()


def _check_solver(mechanism: Mechanism, method: Method) -> None:
    """Refuse a variational method that does not take these constraints, with others that do."""
    kinds = sorted({c.kind for c in mechanism.constraints if not takes(method, c.kind)})
    if not kinds:
        return
    others = [name for name, other in METHODS.items() if all(takes(other, c.kind) for c in mechanism.constraints)]
    listed = ", ".join(c.name for c in mechanism.constraints if c.kind in kinds)
    action = "under holonomic constraints only" if takes(method, "holonomic") else "without constraints"
    raise ExportError(
        f"solver '{method.solver}' discretises an action {action}, and mechanism '{mechanism.name}' has "
        f"{' and '.join(kinds)} ones ({listed}); take one of {', '.join(others)}"
    )


_Contribution = Callable[[Mechanism, EquationsOfMotion, Program, str], tuple[ModelDescription, str, dict[str, bytes]]]
"""What a backend makes of them and of a solver: the description, a phrase on the binaries, {name: content}."""


def _native(platform: str, compiler: str, progress: Progress | None) -> _Contribution:
    """The c backend: libraries and their sources. What was chosen is checked at once."""
    platforms = choose_platforms(platform, compiler)

    def contribute(
        mechanism: Mechanism, equations: EquationsOfMotion, program: Program, solver: str
    ) -> tuple[ModelDescription, str, dict[str, bytes]]:
        description, sources = describe(mechanism, equations, program, solver)
        identifier = description.model_identifier
        libraries = compile_libraries(sources, fmi_headers(), identifier, platforms, compiler, progress)
        files = source_files(sources, identifier)
        for built_for, library in zip(platforms, libraries, strict=True):
            files |= {f"binaries/{folder}/{identifier}{built_for.suffix}": library for folder in built_for.folders}
        return description, binaries_text(platforms, compiler), files

    return contribute


def _python(asked: str, platform: str, compiler: str) -> _Contribution:
    """The python backend: Python files and the libraries of PythonFMU."""
    platforms = check_choices(asked, platform, compiler)

    def contribute(
        mechanism: Mechanism, equations: EquationsOfMotion, program: Program, solver: str
    ) -> tuple[ModelDescription, str, dict[str, bytes]]:
        blank = ModelDescription(mechanism, (), identifier_of(mechanism.name), "", solver, VERSION, backend="python")
        description, files = python_fmu(equations, program, platforms, blank)
        return description, binaries_of_pythonfmu(platforms), files

    return contribute


def read_mechanism(path: Path) -> Mechanism:
    """The mechanism that the FMU ``path`` carries; raises ExportError if it is no FMU of lag2fmu."""
    text = read_entry(path, MECHANISM_ENTRY).decode("utf-8")
    return read(text, f"{path}/{MECHANISM_ENTRY}")


def describe(
    mechanism: Mechanism, equations: EquationsOfMotion, program: Program, solver: str
) -> tuple[ModelDescription, Mapping[str, str]]:
    """The model description and the C sources {file name: text}; they share the GUID, which is a hash of both."""
    table = build_table(equations, program)
    index = {c.name: i for i, c in enumerate(mechanism.coordinates)}
    vibrations = tuple((v.frequency, index[v.coordinate]) for v in damped_vibrations(equations, METHODS[solver]))
    tables = replace(table.tables, vibrations=vibrations)
    blank = ModelDescription(mechanism, table.variables, identifier_of(mechanism.name), "", solver, VERSION)
    guid = _guid(blank, program, tables, METHODS[solver])
    sources = render_sources(program, tables, METHODS[solver], guid)
    return replace(blank, guid=guid, source_files=compiled_files(sources)), sources


def _guid(blank: ModelDescription, program: Program, tables: Tables, method: Method) -> str:
    """A GUID made of a SHA-256 of sources and variables, so that the same input gives the same FMU."""
    digest = hashlib.sha256()
    for file, text in render_sources(program, tables, method, "").items():
        digest.update(f"{file}\0{text}\0".encode())
    digest.update(repr((blank.mechanism.title, blank.mechanism.experiment, blank.variables)).encode())
    return "{" + str(uuid.UUID(bytes=digest.digest()[:16], version=5)) + "}"


def identifier_of(name: str) -> str:
    """A short C identifier for the library of the mechanism ``name``."""
    return re.sub(r"\W", "_", name)[:64]


def fmi_headers() -> Path:
    """The folder of fmi2Functions.h, found in the installed fmpy without importing it; raises BuildError."""
    for file in importlib.metadata.files("fmpy") or ():
        if file.name == "fmi2Functions.h":
            return Path(str(file.locate())).parent
    raise BuildError("the headers of FMI 2.0 are missing: the installed fmpy has no fmi2Functions.h; reinstall fmpy")


def _check_target(path: Path) -> None:
    """Refuse a path that cannot be written before any work is done."""
    if path.is_dir():
        raise ExportError(f"the output '{path}' is a folder; name a file, e.g. '{path / 'model.fmu'}'")
    if path.suffix != ".fmu":
        raise ExportError(f"the output '{path}' does not end in .fmu; importers know FMUs by this ending")
    if not path.parent.is_dir():
        raise ExportError(f"the folder '{path.parent}' does not exist; create it or choose another one with -o")


def _check_texts(mechanism: Mechanism) -> None:
    """Refuse titles and descriptions that modelDescription.xml cannot hold."""
    texts = {"title": mechanism.title, "source": mechanism.source}
    for table in ("coordinates", "parameters", "inputs", "outputs"):
        texts |= {f"{table}.{part.name}.doc": part.doc for part in getattr(mechanism, table)}
    for place, text in texts.items():
        found = _NOT_IN_XML.search(text)
        if found is not None:
            raise ExportError(
                f"mechanism '{mechanism.name}', {place}: "
                f"the character {found.group()!r} cannot stand in an FMU; remove it"
            )
