"""C files joined to one, in a fixed order: each .c file with the headers before it that it is the first to include."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence

from lag2fmu.codegen.tokens import words

_CONSTANTS = re.compile(r"^static const (?:double|float) (\w+ = [^;\n]+);", re.MULTILINE)
"""A line of constants in a header. Compilers warn of those in a .c file that nothing uses, but not of macros."""
_INCLUDE = re.compile(r'^#include "([^"]+)"[^\n]*\n', re.MULTILINE)


_INLINE = re.compile(
    r"(?:^/\*(?:(?!\*/).)*\*/\n)?^static inline [^;{}=]*?(\w+)\([^;{}]*\) \{(?:[^\n]*\}|\n.*?^\})\n",
    re.MULTILINE | re.DOTALL,
)
"""A function in a header with the comment before it. Compilers warn of those in a .c file that nothing calls."""


def amalgamated(sources: Mapping[str, str], first: Sequence[str] = ()) -> str:
    """The text of the .c files in ``sources`` {file name: text} with the headers in it that they include.

    Headers that ``sources`` does not have stay includes. A header comes once, where it is included first, those named
    in ``first`` before all. Inline functions that nothing calls are left out.
    """
    done: set[str] = set()

    def text_of(name: str) -> str:
        done.add(name)
        text = sources[name] if name.endswith(".c") else _CONSTANTS.sub(_macros, sources[name])
        inside = _INCLUDE.sub(lambda found: included(found[1], found[0]), text)
        return f"/* ---- {name} */\n{inside}\n"

    def included(name: str, line: str) -> str:
        if name in done:
            return ""
        return text_of(name) if name in sources else line

    files = (*first, *sorted(name for name in sources if name.endswith(".c")))
    return _without_idle("".join(text_of(name) for name in files))


def _without_idle(code: str) -> str:
    """``code`` without the inline functions that nothing in it calls."""
    named = Counter(words(code))
    functions = {found[1]: found[0] for found in _INLINE.finditer(code)}
    while idle := [name for name in functions if named[name] == 1]:
        for name in idle:
            text = functions.pop(name)
            named.subtract(words(text))
            code = code.replace(text, "")
    return code


def _macros(found: re.Match[str]) -> str:
    """The constants of a line as macros."""
    pairs = (part.split(" = ") for part in found[1].split(", "))
    return "\n".join(f"#define {name} ({value})" for name, value in pairs)
