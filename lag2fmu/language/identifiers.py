"""The rules for names, and suggestions for misspelt ones.

This module does without SymPy, so that ``new`` writes a start file without delay.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from lag2fmu.errors import MechanismError

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*", re.ASCII)
MAX_NAME = 128
SCHEMA_NAME = "mechanism.schema.json"
"""The name of the schema's file, which stands beside a model; the model's first line names it."""


def check_identifier(name: object, where: str) -> None:
    """Raise MechanismError, with a message that starts with ``where``, unless ``name`` is an identifier.

    An identifier is a letter or underscore, followed by letters, underscores and digits.
    """
    if isinstance(name, str) and len(name) > MAX_NAME:
        raise MechanismError(f"{where}: '{name[:20]}...' has {len(name)} letters; a name has {MAX_NAME} at most")
    if not isinstance(name, str) or not IDENTIFIER.fullmatch(name):
        raise MechanismError(
            f"{where}: {str(name)[:60]!r} is no name; use letters, digits and underscores, not starting with a digit"
        )


def _one_apart(a: str, b: str) -> bool:
    """Whether two names of two letters or more differ in one letter, as kv and kw: too little for a close match."""
    if min(len(a), len(b)) < 2 or abs(len(a) - len(b)) > 1:
        return False
    same = next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    return a[same + (len(a) >= len(b)) :] == b[same + (len(b) >= len(a)) :]


def suggestion(word: object, known: Iterable[str]) -> str:
    """The remedy for an unknown ``word``: similar names in ``known``, or else all of ``known``."""
    from difflib import get_close_matches

    known = list(known)
    if not isinstance(word, str) and str(word) in known:
        return f"give the name as a text, {str(word)!r}"
    word = str(word)
    near = [name for name in known if name.lower() == word.lower()][:2]
    near = near or get_close_matches(word[:MAX_NAME], known, n=2)
    near = near or [name for name in known if _one_apart(word, name)][:2]
    if near:
        return f"did you mean {' or '.join(repr(name) for name in near)}?"
    return f"known are {', '.join(known[:30])}{', ...' if len(known) > 30 else ''}" if known else "there are none"
