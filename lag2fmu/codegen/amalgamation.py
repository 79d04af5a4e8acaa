"""C files joined to few, in a fixed order: before each file come the headers that it is the first to include."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache

from lag2fmu.codegen.tokens import words

_CONSTANTS = re.compile(r"^static const (?:double|float) (\w+ = [^;\n]+);", re.MULTILINE)
"""A line of constants in a header. Compilers warn of those in a .c file that nothing uses, but not of macros."""


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
        for other in included(sources[name]):
            if other in sources and other not in begun:
                add(other)
        found[name] = _alone(name, sources)

    for name in files:
        if name not in begun:
            add(name)
    return found


_INCLUDE = '#include "'


@lru_cache(maxsize=1024)
def included(text: str) -> tuple[str, ...]:
    """The headers of the program's own that a C ``text`` includes; each stands on a line of its own."""
    return tuple(part.split('"', 1)[0] for part in f"\n{text}".split(f"\n{_INCLUDE}")[1:])


def _alone(name: str, sources: Mapping[str, str]) -> str:
    """The text of ``name`` without what includes one of ``sources``, and a header's without its guard NAME_H."""
    lines = sources[name].splitlines()
    lines = [line for line in lines if not line.startswith(_INCLUDE) or line.split('"')[1] not in sources]
    guard = f"{name.removesuffix('.h').upper()}_H"
    if f"#define {guard}" in lines:
        for line in (f"#ifndef {guard}", f"#define {guard}"):
            lines.remove(line)
        del lines[len(lines) - 1 - lines[::-1].index("#endif")]
    return "".join(f"{line}\n" for line in lines)


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
