"""The c backend: C99 sources and a library for each platform, with co-simulation and model exchange."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from lag2fmu.building.process import compiling
from lag2fmu.codegen.sources import render_sources
from lag2fmu.codegen.tables import PortTable, Vibrations
from lag2fmu.dynamics.adjoint import with_adjoints
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Program
from lag2fmu.errors import BuildError, ExportError
from lag2fmu.fmu.backends.backend import Build, Choices, Content, identifier_of
from lag2fmu.fmu.builder import VariableTable
from lag2fmu.fmu.compilers import compile_libraries, constant
from lag2fmu.fmu.contents import CLOCKS, EQUATIONS, REALTIME_ENTRY, SOURCES
from lag2fmu.fmu.documentation import on_equations
from lag2fmu.fmu.live.module import STILL
from lag2fmu.fmu.live.parts import Live
from lag2fmu.fmu.model_description import ModelDescription
from lag2fmu.fmu.observers import observed_table, observing_interface
from lag2fmu.fmu.platforms import WASM, Platform, binaries_text, choose_platforms
from lag2fmu.fmu.realtime import RealTime, bounded, step_bound
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.sources import ALL, SINGLE, source_files
from lag2fmu.fmu.variables import build_table
from lag2fmu.fmu.versions.fmi2 import FMI2
from lag2fmu.fmu.versions.version import Version
from lag2fmu.fmu.wasm.draft import NOT_OFFERED, manifests
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.methods import METHODS
from lag2fmu.version import VERSION

if TYPE_CHECKING:
    from lag2fmu.analysis.observation import Observation
    from lag2fmu.fmu.ports import Port
    from lag2fmu.fmu.taken import Taken

_BLANK = "{00000000-0000-0000-0000-000000000000}"
"""A placeholder that stands in the sources until their GUID is known."""
_SOURCES = (
    "<code>sources/</code>: all of it in C99, with <code>buildDescription.xml</code>; needs the headers of FMI {} and "
    "libm"
)


class _Native(NamedTuple):
    name: str = "c"
    solvers: tuple[str, ...] = tuple(METHODS)

    def prepare(self, choices: Choices) -> Build:
        platforms = choose_platforms(choices.platform, choices.compiler)
        _check_portable(choices, platforms)

        def build(
            mechanism: Mechanism, equations: EquationsOfMotion, program: Program, solver: str, vibrations: Vibrations
        ) -> Content:
            version = choices.version
            observed = _observation(equations, choices)
            clocks = CLOCKS not in choices.without
            description, sources = describe(
                mechanism,
                equations,
                program,
                solver,
                vibrations,
                version,
                arrays=choices.arrays,
                clocks=clocks,
                realtime=choices.realtime,
                observed=observed,
            )
            delivered = SOURCES not in choices.without
            description = description if delivered else _without_sources(description, platforms)
            identifier = description.model_identifier
            with compiling(3) as beside:
                told = beside.submit(_taken, sources, description, version, platforms)
                page = beside.submit(_ahead, choices, equations, program, description.variables, sources, beside)
                libraries = compile_libraries(
                    sources, fmi_headers(version), identifier, platforms, choices.compiler, choices.progress
                )
                compiled = page.result()
            taken = told.result()
            files = source_files(sources, identifier, version.gate, choices.sources) if delivered else {}
            files |= _placed(dict(zip(platforms, libraries, strict=True)), identifier, version)
            binaries = binaries_text(platforms, version.folders, choices.compiler)
            made = None if compiled is None else compiled.result()
            resources = [_SOURCES.format(version.name)] if delivered else []
            resources += [STILL] if choices.live and made is None else []
            if taken:
                resources.append(
                    f"<code>{REALTIME_ENTRY}</code>: what this FMU takes in real time, and its deepest calls"
                )
                files[REALTIME_ENTRY] = "\n".join(taken.markdown).encode()
            return Content(description, files, binaries, tuple(resources), made, _doubt(observed), taken)

        return build


NATIVE = _Native()


def _ahead(
    choices: Choices,
    equations: EquationsOfMotion,
    program: Program,
    variables: Sequence[ScalarVariable],
    sources: Mapping[str, str],
    beside: ThreadPoolExecutor,
) -> Future[Live | None] | None:
    """What is done on the equations while compilers run, one after another; the live page is compiled ``beside``.

    Documentation finds what it tells of them.
    """
    page = choices.live(equations, program, variables, sources) if choices.live else None
    compiled = beside.submit(page) if page else None
    if EQUATIONS not in choices.without:
        on_equations(equations, program)
    return compiled


def _placed(libraries: Mapping[Platform, bytes], identifier: str, version: Version) -> dict[str, bytes]:
    """{name in the archive: content} of the libraries, and of the manifest that belongs to a component."""
    files = {
        f"binaries/{folder}/{identifier}{platform.suffix}": library
        for platform, library in libraries.items()
        for folder in version.folders(platform)
    }
    return files | (manifests() if WASM in libraries else {})


def _check_portable(choices: Choices, platforms: Sequence[Platform]) -> None:
    """Raise ExportError for choices that a component for WebAssembly, if there is one, does not go with."""
    if WASM not in platforms:
        return
    if not choices.version.folders(WASM):
        raise ExportError(
            f"--platform {choices.platform}: FMI {choices.version.name} has no components for WebAssembly; "
            "add --fmi 3.0, or leave wasm out"
        )
    if choices.realtime:
        raise ExportError(
            f"--platform {choices.platform}: calls of a component take memory for what they return, which --profile "
            "realtime excludes; leave one of them out"
        )


def _without_sources(description: ModelDescription, platforms: Sequence[Platform]) -> ModelDescription:
    """The description of an FMU of libraries alone; a component for WebAssembly alone has fewer capabilities."""
    capabilities = description.interface.capabilities
    if platforms == (WASM,):
        capabilities = {
            kind: {word: value for word, value in words.items() if word not in NOT_OFFERED}
            for kind, words in capabilities.items()
        }
    return description._replace(source_files=(), interface=description.interface._replace(capabilities=capabilities))


def _taken(
    sources: Mapping[str, str], description: ModelDescription, version: Version, platforms: Sequence[Platform]
) -> Taken | None:
    """What the FMU of ``sources`` takes where its steps are bounded, on those of the ``platforms`` that are known."""
    if description.bound is None:
        return None
    from lag2fmu.fmu.footprint import LINUX, footprints
    from lag2fmu.fmu.taken import Taken, bounds_of

    identifier = description.model_identifier
    joined = source_files(sources, identifier, version.gate, SINGLE)[f"sources/{ALL}"].decode()
    headers = {file.name: file.read_text("utf-8") for file in sorted(fmi_headers(version).glob("fmi*.h"))}
    begins = (target.split("-")[0] for platform in platforms for target in platform.targets)
    processors = dict.fromkeys(LINUX[begin] for begin in begins if begin in LINUX)
    prints = footprints(ALL, {**headers, ALL: joined}, rf"(?:{identifier}_)?{version.gate}\w+", processors)
    size = constant({**sources, **headers}, "life.h", "COMPONENT_SIZE")
    return Taken(identifier, description.solver, "double", description.bound, size, prints, bounds_of(joined))


def _observation(equations: EquationsOfMotion, choices: Choices) -> Observation | None:
    if not choices.observing:
        return None
    from lag2fmu.analysis.observation import observation

    return observation(equations, choices.observing)


def _doubt(observed: Observation | None) -> str:
    return observed.doubt if observed else ""


def describe(  # noqa: PLR0913 (choices of the user)
    mechanism: Mechanism,
    equations: EquationsOfMotion,
    program: Program,
    solver: str,
    vibrations: Vibrations = (),
    version: Version = FMI2,
    *,
    arrays: bool = False,
    clocks: bool = True,
    realtime: RealTime | None = None,
    observed: Observation | None = None,
) -> tuple[ModelDescription, Mapping[str, str]]:
    """The model description and the C sources {file name: text}; they share the GUID, which is a hash of both.

    ``vibrations`` are those of which the FMU warns if its steps do not resolve them. ``arrays``: coordinates and the
    variables that belong to them are arrays; ``clocks`` tick at impacts. FMI 2.0 has neither. Values are in SI units.
    ``realtime`` says how communication steps are bounded, ``observed`` is what an observer works with.
    Raises ExportError for a longest step that none can have, and for names of the observer that are in use.
    """
    table = build_table(equations, program, events=version.has_ports, clocks=clocks)
    table = observed_table(table, observed) if observed else table
    tables = table.tables._replace(vibrations=vibrations)
    if realtime:
        tables = bounded(tables, step_bound(mechanism, tables.default_solver_step, realtime.step))
    ports, numbers = _ports(mechanism, table, arrays=arrays) if version.has_ports else ((), None)
    tables = tables._replace(ports=numbers)
    identifier = identifier_of(mechanism.name)
    interface = version.interface._replace(event_indicators=len(program.event_functions))
    interface = observing_interface(interface) if observed else interface
    blank = ModelDescription(
        mechanism,
        table.variables,
        identifier,
        "",
        solver,
        VERSION,
        interface,
        ports=ports,
        fmi=version.name,
        bound=tables.bound,
    )
    program = with_adjoints(program) if version.has_adjoints else program
    texts = render_sources(program, tables, METHODS[solver], _BLANK, version.gate)
    guid = _guid(blank, texts)
    sources = {file: text.replace(_BLANK, guid) for file, text in texts.items()}
    return blank._replace(guid=guid, source_files=(ALL,)), sources


def _ports(mechanism: Mechanism, table: VariableTable, *, arrays: bool) -> tuple[tuple[Port, ...], PortTable | None]:
    """The ports of FMI 3.0, and what maps their numbers to slots where these differ."""
    from lag2fmu.fmu.ports import port_table, ports_of

    ports = ports_of(mechanism, table, arrays=arrays)
    return ports, port_table(ports) if ports else None


def _guid(blank: ModelDescription, sources: Mapping[str, str]) -> str:
    """A GUID made of a SHA-256 of sources and variables, so that the same input gives the same FMU."""
    digest = hashlib.sha256()
    for file, text in sources.items():
        digest.update(f"{file}\0{text.replace(_BLANK, '')}\0".encode())
    digest.update(repr((blank.mechanism.title, blank.mechanism.experiment, blank.variables)).encode())
    return "{" + str(uuid.UUID(bytes=digest.digest()[:16], version=5)) + "}"


def fmi_headers(version: Version = FMI2) -> Path:
    """The folder of the headers of ``version``, found in the installed fmpy without importing it; raises BuildError."""
    found = find_spec("fmpy")
    for place in (found and found.submodule_search_locations) or ():
        if Path(place, "c-code", version.header).is_file():
            return Path(place, "c-code")
    raise BuildError(
        f"the headers of FMI {version.name} are missing: the installed fmpy has no {version.header}; reinstall fmpy"
    )
