"""The records ``Finding`` and ``Findings``: the problems of an FMU, with places and remedies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from rich.table import Table

Severity = Literal["error", "warning"]
_MOST_SHOWN, _LONGEST_SHOWN = 500, 1000
"""Findings in the table, and characters of a place or a problem there."""


@dataclass(frozen=True)
class Finding:
    """One problem: the ``rule`` that is broken, the ``place`` in the FMU, the ``problem`` and its ``remedy``.

    An 'error' breaks the standard; a 'warning' is allowed, or tolerated by some importers, but known to hurt.
    """

    rule: str
    place: str
    problem: str
    remedy: str
    severity: Severity = "error"

    def shortened(self) -> Finding:
        """The finding with place and problem cut to the characters that are shown."""
        return replace(self, place=_shortened(self.place), problem=_shortened(self.problem))


@dataclass(frozen=True)
class Findings:
    """The outcome of ``check_fmu``: the problems, errors first, and ``notes`` on what was done and what was not."""

    path: Path
    findings: tuple[Finding, ...]
    notes: tuple[str, ...] = ()

    @property
    def errors(self) -> tuple[Finding, ...]:
        """The findings that break the standard."""
        return tuple(f for f in self.findings if f.severity == "error")

    @property
    def warnings(self) -> tuple[Finding, ...]:
        """The other findings."""
        return tuple(f for f in self.findings if f.severity == "warning")

    @property
    def passed(self) -> bool:
        """Whether there is no error."""
        return not self.errors

    def table(self) -> Table:
        """The findings as a table of rich; without findings only the title and the notes."""
        from rich.markup import escape
        from rich.table import Table

        title = f"{self.path.name}: {_count(self.errors, 'error')}, {_count(self.warnings, 'warning')}"
        hidden = len(self.findings) - _MOST_SHOWN
        more = [f"{hidden} more findings are not shown; correct these first"] if hidden > 0 else []
        notes = escape("\n".join([*more, *self.notes]))
        table = Table(title=escape(title), title_justify="left", caption=notes, caption_justify="left")
        if not self.findings:
            table.box, table.show_header = None, False
        table.add_column("")
        table.add_column("rule and place", overflow="fold")
        table.add_column("problem and remedy", overflow="fold", ratio=1)
        for f in (finding.shortened() for finding in self.findings[:_MOST_SHOWN]):
            mark = "[bold red]error[/bold red]" if f.severity == "error" else "[yellow]warning[/yellow]"
            table.add_row(mark, escape(f"{f.rule}\n{f.place}"), escape(f"{f.problem};\n{f.remedy}"))
        return table

    def __str__(self) -> str:
        """The table as plain text, 110 columns wide."""
        from io import StringIO

        from rich.console import Console

        stream = StringIO()
        Console(file=stream, width=110, color_system=None, force_jupyter=False).print(self.table())
        return stream.getvalue()


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]} ..."


def _count(findings: tuple[Finding, ...], word: str) -> str:
    return f"{len(findings)} {word}{'' if len(findings) == 1 else 's'}"
