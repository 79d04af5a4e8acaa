"""Names from elsewhere as identifiers of a mechanism."""

from __future__ import annotations

import re
from collections.abc import Iterable

from lag2fmu.description.places import WORLD
from lag2fmu.errors import LoadError


def identifier(name: str) -> str:
    """``name`` with all that no identifier can hold as underscores; backslashes of LaTeX are left out."""
    text = re.sub(r"\W", "_", name.replace("\\", ""), flags=re.ASCII)
    return text if text[:1].isalpha() or text[:1] == "_" else f"_{text}"


def identifiers(names: Iterable[str], where: str, taken: Iterable[str] = ()) -> dict[str, str]:
    """{name: identifier}; raises LoadError where two come out alike. What is ``taken`` gets an underscore behind."""
    found: dict[str, str] = {}
    reserved = {*taken, WORLD}
    for name in names:
        text = identifier(name)
        text = f"{text}_" if text in reserved else text
        other = next((key for key, value in found.items() if value == text), None)
        if other is not None:
            raise LoadError(f"{where}: '{other}' and '{name}' would both be called '{text}'; rename one")
        found[name] = text
    return found
