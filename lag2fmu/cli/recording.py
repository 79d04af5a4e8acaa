"""The verb ``record`` with its options."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from lag2fmu.cli.options import FMI, PATH, PLATFORM, WITHIN
from lag2fmu.cli.terminal import console


@click.command("record")
@click.argument("models", nargs=-1, required=True, metavar="MODEL...")
@click.option("-o", "--out", "folder", type=PATH, required=True, metavar="FOLDER", help="Where the records go.")
@FMI
@PLATFORM
@WITHIN
def record_command(models: tuple[str, ...], folder: Path, fmi: str | None, platform: str, limit: float) -> None:
    """Write FMUs with independent reference values and what checkers and importers said of them.

    The form is that of the FMI project's cross-check: a folder for each MODEL, with a table of all. Exit with 1 where a
    tool found fault.
    """
    from rich.table import Table

    from lag2fmu.cli.settings import load_mechanism
    from lag2fmu.evidence.recording import record

    mechanisms = [load_mechanism(model, ()) for model in models]
    said = record(
        mechanisms,
        folder,
        fmi=fmi or "2.0",
        platform=platform,
        limit=limit,
        told=lambda sentence: click.echo(sentence, err=True),
    )
    table = Table("mechanism", "tool", "interface", "outcome", "detail")
    for name, verdicts in said.items():
        for number, v in enumerate(verdicts):
            table.add_row("" if number else name, f"{v.tool} {v.version}".strip(), v.kind, v.outcome, v.detail)
        table.add_section()
    console().print(table)
    click.echo(f"wrote {folder}")
    sys.exit(1 if any(v.outcome == "FAILED" for verdicts in said.values() for v in verdicts) else 0)
