"""C files joined to few translation units: starting a compiler for each of forty files costs more than compiling them.

Files may stand in one unit where no name that only one of them knows (static, an enumeration, a macro, a type) occurs
in another one, or is a function in a header of the other one. What this overlooks the compiler refuses, as two
definitions of one name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

MOST = 60_000
"""Characters of a unit beyond which no file joins it: several units are compiled side by side."""

_NO_CODE = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', re.DOTALL)
_WORD = re.compile(r"[A-Za-z_]\w*")
_MACRO = re.compile(r"^[ \t]*#[ \t]*define[ \t]+(\w+)", re.MULTILINE)
_STATIC = re.compile(r"^(?:static|typedef)\b[^;{=(]*?\b(\w+)\s*(?=[(;\[=])", re.MULTILINE)
_TYPE = re.compile(r"^\}\s*(\w+)\s*;|^(?:typedef\s+)?(?:struct|union)\s+(\w+)\s*\{", re.MULTILINE)
_CALLED = re.compile(r"\b([A-Za-z_]\w*)\s*(?=\()")
_INCLUDED = re.compile(r'^[ \t]*#[ \t]*include[ \t]+"([^"]+)"', re.MULTILINE)
_ENUMERATION = re.compile(r"^(?:typedef\s+)?enum\b([^{;]*\{[^}]*\})", re.MULTILINE)


@dataclass
class _Unit:
    """Files that stand together, the names that only one of them knows, and all words in them."""

    files: list[str] = field(default_factory=list)
    own: set[str] = field(default_factory=set)
    words: set[str] = field(default_factory=set)
    size: int = 0

    def takes(self, other: _Unit) -> bool:
        """Whether the files of ``other`` may stand here."""
        return self.size + other.size <= MOST and not (self.own & other.words or other.own & self.words)

    def join(self, other: _Unit) -> None:
        """Take the files of ``other``."""
        self.files += other.files
        self.own |= other.own
        self.words |= other.words
        self.size += other.size


def units(sources: Mapping[str, str]) -> dict[str, str]:
    """{file: text} to compile in place of the .c files in ``sources`` {file: text}; each includes some of them."""
    joined: list[_Unit] = []
    for file, text in sorted(sources.items()):
        if file.endswith(".c"):
            new = _unit(file, _NO_CODE.sub(" ", text))
            new.words.update(*(_functions(sources[header]) for header in _headers(text, sources)))
            unit = next((unit for unit in joined if unit.takes(new)), None)
            if unit is None:
                joined.append(new)
            else:
                unit.join(new)
    return {
        f"unit_{i}.c": "".join(f'#include "{file}"\n' for file in unit.files) for i, unit in enumerate(joined, start=1)
    }


@lru_cache(maxsize=256)
def _functions(header: str) -> frozenset[str]:
    """The names in the text of a header that functions may have."""
    return frozenset(_CALLED.findall(_NO_CODE.sub(" ", header)))


@lru_cache(maxsize=1024)
def _included(text: str) -> tuple[str, ...]:
    return tuple(_INCLUDED.findall(text))


def _headers(text: str, sources: Mapping[str, str]) -> set[str]:
    """The headers among ``sources`` that a file includes, by itself or by others."""
    found: set[str] = set()
    left = list(_included(text))
    while left:
        header = left.pop()
        if header in sources and header not in found:
            found.add(header)
            left += _included(sources[header])
    return found


def _unit(file: str, code: str) -> _Unit:
    types = {name for pair in _TYPE.findall(code) for name in pair if name}
    constants = {name for body in _ENUMERATION.findall(code) for name in _WORD.findall(body)}
    own = {*_MACRO.findall(code), *_STATIC.findall(code), *types, *constants}
    return _Unit([file], own, set(_WORD.findall(code)), len(code))
