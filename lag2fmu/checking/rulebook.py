"""The record ``Rulebook``: what a version of the standard asks for, and how its FMUs are run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.description import Description
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.checking.session import Model
from lag2fmu.checking.trials import Trial


@dataclass(frozen=True)
class Rulebook:
    """The rules of one version, such as '2.0'.

    ``on_description`` and ``on_files`` take the version's own Description, see ``versions``. ``functions`` are those
    that the library of a kind must export, ``headers`` the files that no FMU shall bring. ``suffixes`` are those of
    libraries in the folders of binaries/ that importers know, ``hosts`` the folders that this machine loads,
    ``holds_no_library`` tells of other folders that ``on_files`` looks at.
    ``trials`` are those of a kind by name, each takes a ``model``. ``sentences`` tell which of fmpy's findings are
    passed on: (what a sentence contains, the rule it tells of, the remedy); ``other_sentences`` is how severe the
    others are where our rules find nothing.
    """

    version: str
    on_description: Callable[[Any], Iterator[Finding]]
    on_files: Callable[[Archive, Any], Iterator[Finding]]
    functions: Mapping[str, frozenset[str]]
    headers: frozenset[str]
    suffixes: Mapping[str, str]
    hosts: Callable[[], tuple[str, ...]]
    model: type[Model]
    holds_no_library: Callable[[str], bool]
    trials: Callable[[str], dict[str, Trial]]
    sentences: Sequence[tuple[str, str, str]]
    other_sentences: Severity

    def libraries(self, archive: Archive, description: Description) -> dict[str, str]:
        """The libraries that importers would load: name in the archive -> folder in binaries/."""
        found = {}
        for folder, suffix in self.suffixes.items():
            for identifier in description.identifiers.values():
                name = f"binaries/{folder}/{identifier}{suffix}"
                if name in archive.files:
                    found[name] = folder
        return found
