"""What a name may look like, and which one a misspelt name may mean.

SymPy is not imported, so that a start file is written at once.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches

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


def suggestion(word: str, known: Iterable[str]) -> str:
    """The remedy for an unknown ``word``: the names in ``known`` that are near to it, or else what is known."""
    known = list(known)
    near = get_close_matches(word[:MAX_NAME], known, n=2)
    if near:
        return f"did you mean {' or '.join(repr(name) for name in near)}?"
    return f"known are {', '.join(known[:30])}{', ...' if len(known) > 30 else ''}" if known else "there are none"
