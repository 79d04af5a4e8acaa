"""The record ``Rulebook``: what a version of the standard asks for, and how its FMUs are run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.description import FmuDescription
from lag2fmu.checking.findings import Finding, Severity
from lag2fmu.checking.session import Model
from lag2fmu.checking.trials import Trial


@dataclass(frozen=True)
class Rulebook:
    """The rules of one version, such as '2.0'.

    - ``on_description``, ``on_files``: rules that take the version's own Description, see ``versions``.
    - ``functions``: {kind: functions that its library must export}.
    - ``headers``: the names of files that no FMU shall contain.
    - ``suffixes``: {folder in binaries/ that importers know: suffix of its libraries}.
    - ``hosts``: the folders that this machine loads.
    - ``holds_no_library``: whether a folder is one of those that ``on_files`` looks at.
    - ``trials``: {name: trial} of a kind; each trial takes a ``model``.
    - ``sentences``: the findings of fmpy that are passed on, (words in its sentence, the rule, the remedy).
    - ``other_sentences``: the severity of fmpy's other findings, if the rules here find nothing.
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

    def libraries(self, archive: Archive, description: FmuDescription) -> dict[str, str]:
        """{name in the archive: folder in binaries/} of the libraries that importers would load."""
        found = {}
        for folder, suffix in self.suffixes.items():
            for identifier in description.identifiers.values():
                name = f"binaries/{folder}/{identifier}{suffix}"
                if name in archive.files:
                    found[name] = folder
        return found
