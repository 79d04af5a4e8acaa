"""Names from elsewhere as identifiers of a mechanism."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from itertools import count

from lag2fmu.description.places import WORLD
from lag2fmu.errors import LoadError

_GREEK = re.compile(r"GREEK (?P<size>SMALL|CAPITAL) LETTER (?P<letter>[A-Z]+)")


def identifier(name: str) -> str:
    """``name`` with underscores for all characters that no identifier can hold; backslashes of LaTeX are left out.

    Greek letters become their names. Letters with accents, small digits and the like become plain ones.
    """
    plain = "".join(map(_plain, unicodedata.normalize("NFKD", name)))
    text = re.sub(r"\W", "_", plain.replace("\\", ""), flags=re.ASCII)
    return text if text[:1].isalpha() or text[:1] == "_" else f"_{text}"


def _plain(letter: str) -> str:
    """A letter in ASCII where it has a name there, nothing for an accent, else itself."""
    greek = _GREEK.fullmatch(unicodedata.name(letter, ""))
    if greek is not None:
        return greek["letter"].lower() if greek["size"] == "SMALL" else greek["letter"].capitalize()
    return "" if unicodedata.combining(letter) else letter


def identifiers(names: Iterable[str], where: str, taken: Iterable[str] = ()) -> dict[str, str]:
    """{name: identifier}; one that is ``taken`` gets underscores behind, of equal ones all but the first a number.

    Raises LoadError where the same name stands twice.
    """
    found: dict[str, str] = {}
    plain = [(name, identifier(name)) for name in names]
    reserved, wanted = {*taken, WORLD}, {text for _, text in plain}
    for name, short in plain:
        if name in found:
            raise LoadError(f"{where}: '{name}' stands twice; rename one")
        longer = (short + "_" * k for k in count(1))
        text = next(x for x in longer if x not in wanted | reserved) if short in reserved else short
        if text in found.values():
            numbered = (f"{text}_{k}" for k in count(2))
            text = next(x for x in numbered if x not in wanted | reserved and x not in found.values())
        found[name] = text
    return found
