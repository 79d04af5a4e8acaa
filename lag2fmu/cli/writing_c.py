"""The work of the verb ``c``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from lag2fmu.cli.settings import load_mechanism
from lag2fmu.evidence.realtime import REPORT, realtime_report
from lag2fmu.fmu.firmware import firmware, write_folder


def write_c(model: str, folder: Path, *, force: bool, report: bool, settings: tuple[str, ...], **choices: Any) -> None:
    """Write the files of ``model`` in plain C to ``folder``, with a ``report`` on request; print its size.

    Raises Lag2FmuError for a model or options that do not fit, and for files that exist or cannot be written.
    """
    made = firmware(load_mechanism(model, settings), **choices)
    files = {**made.files, REPORT: realtime_report(made)} if report else made.files
    write_folder(files, folder, force=force)
    remarks = f": {made.remarks}" if made.remarks else ""
    click.echo(f"wrote {folder}, solver {made.solver}{remarks}")
    if made.moved_starts:
        click.echo(made.moved_starts)
    count = made.bound.solver_steps
    click.echo(
        f"{made.size} bytes an instance; steps of {made.bound.longest:g} s at most, "
        f"{count} solver step{'s' if count > 1 else ''} in each"
    )
