"""What an FMU of lag2fmu carries beside what the standard asks for: its mechanism as text."""

from __future__ import annotations

from pathlib import Path

from lag2fmu.fmu.pack import read_text
from lag2fmu.formats.text import read
from lag2fmu.mechanism.record import Mechanism

MECHANISM_ENTRY = "extra/org.lag2fmu/mechanism.toml"


def read_mechanism(path: Path) -> Mechanism:
    """The mechanism that the FMU ``path`` carries; raises ExportError if it is no FMU of lag2fmu."""
    return read(read_text(path, MECHANISM_ENTRY), f"{path}/{MECHANISM_ENTRY}")
