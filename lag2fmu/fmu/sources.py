"""The folder ``sources/`` of an FMU: all C files, and how to build them (FMI 2.0.5, sections 2.1.1 and 2.3)."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

from lag2fmu.codegen.sources import public_names
from lag2fmu.fmu.translation_units import c_files, including
from lag2fmu.fmu.xml_text import document

ALL = "all.c"
"""The one file that an importer compiles. It includes the others, as in the Modelica Association's Reference FMUs."""
PREFIX_HEADER = "prefix.h"


def source_files(sources: Mapping[str, str], identifier: str, gate: str) -> dict[str, bytes]:
    """{name in the archive: content} of ``sources`` {file name: text} with all.c, prefix.h and buildDescription.xml.

    All names that the linker sees get the prefix IDENTIFIER_ in all.c, by prefix.h. So several FMUs can be linked into
    one program, and an importer's shared library that hides no symbols calls no functions of the same name in the
    program and its other libraries. The functions of FMI have plain names in a shared library:
    FMI2_OVERRIDE_FUNCTION_PREFIX (or FMI3_...) takes their prefix back. ``gate`` is the beginning of the functions'
    names, fmi2 or fmi3.
    """
    comment = "/* The whole FMU in one file. The others compile one by one as well, without the prefix of names. */"
    texts = {
        **sources,
        ALL: f"{comment}\n{including([PREFIX_HEADER, *c_files(sources)])}",
        PREFIX_HEADER: _prefix_header(sources, identifier, gate),
    }
    files = {f"sources/{file}": text.encode() for file, text in texts.items()}
    return files | {"sources/buildDescription.xml": build_description(identifier, gate)}


def _prefix_header(sources: Mapping[str, str], identifier: str, gate: str) -> str:
    """A header that puts the prefix IDENTIFIER_ before the functions and variables that the linker sees."""
    lines = [f"#define {name} {identifier}_{name}" for name in public_names(sources)]
    comment = "/* The names that the linker sees, with the prefix of this FMU: they meet no others of the same name. */"
    guard = ["#ifndef PREFIX_H", "#define PREFIX_H", ""]
    return "\n".join(
        [comment, *guard, f"#define {gate.upper()}_FUNCTION_PREFIX {identifier}_", *lines, "", "#endif", ""]
    )


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
