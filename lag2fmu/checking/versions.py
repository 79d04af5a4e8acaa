"""The version of the standard that an FMU names, and the FMU's description as a record of this version."""

from __future__ import annotations

from lag2fmu.checking.description import FmuDescription
from lag2fmu.checking.fmi2.description import Description2
from lag2fmu.checking.fmi3.description import Description3
from lag2fmu.errors import LoadError
from lag2fmu.xml_tree import Document

DESCRIPTIONS: dict[str, type[FmuDescription]] = {"2": Description2, "3": Description3}
"""{major version: its class of descriptions}."""


def version_of(document: Document) -> str:
    """The major version that modelDescription.xml names, of DESCRIPTIONS; raises LoadError if that is no known one."""
    version = document.root.get("fmiVersion")
    major = version.split(".")[0] if "." in version else ""
    if major not in DESCRIPTIONS:
        known = " and ".join(f"{known}.0" for known in DESCRIPTIONS)
        raise LoadError(f"the FMU is of FMI {version or '(no fmiVersion)'}; {known} are read")
    return major


def described(document: Document) -> FmuDescription:
    """modelDescription.xml as its version reads it; raises LoadError if that is no known one."""
    return DESCRIPTIONS[version_of(document)](document)
