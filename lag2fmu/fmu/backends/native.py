"""The c backend: C99 sources and a library for each platform, with co-simulation and model exchange."""

from __future__ import annotations

import hashlib
import importlib.metadata
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from lag2fmu.codegen.sources import render_sources
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.functions import Program
from lag2fmu.errors import BuildError
from lag2fmu.fmu.advice import missed_vibrations
from lag2fmu.fmu.backends.backend import Build, Choices, Content, identifier_of
from lag2fmu.fmu.compilers import binaries_text, choose_platforms, compile_libraries
from lag2fmu.fmu.model_description import Interface, ModelDescription
from lag2fmu.fmu.sources import compiled_files, source_files
from lag2fmu.fmu.variables import build_table
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.solvers.methods import METHODS
from lag2fmu.version import VERSION

INTERFACE = Interface(
    capabilities={
        "ModelExchange": {"providesDirectionalDerivative": "true", "completedIntegratorStepNotNeeded": "true"},
        "CoSimulation": {
            "providesDirectionalDerivative": "true",
            "canHandleVariableCommunicationStepSize": "true",
            "canInterpolateInputs": "true",
            "maxOutputDerivativeOrder": "2",
        },
    },
    log_categories={
        "logSingularLinearSystems": "states in which the mass matrix is singular",
        "logStatusWarning": "warnings",
        "logStatusDiscard": "calls that could not be done and may be repeated with other values",
        "logStatusError": "errors",
        "logAll": "everything, tolerated calls included",
    },
    event_indicators=0,
)
_BLANK = "{00000000-0000-0000-0000-000000000000}"
"""A placeholder that stands in the sources until their GUID is known."""
_SOURCES = (
    "<code>sources/</code>: all of it in C99, with <code>buildDescription.xml</code>; needs the headers of FMI 2.0 and "
    "libm"
)


@dataclass(frozen=True)
class _Native:
    name: str = "c"
    solvers: tuple[str, ...] = tuple(METHODS)

    def prepare(self, choices: Choices) -> Build:
        platforms = choose_platforms(choices.platform, choices.compiler)

        def build(mechanism: Mechanism, equations: EquationsOfMotion, program: Program, solver: str) -> Content:
            description, sources = describe(mechanism, equations, program, solver)
            identifier = description.model_identifier
            libraries = compile_libraries(
                sources, fmi_headers(), identifier, platforms, choices.compiler, choices.progress
            )
            files = source_files(sources, identifier)
            for built_for, library in zip(platforms, libraries, strict=True):
                files |= {f"binaries/{folder}/{identifier}{built_for.suffix}": library for folder in built_for.folders}
            return Content(description, files, binaries_text(platforms, choices.compiler), (_SOURCES,))

        return build


NATIVE = _Native()


def describe(
    mechanism: Mechanism, equations: EquationsOfMotion, program: Program, solver: str
) -> tuple[ModelDescription, Mapping[str, str]]:
    """The model description and the C sources {file name: text}; they share the GUID, which is a hash of both."""
    table = build_table(equations, program)
    index = {c.name: i for i, c in enumerate(mechanism.coordinates)}
    vibrations = tuple((v.frequency, index[v.coordinate]) for v in missed_vibrations(equations, METHODS[solver]))
    tables = replace(table.tables, vibrations=vibrations)
    identifier = identifier_of(mechanism.name)
    interface = replace(INTERFACE, event_indicators=len(program.event_functions))
    blank = ModelDescription(mechanism, table.variables, identifier, "", solver, VERSION, interface)
    texts = render_sources(program, tables, METHODS[solver], _BLANK)
    guid = _guid(blank, texts)
    sources = {file: text.replace(_BLANK, guid) for file, text in texts.items()}
    return replace(blank, guid=guid, source_files=compiled_files(sources)), sources


def _guid(blank: ModelDescription, sources: Mapping[str, str]) -> str:
    """A GUID made of a SHA-256 of sources and variables, so that the same input gives the same FMU."""
    digest = hashlib.sha256()
    for file, text in sources.items():
        digest.update(f"{file}\0{text.replace(_BLANK, '')}\0".encode())
    digest.update(repr((blank.mechanism.title, blank.mechanism.experiment, blank.variables)).encode())
    return "{" + str(uuid.UUID(bytes=digest.digest()[:16], version=5)) + "}"


def fmi_headers() -> Path:
    """The folder of fmi2Functions.h, found in the installed fmpy without importing it; raises BuildError."""
    for file in importlib.metadata.files("fmpy") or ():
        if file.name == "fmi2Functions.h":
            return Path(str(file.locate())).parent
    raise BuildError("the headers of FMI 2.0 are missing: the installed fmpy has no fmi2Functions.h; reinstall fmpy")
