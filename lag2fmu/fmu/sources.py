"""The folder ``sources/`` of an FMU: all C files, and how to build them (FMI 2.0.5, sections 2.1.1 and 2.3)."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping

from lag2fmu.fmu.xml_text import document

PREFIX_HEADER = "prefix.h"
_DECLARATION = re.compile(r"^(?!typedef|static)[A-Za-z][\w *]*?(\w+)(?:\(|\[|;)", re.MULTILINE)
"""A function or variable that a header of the engine declares: it begins in the first column."""


def compiled_files(sources: Mapping[str, str]) -> tuple[str, ...]:
    """The names of the files that the compiler is called with, sorted."""
    return tuple(sorted(file for file in sources if file.endswith(".c")))


def source_files(sources: Mapping[str, str], identifier: str, gate: str) -> dict[str, bytes]:
    """{name in the archive: content} of ``sources`` {file name: text} with buildDescription.xml.

    Where FMI's header is included, its functions get the prefix IDENTIFIER_, so that several FMUs can be linked into
    one program. The functions of a shared library have plain names: FMI2_OVERRIDE_FUNCTION_PREFIX (or FMI3_...) takes
    the prefix back. ``gate`` is the beginning of the functions' names, fmi2 or fmi3. All other names that the linker
    sees always have the prefix, by prefix.h. Without it an importer's shared library that hides no symbols would call
    functions of the same name in the program and its other libraries.
    """
    header = f'#include "{gate}Functions.h"'
    prefixed = f"#define {gate.upper()}_FUNCTION_PREFIX {identifier}_\n{header}"
    texts = {file: text.replace(header, prefixed) for file, text in sources.items()}
    texts |= {file: f'#include "{PREFIX_HEADER}"\n{texts[file]}' for file in compiled_files(sources)}
    texts[PREFIX_HEADER] = _prefix_header(sources, identifier)
    files = {f"sources/{file}": text.encode() for file, text in texts.items()}
    return files | {"sources/buildDescription.xml": build_description(compiled_files(sources), identifier, gate)}


def _prefix_header(sources: Mapping[str, str], identifier: str) -> str:
    """A header that puts the prefix IDENTIFIER_ before the functions and variables that the headers declare."""
    headers = (text for file, text in sorted(sources.items()) if file.endswith(".h"))
    names = sorted({name for text in headers for name in _DECLARATION.findall(text)})
    lines = [f"#define {name} {identifier}_{name}" for name in names]
    comment = "/* The names that the linker sees, with the prefix of this FMU: they meet no others of the same name. */"
    return "\n".join([comment, "#ifndef PREFIX_H", "#define PREFIX_H", "", *lines, "", "#endif", ""])


def build_description(files: Iterable[str], identifier: str, gate: str) -> bytes:
    """sources/buildDescription.xml, in the format of FMI 3.0, section 2.4.10, as FMI 2.0.4 takes it over."""
    root = ET.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = ET.SubElement(root, "BuildConfiguration", {"modelIdentifier": identifier})
    file_set = ET.SubElement(configuration, "SourceFileSet", {"language": "C99"})
    for file in files:
        ET.SubElement(file_set, "SourceFile", {"name": file})
    remark = "a shared library exports the functions of FMI by their plain names"
    macro = {"name": f"{gate.upper()}_OVERRIDE_FUNCTION_PREFIX", "value": "", "optional": "true"}
    ET.SubElement(file_set, "PreprocessorDefinition", macro | {"description": remark})
    ET.SubElement(configuration, "Library", {"name": "m", "external": "true", "description": "libm, except on Windows"})
    return document(root)
