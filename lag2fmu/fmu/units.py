"""C files joined to few translation units: starting a compiler for each of forty files costs more than compiling them.

A name that only one file knows (static, an enumeration, a macro, a type) stays its own: where other files of the unit
have the name as well, it gets the file's name behind it, and a macro ends with the file. Where a header of the file has
the name, that cannot be done, and the file stands apart from those that know it. What this overlooks the compiler
refuses, as two definitions of one name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

MOST = 60_000
"""No file joins a unit with more characters, so that several units are compiled side by side."""

_NO_CODE = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', re.DOTALL)
_WORD = re.compile(r"[A-Za-z_]\w*")
_MACRO = re.compile(r"^[ \t]*#[ \t]*define[ \t]+(\w+)", re.MULTILINE)
_STATIC = re.compile(
    r"^(?:static|typedef)\b[^;{=(]*?(?:\b([A-Za-z_]\w*)\s*(?=\((?!\s*\*)|[;\[=])|\(\s*\*\s*(\w+))", re.MULTILINE
)
_TYPE = re.compile(r"^\}\s*(\w+)\s*;|^(?:typedef\s+)?(?:struct|union)\s+(\w+)\s*\{", re.MULTILINE)
_CALLED = re.compile(r"\b([A-Za-z_]\w*)\s*(?=\()")
_INCLUDED = re.compile(r'^[ \t]*#[ \t]*include[ \t]+"([^"]+)"', re.MULTILINE)
_ENUMERATION = re.compile(r"^(?:typedef\s+)?enum\b([^{;]*\{[^}]*\})", re.MULTILINE)
_CONSTANT = re.compile(r"[{,]\s*([A-Za-z_]\w*)|^\s*(\w+)")


@dataclass(frozen=True)
class _File:
    """A C file: the names that only it knows, those of them that its headers have too, and those that are macros.

    ``words`` are those in its code and the functions in its headers, ``heard`` all in both, ``size`` its length.
    """

    name: str
    own: frozenset[str]
    fixed: frozenset[str]
    macros: frozenset[str]
    words: frozenset[str]
    heard: frozenset[str]
    size: int

    def text(self, others: frozenset[str]) -> str:
        """The lines that include it beside files that hear of ``others``."""
        shared = sorted((self.own - self.fixed) & others)
        stem = self.name.removesuffix(".c")
        renamed = "".join(f"#define {name} {name}_of_{stem}\n" for name in shared if name not in self.macros)
        return f'{renamed}#include "{self.name}"\n' + "".join(f"#undef {name}\n" for name in shared)


@dataclass
class _Unit:
    """Files that stand together, their names that cannot change, and all words in them."""

    files: list[_File] = field(default_factory=list)
    fixed: set[str] = field(default_factory=set)
    words: set[str] = field(default_factory=set)
    size: int = 0

    def takes(self, file: _File) -> bool:
        """Whether ``file`` may stand here."""
        return self.size + file.size <= MOST and not (self.fixed & file.words or file.fixed & self.words)

    def join(self, file: _File) -> None:
        """Take ``file``."""
        self.files.append(file)
        self.fixed |= file.fixed
        self.words |= file.words
        self.size += file.size

    def text(self) -> str:
        """What is compiled: it includes the files."""
        of_others = [frozenset().union(*(o.heard for o in self.files if o is not file)) for file in self.files]
        return "".join(file.text(others) for file, others in zip(self.files, of_others, strict=True))


def units(sources: Mapping[str, str]) -> dict[str, str]:
    """{file: text} to compile in place of the .c files in ``sources`` {file: text}; each includes some of them."""
    joined: list[_Unit] = []
    for name in sorted(sources):
        if name.endswith(".c"):
            file = _file(name, sources)
            unit = next((unit for unit in joined if unit.takes(file)), None)
            if unit is None:
                unit = _Unit()
                joined.append(unit)
            unit.join(file)
    return {f"unit_{i}.c": unit.text() for i, unit in enumerate(joined, start=1)}


@lru_cache(maxsize=256)
def _words(header: str) -> frozenset[str]:
    """The words in the code of a header."""
    return frozenset(_WORD.findall(_NO_CODE.sub(" ", header)))


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


def _file(name: str, sources: Mapping[str, str]) -> _File:
    """What the C file ``name`` has of its own, and what it knows."""
    headers = [sources[header] for header in _headers(sources[name], sources)]
    code = _NO_CODE.sub(" ", sources[name])
    words, of_headers = frozenset(_WORD.findall(code)), frozenset().union(*map(_words, headers))
    own = _own(code)
    return _File(
        name=name,
        own=own,
        fixed=own & of_headers,
        macros=frozenset(_MACRO.findall(code)),
        words=words.union(*map(_functions, headers)),
        heard=words | of_headers,
        size=len(code),
    )


def _own(code: str) -> frozenset[str]:
    """The names that a C file without comments declares for itself."""
    bodies = _ENUMERATION.findall(code)
    pairs = [
        *_STATIC.findall(code),
        *_TYPE.findall(code),
        *(pair for body in bodies for pair in _CONSTANT.findall(body)),
    ]
    return frozenset(word for pair in pairs for word in pair if word).union(_MACRO.findall(code))
