"""The record ``Report``: what was compared, with numbers; as a table, as JSON, as a plot."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from lag2fmu.errors import ExportError
from lag2fmu.language.units import Unit
from lag2fmu.reference.trajectory import Trajectory
from lag2fmu.writing import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.table import Table


Evidence = Literal["integration", "laws"]


@dataclass(frozen=True)
class Check:
    """One comparison: ``value`` must not exceed ``bar``; both in ``unit``, relative numbers if it is empty.

    ``evidence`` tells what a run is held against: a direct integration, or the laws of mechanics along the run itself.
    ``extent``: it says how much was left out; beyond its bar nothing is wrong, but the whole is not judged.
    """

    name: str
    value: float
    bar: float
    detail: str = ""
    extent: bool = False
    unit: str = ""
    evidence: Evidence = "integration"

    @property
    def limit(self) -> str:
        """The bar with its unit, as it is shown."""
        return f"{self.bar:.2e} {self.unit}".rstrip()

    @property
    def passed(self) -> bool:
        """Whether the value is below its bar (a NaN is not)."""
        return self.value <= self.bar

    @property
    def outcome(self) -> Outcome:
        """What the check says."""
        return "ok" if self.passed else "not judged" if self.extent else "FAILED"


Outcome = Literal["ok", "not judged", "FAILED"]
STATUS: Mapping[Outcome, int] = {"ok": 0, "FAILED": 1, "not judged": 3}
"""{outcome: exit status of the command line}; 2 stands for bad usage or bad input."""
_COLOURS = {"ok": "green", "not judged": "bold yellow", "FAILED": "bold red"}


def _json(value: float) -> float | str:
    """``value`` as JSON has it: 'nan' and 'inf' are text there."""
    return value if math.isfinite(value) else str(value)


@dataclass(frozen=True)
class Report:
    """The outcome of ``validate``.

    - ``checks``: the comparisons in order.
    - ``trajectories``: {label: trajectory in SI units} for the plot, 'direct integration' and one for each run of the
      FMU.
    - ``notes``: sentences that say what the numbers mean.
    - ``coordinates``: the names of the curves that are plotted over time (s), in ``units``.
    """

    title: str
    checks: tuple[Check, ...]
    notes: tuple[str, ...]
    coordinates: tuple[str, ...]
    trajectories: Mapping[str, Trajectory] = field(repr=False)
    units: Mapping[str, Unit] = field(default_factory=dict, repr=False)

    @property
    def passed(self) -> bool:
        """Whether every check passed, and enough was compared."""
        return self.outcome == "ok"

    @property
    def outcome(self) -> Outcome:
        """FAILED if any check did, else not judged if too much was left out, else ok."""
        found = {check.outcome for check in self.checks}
        return "FAILED" if "FAILED" in found else "not judged" if "not judged" in found else "ok"

    def table(self) -> Table:
        """The checks as a table of rich."""
        from rich.markup import escape
        from rich.table import Table

        notes = escape("\n".join(self.notes))
        table = Table(title=escape(self.title), title_justify="left", caption=notes, caption_justify="left")
        for column, justify in (
            ("compared", "left"),
            ("value", "right"),
            ("bar", "right"),
            ("", "left"),
            ("by", "left"),
            ("detail", "left"),
        ):
            number = column in {"value", "bar"}
            table.add_column(column, justify=justify, overflow="fold", no_wrap=number)  # type: ignore[arg-type]
        for check in self.checks:
            colour = _COLOURS[check.outcome]
            mark = f"[{colour}]{check.outcome}[/{colour}]"
            table.add_row(
                escape(check.name), f"{check.value:.2e}", check.limit, mark, check.evidence, escape(check.detail)
            )
        return table

    def __str__(self) -> str:
        """The table as plain text, 110 columns wide."""
        from io import StringIO

        from rich.console import Console

        stream = StringIO()
        Console(file=stream, width=110, color_system=None, force_jupyter=False).print(self.table())
        return stream.getvalue()

    def __repr__(self) -> str:
        """One line: what was compared, and whether it passed."""
        why = [check.name for check in self.checks if check.outcome == self.outcome]
        told = f"{len(why)} checks passed" if self.passed else f"{self.outcome}: {', '.join(why)}"
        return f"<Report: {self.title}; {told}>"

    def _repr_html_(self) -> str:
        """The table and the notes, for a notebook."""
        from html import escape

        rows = "".join(
            f"<tr><td>{escape(check.name)}</td><td>{check.value:.2e}</td><td>{check.limit}</td>"
            f"<td>{'ok' if check.passed else f'<b>{check.outcome}</b>'}</td>"
            f"<td>{check.evidence}</td><td>{escape(check.detail)}</td></tr>"
            for check in self.checks
        )
        head = "<tr><th>compared</th><th>value</th><th>bar</th><th></th><th>by</th><th>detail</th></tr>"
        notes = "".join(f"<p>{escape(note)}</p>" for note in self.notes)
        return f"<p><b>{escape(self.title)}</b></p><table>{head}{rows}</table>{notes}"

    def to_json(self) -> str:
        """Everything but the trajectories as JSON."""
        content = {
            "title": self.title,
            "passed": self.passed,
            "outcome": self.outcome,
            "checks": [
                asdict(check) | {"value": _json(check.value), "passed": check.passed, "outcome": check.outcome}
                for check in self.checks
            ],
            "notes": list(self.notes),
        }
        return json.dumps(content, indent=2) + "\n"

    def write(self, path: Path) -> None:
        """Write JSON (.json), text (.txt) or a plot (.png, .svg, .pdf) by the ending; raises ExportError."""
        try:
            with replacing(path) as new:
                if path.suffix == ".json":
                    new.write_text(self.to_json(), "utf-8")
                elif path.suffix == ".txt":
                    new.write_text(str(self), "utf-8")
                elif path.suffix in (".png", ".svg", ".pdf"):
                    self.plot().savefig(new, dpi=150)
                else:
                    raise ExportError(f"'{path}': reports are written as .json, .txt, .png, .svg or .pdf")
        except OSError as error:
            raise ExportError(f"cannot write '{path}': {error.strerror}; choose another place") from error

    def plot(self) -> Figure:
        """Coordinates over time, the direct integration against the FMU, and below it their difference."""
        from lag2fmu.verify.plots.comparison import comparison

        return comparison(self.title, self.coordinates, self.trajectories, self.units)
