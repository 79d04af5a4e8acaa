"""C files joined to few, in a fixed order: before each file come the headers that it is the first to include."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from lag2fmu.codegen.tokens import words

_CONSTANTS = re.compile(r"^static const (?:double|float) (\w+ = [^;\n]+);", re.MULTILINE)
"""A line of constants in a header. Compilers warn of those in a .c file that nothing uses, but not of macros."""
_GUARD = re.compile(r"^#ifndef (\w+_H)\n#define \1\n+(.*)^#endif\n", re.MULTILINE | re.DOTALL)
"""What keeps a header from being read twice, and the header."""
_INCLUDE = re.compile(r'^#include "([^"]+)"[^\n]*\n', re.MULTILINE)

_INLINE = re.compile(
    r"(?:^/\*(?:(?!\*/).)*\*/\n)?^static inline [^;{}=]*?(\w+)\([^;{}]*\) \{(?:[^\n]*\}|\n.*?^\})\n",
    re.MULTILINE | re.DOTALL,
)
"""A function in a header with the comment before it. Compilers warn of those in a .c file that nothing calls."""


def amalgamated(sources: Mapping[str, str], first: Sequence[str] = ()) -> str:
    """The text of the .c files in ``sources`` {file name: text} with the headers in it that they include.

    Headers that ``sources`` does not have stay includes. A header comes once, before what includes it first, those
    named in ``first`` before all. Inline functions that nothing calls are left out.
    """
    texts = {name: text if name.endswith(".c") else _CONSTANTS.sub(_macros, text) for name, text in sources.items()}
    files = (*first, *sorted(name for name in sources if name.endswith(".c")))
    return _without_idle(joined(sections(texts, files)))


def sections(sources: Mapping[str, str], files: Iterable[str], before: Iterable[str] = ()) -> dict[str, str]:
    """{file name: text} of ``files`` and of what they include of ``sources``, each behind all that it includes.

    Those ``before`` are there already. The lines that include one of ``sources`` are left out, and the guards of
    headers, as each comes once.
    """
    found: dict[str, str] = {}
    begun = set(before)

    def add(name: str) -> None:
        begun.add(name)
        for other in _INCLUDE.findall(sources[name]):
            if other in sources and other not in begun:
                add(other)
        alone = _INCLUDE.sub(lambda line: "" if line[1] in sources else line[0], sources[name])
        found[name] = _GUARD.sub(r"\2", alone)

    for name in files:
        if name not in begun:
            add(name)
    return found


def joined(texts: Mapping[str, str]) -> str:
    """``texts`` {file name: text} in one, each below a line with its name."""
    return "".join(f"/* ---- {name} */\n{text}\n" for name, text in texts.items())


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
