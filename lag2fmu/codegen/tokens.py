"""Words and numbers of C code put into other ones; what stands in comments and strings stays."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

_TOKEN = re.compile(
    r'(?P<text>/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|^#include[^\n]*)'
    r"|(?P<number>\.?\d(?:[eEpP][+-]|[\w.])*)"
    r"|(?P<word>[A-Za-z_]\w*)",
    re.DOTALL | re.MULTILINE,
)
"""ISO/IEC 9899:1999, section 6.4, as far as words have to be told apart from what is none."""

SINGLE: Mapping[str, str] = {
    "double": "float",
    **{f"DBL_{name}": f"FLT_{name}" for name in ("EPSILON", "MIN", "MAX", "DIG", "MANT_DIG")},
    "HUGE_VAL": "HUGE_VALF",
}
"""{word for numbers of type double: that for float}."""


def words(code: str) -> Iterator[str]:
    """The words of ``code`` in C, each as often as it stands there."""
    return (found[0] for found in _TOKEN.finditer(code) if found.lastgroup == "word")


def with_words(code: str, words: Mapping[str, str]) -> str:
    """``code`` in C with each of ``words`` {old: new} in place of the old one."""
    return _TOKEN.sub(lambda found: words.get(found[0], found[0]) if found.lastgroup == "word" else found[0], code)


def in_single(code: str, functions: Iterable[str]) -> str:
    """``code`` in C, with float for double; ``functions`` are those of libm in it, whose names get an f."""
    words = {**SINGLE, **{name: f"{name}f" for name in functions}}

    def put(found: re.Match[str]) -> str:
        if found.lastgroup == "word":
            return words.get(found[0], found[0])
        real = found.lastgroup == "number" and found[0][:2].lower() != "0x" and re.search(r"[.eE]", found[0])
        return f"{found[0]}f" if real else found[0]

    return _TOKEN.sub(put, code)
