"""Which functions of C files the calls from some of them reach, as the text tells: that of the engine is regular.

A definition begins in the first column and ends with a brace there. What stands outside of functions, such as a table
of functions, counts as reached.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_DEFINITION = re.compile(r"^\w[^;{}=]*?(\w+)\([^;{}]*\)\s*(\{\n.*?^\})", re.MULTILINE | re.DOTALL)
_PROTOTYPE = re.compile(r"^\w[^;{}=]*?\w+\([^;{}]*\);", re.MULTILINE)
_NAME = re.compile(r"[A-Za-z_]\w*")


def reached(files: Mapping[str, str], roots: Iterable[str]) -> set[str]:
    """All names in the functions that ``roots`` call in the C ``files`` {name: text}, directly or through others."""
    bodies: dict[str, str] = {}
    waiting = set(roots)
    for text in files.values():
        parts = _DEFINITION.split(_COMMENT.sub("", text))  # what is outside, a name, its body, what is outside ...
        bodies |= zip(parts[1::3], parts[2::3], strict=True)
        waiting |= set(_NAME.findall(_PROTOTYPE.sub("", "".join(parts[::3]))))
    found: set[str] = set()
    while waiting:
        name = waiting.pop()
        found.add(name)
        waiting |= set(_NAME.findall(bodies.get(name, ""))) - found
    return found
