"""The headers of FMI as a source FMU finds them with an importer."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.fmu.backends.native import fmi_headers


def headers_of_fmi(folder: Path) -> Path:
    """Those of FMI 3.0 and 2.0.5 in a new folder; the latter are made of fmpy's, which know no prefix."""
    headers = folder / "headers"
    headers.mkdir()
    for header in fmi_headers().glob("fmi[23]*.h"):
        text = header.read_text("utf-8").replace("#define fmi2FullName(name) name", HEADER_OF_FMI_2_0_5)
        (headers / header.name).write_text(text, "utf-8")
    return headers


HEADER_OF_FMI_2_0_5 = """
#if !defined(FMI2_OVERRIDE_FUNCTION_PREFIX) && defined(FMI2_FUNCTION_PREFIX)
  #define FMI2_ACTUAL_FUNCTION_PREFIX FMI2_FUNCTION_PREFIX
#endif
#if defined(FMI2_ACTUAL_FUNCTION_PREFIX)
  #define fmi2Paste(a,b) a ## b
  #define fmi2PasteB(a,b) fmi2Paste(a,b)
  #define fmi2FullName(name) fmi2PasteB(FMI2_ACTUAL_FUNCTION_PREFIX, name)
#else
  #define fmi2FullName(name) name
#endif
"""
