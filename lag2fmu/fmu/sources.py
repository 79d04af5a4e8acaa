"""The folder ``sources/`` of an FMU: its C files, and how to build them (FMI 2.0.5, sections 2.1.1 and 2.3)."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

from lag2fmu.codegen.amalgamation import amalgamated, joined, sections
from lag2fmu.codegen.sources import ROOMS, public_names
from lag2fmu.fmu.translation_units import including, room_of
from lag2fmu.fmu.xml_text import document

ALL = "all.c"
"""The one file that an importer compiles, as in the Modelica Association's Reference FMUs."""
PREFIX_HEADER = "prefix.h"
MANY, SINGLE = FORMS = ("many", "single")
"""How the C code is delivered: as files that all.c includes, one for a room of the engine, or in all.c as a whole."""
GENERATED = ("mechanism.h", "mechanism.c")
"""The file with the headers that are written for a mechanism, before all rooms, and that with its equations, behind."""


def source_files(sources: Mapping[str, str], identifier: str, gate: str, form: str = MANY) -> dict[str, bytes]:
    """{name in the archive: content} of ``sources`` {file name: text} in a ``form`` of FORMS, and buildDescription.xml.

    All names that the linker sees get the prefix FMI2_FUNCTION_PREFIX (or FMI3_...) in all.c, IDENTIFIER_ unless the
    importer defines another one. So several FMUs can be linked into one program, and an importer's shared library that
    hides no symbols calls no functions of the same name in the program and its other libraries. The functions of FMI
    have plain names in a shared library: FMI2_OVERRIDE_FUNCTION_PREFIX takes their prefix back. ``gate`` is the
    beginning of the functions' names, fmi2 or fmi3.
    """
    header = _prefix_header(sources, identifier, gate)
    if form == SINGLE:
        comment = f"/* The FMU {identifier} in one file of C99. It needs the headers of FMI, and libm. */"
        texts = {ALL: f"{comment}\n{amalgamated({**sources, PREFIX_HEADER: header}, first=(PREFIX_HEADER,))}"}
    else:
        comment = "/* The whole FMU. Each file calls functions of itself, of those before it, and of mechanism.c. */"
        rooms = _by_room(sources)
        texts = {ALL: f"{comment}\n{including([PREFIX_HEADER, *rooms])}", PREFIX_HEADER: header, **rooms}
    files = {f"sources/{file}": text.encode() for file, text in texts.items()}
    return files | {"sources/buildDescription.xml": build_description(identifier, gate)}


def _by_room(sources: Mapping[str, str]) -> dict[str, str]:
    """{file: text} of ``sources``, joined to a file for each room of the engine, in the order of the rooms.

    Before and behind them are those of GENERATED. A header stands in the first file that needs it.
    """
    before, behind = GENERATED
    files: dict[str, list[str]] = {before: [], **{f"{room}.c": [] for room in (*ROOMS, "drivers")}, behind: []}
    for name in sorted(sources):
        room = room_of(name)
        files[f"{room}.c" if room else behind if name.endswith(".c") else before].append(name)
    done: set[str] = set()
    texts: dict[str, str] = {}
    for file, names in files.items():
        found = sections(sources, names, done)
        done |= found.keys()
        texts |= {file: joined(found)} if found else {}
    return texts


def _prefix_header(sources: Mapping[str, str], identifier: str, gate: str) -> str:
    """A header that puts the prefix, by default IDENTIFIER_, before the names that the linker sees."""
    prefix = f"{gate.upper()}_FUNCTION_PREFIX"
    lines = [
        "/* The names that the linker sees, with the prefix of this FMU: they meet no others of the same name. */",
        *("#ifndef PREFIX_H", "#define PREFIX_H", ""),
        *(f"#ifndef {prefix}", f"#define {prefix} {identifier}_", "#endif", ""),
        "#define PREFIX_PASTED(prefix, name) prefix##name",
        "#define PREFIX_JOINED(prefix, name) PREFIX_PASTED(prefix, name)",
        f"#define PREFIXED(name) PREFIX_JOINED({prefix}, name)",
        *(f"#define {name} PREFIXED({name})" for name in public_names(sources)),
        *("", "#endif", ""),
    ]
    return "\n".join(lines)


def build_description(identifier: str, gate: str) -> bytes:
    """sources/buildDescription.xml, in the format of FMI 3.0, section 2.4.10, as FMI 2.0.4 takes it over."""
    root = ET.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = ET.SubElement(root, "BuildConfiguration", {"modelIdentifier": identifier})
    file_set = ET.SubElement(configuration, "SourceFileSet", {"language": "C99"})
    ET.SubElement(file_set, "SourceFile", {"name": ALL})
    remark = "a shared library exports the functions of FMI by their plain names"
    macro = {"name": f"{gate.upper()}_OVERRIDE_FUNCTION_PREFIX", "value": "", "optional": "true"}
    ET.SubElement(file_set, "PreprocessorDefinition", macro | {"description": remark})
    ET.SubElement(configuration, "Library", {"name": "m", "external": "true", "description": "libm, except on Windows"})
    return document(root)
