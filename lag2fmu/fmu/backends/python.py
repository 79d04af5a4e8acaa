"""The python backend: the mechanism as a slave of PythonFMU, with equations that a user can open and change.

The archive is packed here and not by PythonFMU's own builder, whose modelDescription.xml is not valid. Of PythonFMU it
holds the library for each platform and the package.
"""

from __future__ import annotations

import hashlib
import re
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from lag2fmu.codegen.python_sources import printable, render_mechanism, runtime_files
from lag2fmu.codegen.tables import RuntimeTables, Vibrations
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Program
from lag2fmu.errors import BuildError, ExportError
from lag2fmu.fmu.backends.backend import Build, Choices, Content, identifier_of
from lag2fmu.fmu.backends.native import describe
from lag2fmu.fmu.contents import EQUATIONS, SOURCES
from lag2fmu.fmu.live.module import STILL
from lag2fmu.fmu.model_description import Interface, ModelDescription
from lag2fmu.fmu.platforms import host_name
from lag2fmu.fmu.scalar_variable import ScalarVariable
from lag2fmu.fmu.variables import build_table
from lag2fmu.fmu.versions.fmi2 import FMI2
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.tableaus import TABLEAUS
from lag2fmu.version import VERSION

LIBRARIES = {
    "linux64": ("linux64", "libpythonfmu-export.so", ".so"),
    "win64": ("win64", "pythonfmu-export.dll", ".dll"),
}
"""{platform: folder and file of PythonFMU's library, and the library's suffix in the FMU}."""
SOLVERS = tuple(TABLEAUS)
"""The methods that the runtime in Python can run: explicit."""


INTERFACE = Interface(
    capabilities={
        "CoSimulation": {"needsExecutionTool": "true", "canHandleVariableCommunicationStepSize": "true"},
    },
    log_categories={
        "logSingularLinearSystems": "states in which the mass matrix is singular",
        "logStatusDiscard": "calls that could not be done and may be repeated with other values",
        "logStatusFatal": "calls that were refused; PythonFMU's library reports no status between discard and fatal",
        "logAll": "everything, tolerated calls included",
    },
    event_indicators=None,
)
_RESOURCES = (
    "<code>resources/</code>: the equations in Python, to be read and changed, in the file that "
    "<code>slavemodule.txt</code> names; the solver; PythonFMU",
    '<a href="externalDependencies.txt">what it needs on the importing side</a>',
)


class _Python(NamedTuple):
    name: str = "python"
    solvers: tuple[str, ...] = SOLVERS

    def prepare(self, choices: Choices) -> Build:
        if choices.version != FMI2:
            raise ExportError(
                f"--fmi {choices.version.name}: the python backend writes FMI 2.0 only, as PythonFMU does; "
                "leave --fmi out, or use --backend c"
            )
        if {SOURCES, EQUATIONS} & {*choices.without}:
            raise ExportError(
                "--without: an FMU of the python backend runs its equations from resources/, where everyone can read "
                "them; leave sources and equations in, or use --backend c"
            )
        platforms = check_choices(choices.solver, choices.platform, choices.compiler)

        def build(
            mechanism: Mechanism, equations: EquationsOfMotion, program: Program, solver: str, vibrations: Vibrations
        ) -> Content:
            identifier = identifier_of(mechanism.name)
            blank = ModelDescription(mechanism, (), identifier, "", solver, VERSION, INTERFACE)
            description, files = python_fmu(equations, program, platforms, blank)
            made = None
            if choices.live:
                native, sources = describe(mechanism, equations, program, solver, vibrations)
                made = choices.live(equations, program, native.variables, sources)()
            resources = (*_RESOURCES, STILL) if choices.live and made is None else _RESOURCES
            return Content(description, files, binaries_of_pythonfmu(platforms), resources, made)

        return build


PYTHON = _Python()


def check_choices(solver: str, platform: str, compiler: str) -> tuple[str, ...]:
    """The platforms for which the FMU gets a library; raises ExportError for choices that this backend lacks."""
    if solver not in SOLVERS:
        raise ExportError(f"--solver {solver}: the python backend has {', '.join(SOLVERS)} only; or use --backend c")
    if compiler != "zig":
        raise ExportError(f"--compiler {compiler}: the python backend compiles nothing; leave --compiler out")
    found: dict[str, None] = {}
    for word in map(str.strip, platform.split(",")):
        name = host_name() if word == "host" else word
        if name not in {"all", *LIBRARIES}:
            place = f"this machine ({name})" if word == "host" else f"'{name}'"
            raise ExportError(
                f"the python backend has no library for {place}: PythonFMU brings those for {' and '.join(LIBRARIES)} "
                "(x86-64) only; use --platform all for these, or --backend c"
            )
        found |= dict.fromkeys(LIBRARIES if name == "all" else (name,))
    return tuple(found)


def binaries_of_pythonfmu(platforms: Sequence[str]) -> str:
    """A phrase on the libraries for ``platforms`` and what they need."""
    return f"{', '.join(platforms)}; the library of PythonFMU, which runs the Python in resources/"


def python_fmu(
    equations: EquationsOfMotion, program: Program, platforms: Sequence[str], blank: ModelDescription
) -> tuple[ModelDescription, dict[str, bytes]]:
    """The FMU's description and files {name in the archive: content}; ``blank`` lacks GUID and variables.

    Raises ExportError for equations that this backend cannot print, BuildError if PythonFMU is not installed.
    """
    if equations.mechanism.constraints or program.contact_events or program.latches or not printable(program):
        raise ExportError(
            f"the python backend cannot write the equations of '{equations.mechanism.name}': "
            "it knows M qdd = f without constraints and events, with energies and outputs; use --backend c"
        )
    if program.hybrid:
        found = ", ".join(event.name for event in program.event_functions)
        raise ExportError(
            f"the python backend does not locate events, and the equations of '{equations.mechanism.name}' change at "
            f"the signs of {found}; use --backend c, or smooth(...) around kinks that a solver step may pass over"
        )
    table = build_table(equations, program)
    description = blank._replace(variables=table.variables)
    shared = _runtime() | _pythonfmu()
    guid = _guid(description, shared | {"": _module(program, table.tables, description)})
    description = description._replace(guid=f"{{{guid}}}")
    module = f"{description.model_identifier}_{guid.hex[:12]}"
    return description, {
        **shared,
        **_libraries(platforms, description.model_identifier),
        f"resources/{module}.py": _module(program, table.tables, description),
        "resources/slavemodule.txt": module.encode(),
        "documentation/externalDependencies.txt": _dependencies().encode(),
        "documentation/licenses/pythonfmu.txt": _content("LICENSE"),
    }


def _guid(description: ModelDescription, files: Mapping[str, bytes]) -> uuid.UUID:
    """A GUID made of a SHA-256 of the Python files and the variables, so that the same input gives the same FMU."""
    mechanism = description.mechanism
    digest = hashlib.sha256(repr((mechanism.title, mechanism.experiment, description.variables)).encode())
    for name, content in sorted(files.items()):
        digest.update(name.encode() + b"\0" + content + b"\0")
    return uuid.UUID(bytes=digest.digest()[:16], version=5)


def _module(program: Program, tables: RuntimeTables, description: ModelDescription) -> bytes:
    """The Python module of the equations."""
    mechanism = description.mechanism
    return render_mechanism(
        program,
        tables,
        TABLEAUS[description.solver],
        description.guid,
        {"title": mechanism.title, "source": mechanism.provenance},
        {v.name: (_unit(v), v.doc) for v in description.variables},
    ).encode()


def _unit(variable: ScalarVariable) -> str:
    return variable.unit.si_name if variable.unit is not None else ""


def _runtime() -> dict[str, bytes]:
    """The files of the runtime in Python, {name in the archive: content}, in a package of their own."""
    package, files = runtime_files()
    return {f"resources/{package}/{name}": text.encode() for name, text in files.items()}


def _installed() -> dict[str, Path]:
    """The files of the installed PythonFMU by their path in it; raises BuildError if there is none.

    They are found without an import, which could find the copy inside an FMU that runs in the same process.
    """
    import importlib.metadata

    try:
        files = importlib.metadata.files("pythonfmu") or []
    except importlib.metadata.PackageNotFoundError as error:
        raise BuildError("PythonFMU is not installed; run 'pip install pythonfmu', or use --backend c") from error
    return {file.as_posix(): Path(str(file.locate())) for file in files}


def _content(place: str) -> bytes:
    """The only file of PythonFMU whose path ends with ``place``; raises BuildError if it is not there."""
    found = [path for name, path in _installed().items() if name.endswith(place) and path.is_file()]
    if len(found) != 1:
        raise BuildError(f"the installed PythonFMU has no '{place}'; run 'pip install pythonfmu==0.7.0'")
    return found[0].read_bytes()


def _pythonfmu() -> dict[str, bytes]:
    """The package pythonfmu, so that the importing side need not install it."""
    modules = sorted(name for name in _installed() if re.fullmatch(r"pythonfmu/\w+\.py", name))
    return {f"resources/{name}": _content(name) for name in modules}


def _libraries(platforms: Sequence[str], identifier: str) -> dict[str, bytes]:
    """PythonFMU's library for each of ``platforms``."""
    rows = [LIBRARIES[platform] for platform in platforms]
    return {
        f"binaries/{folder}/{identifier}{suffix}": _content(f"binaries/{folder}/{file}")
        for folder, file, suffix in rows
    }


def _dependencies() -> str:
    """documentation/externalDependencies.txt (FMI 2.0.5, section 2.3)."""
    from importlib.metadata import version

    installed = version("pythonfmu")
    return (
        "What this FMU needs on the importing side\n"
        "\n"
        "- Python 3.10 or newer, 64 bits; its standard library only. A tool that is no Python itself must find it: on\n"
        "  Linux start it with LD_PRELOAD=/path/to/libpython3.x.so, on Windows put python3.dll on the PATH.\n"
        f"- The library in binaries/ is that of PythonFMU {installed} (MIT, see licenses/pythonfmu.txt). On Linux it\n"
        "  needs glibc 2.32, libgcc_s and a libstdc++ of GCC 12 (GLIBCXX_3.4.30), on Windows the Visual C++ runtime\n"
        "  of 2015 or newer. There is none for macOS and for arm64.\n"
        "\n"
        "What PythonFMU's library does its own way\n"
        "\n"
        "- It does not look at the GUID: another one than that of modelDescription.xml is not refused.\n"
        "- A wrong call returns fmi2Fatal instead of fmi2Error, after a sentence in the log. fmi2Reset and\n"
        "  fmi2SetFMUstate repair the instance.\n"
        "- A communication step that cannot be completed is undone and returns fmi2Discard; fmi2Terminated then stays\n"
        "  true until the instance is freed.\n"
        "- A saved state of another FMU, or a damaged one, is refused by fmi2SetFMUstate, not by\n"
        "  fmi2DeSerializeFMUstate. fmi2FreeFMUstate leaves the pointer as it is: do not use it again.\n"
        "- There are no directional derivatives and no derivatives of inputs and outputs.\n"
    )
