"""What may be left out of a mechanism by a word: dry friction, stops and contacts, which make events."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from lag2fmu.description.description import Description
from lag2fmu.errors import LoadError
from lag2fmu.mechanism.record import Mechanism, complete

OMISSIBLE: Mapping[str, str] = {"friction": "frictions", "stops": "stops", "contacts": "contacts"}
"""{word: the table of a description that it leaves out}; friction within contacts goes with these."""


def leaving_out(mechanism: Mechanism, words: str | Sequence[str]) -> Mechanism:
    """``mechanism`` without what the ``words`` of OMISSIBLE name, one or several, in its parts too.

    Raises LoadError for another word, and MechanismError where something else needs what is left out, such as an output
    of its force.
    """
    words = [words] if isinstance(words, str) else list(words)
    for word in words:
        if word not in OMISSIBLE:
            raise LoadError(f"without = '{word}': known are {', '.join(OMISSIBLE)}")
    tables = [OMISSIBLE[word] for word in words]
    if not any(getattr(mechanism, table) for table in tables):
        return mechanism
    return complete(_without(mechanism.description, tables))


def _without(d: Description, tables: Sequence[str]) -> Description:
    parts = tuple(replace(part, of=_without(part.of, tables)) for part in d.parts)
    emptied: dict[str, Any] = dict.fromkeys(tables, ())
    return replace(d, parts=parts, **emptied)


def what_could_be_left_out(mechanism: Mechanism) -> Iterator[tuple[str, str]]:
    """(word, phrase with the names) for what ``leaving_out`` would take from ``mechanism``."""
    for word, table in OMISSIBLE.items():
        entries = [entry.name for entry in getattr(mechanism, table)]
        if entries:
            more = f" and {len(entries) - 3} more" if len(entries) > 3 else ""
            yield word, f"{word} ({', '.join(entries[:3])}{more})"
