"""What a name may look like; without SymPy, so that a start file is written at once."""

from __future__ import annotations

import re

from lag2fmu.errors import MechanismError

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)
MAX_NAME = 128
SCHEMA_NAME = "mechanism.schema.json"
"""The file of the schema, beside a text whose first line names it."""


def check_identifier(name: object, where: str) -> None:
    """Raise MechanismError, its message starting with ``where``, unless ``name`` is a letter or _, then digits too."""
    if not isinstance(name, str) or not IDENTIFIER.fullmatch(name) or len(name) > MAX_NAME:
        raise MechanismError(
            f"{where}: {str(name)[:60]!r} is no name; use letters, digits and underscores, not starting with a digit"
        )
