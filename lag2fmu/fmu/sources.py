"""The folder ``sources/`` of an FMU: all C files, and how to build them (FMI 2.0.5, sections 2.1.1 and 2.3)."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping

from lag2fmu.fmu.xml_text import document

HEADER = '#include "fmi2Functions.h"'
NO_PREFIX = "FMI2_OVERRIDE_FUNCTION_PREFIX"


def compiled_files(sources: Mapping[str, str]) -> tuple[str, ...]:
    """The names of the files that the compiler is called with, sorted."""
    return tuple(sorted(file for file in sources if file.endswith(".c")))


def source_files(sources: Mapping[str, str], identifier: str) -> dict[str, bytes]:
    """{name in the archive: content} of ``sources`` {file name: text} with buildDescription.xml.

    Where FMI's header is included its functions get the prefix IDENTIFIER_, so that several FMUs can be linked into
    one program; for a shared library, whose functions have plain names, FMI2_OVERRIDE_FUNCTION_PREFIX takes it back.
    """
    prefixed = f"#define FMI2_FUNCTION_PREFIX {identifier}_\n{HEADER}"
    files = {f"sources/{file}": text.replace(HEADER, prefixed).encode() for file, text in sources.items()}
    return files | {"sources/buildDescription.xml": build_description(compiled_files(sources), identifier)}


def build_description(files: Iterable[str], identifier: str) -> bytes:
    """sources/buildDescription.xml, in the format of FMI 3.0, section 2.4.10, as FMI 2.0.4 takes it over."""
    root = ET.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = ET.SubElement(root, "BuildConfiguration", {"modelIdentifier": identifier})
    file_set = ET.SubElement(configuration, "SourceFileSet", {"language": "C99"})
    for file in files:
        ET.SubElement(file_set, "SourceFile", {"name": file})
    remark = "a shared library exports the functions of FMI by their plain names"
    ET.SubElement(
        file_set, "PreprocessorDefinition", {"name": NO_PREFIX, "value": "", "optional": "true", "description": remark}
    )
    ET.SubElement(configuration, "Library", {"name": "m", "external": "true", "description": "libm, except on Windows"})
    return document(root)
