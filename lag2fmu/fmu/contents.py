"""The mechanism as text that an FMU of lag2fmu carries, and the parts of an FMU that may be left out."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.archives import DESCRIPTION as DESCRIPTION_ENTRY
from lag2fmu.archives import read_text
from lag2fmu.errors import ExportError
from lag2fmu.mechanism.record import Mechanism

MECHANISM_ENTRY = "extra/org.lag2fmu/mechanism.toml"
REALTIME_ENTRY = "extra/org.lag2fmu/realtime.md"
"""What the FMU takes in real time."""

SOURCES, EQUATIONS, DESCRIPTION, CLOCKS = WITHOUT = ("sources", "equations", "description", "clocks")
"""The parts that an FMU may leave out: sources/, the equations on its page, the mechanism as text."""

_MISSING = (
    "it carries no mechanism: it is of another tool, or was exported with --without description; "
    "give the MODEL that it was made of"
)


def read_mechanism(path: Path) -> Mechanism:
    """The mechanism that the FMU ``path`` carries; raises ExportError if it carries none."""
    from lag2fmu.formats.text import read

    return read(read_text(path, MECHANISM_ENTRY, _MISSING), f"{path}/{MECHANISM_ENTRY}")


def identifier_inside(path: Path) -> str:
    """The C identifier of the mechanism that the FMU ``path`` was made of.

    Raises ExportError if lag2fmu did not make it.
    """
    from lag2fmu.xml_tree import parse

    root = parse(read_text(path, DESCRIPTION_ENTRY).encode(), DESCRIPTION_ENTRY).root
    if not root.get("generationTool").startswith("lag2fmu "):
        raise ExportError(f"'{path}' is no FMU of lag2fmu")
    return next(filter(None, (child.get("modelIdentifier") for child in root.children)), "")
