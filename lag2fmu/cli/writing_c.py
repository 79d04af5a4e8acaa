"""The work of the verb ``c``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from lag2fmu.cli.settings import load_mechanism
from lag2fmu.evidence.realtime import REPORT, realtime_report
from lag2fmu.fmu.firmware import Firmware, firmware, write_folder
from lag2fmu.mechanism.record import Mechanism


def write_c(model: str, folder: Path, *, force: bool, report: bool, settings: tuple[str, ...], **choices: Any) -> None:
    """Write the files of ``model`` in plain C to ``folder``, with a ``report`` on request; print its size.

    Raises Lag2FmuError for a model or options that do not fit, and for files that exist or cannot be written.
    """
    mechanism = load_mechanism(model, settings)
    made = firmware(mechanism, **choices)
    files = {**made.files, REPORT: _report(mechanism, made, choices)} if report else made.files
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


def _report(mechanism: Mechanism, made: Firmware, choices: dict[str, Any]) -> str:
    """The report on what was ``made`` with ``choices``; numbers of type float are compared with doubles."""
    in_double = None if made.real == "double" else firmware(mechanism, **{**choices, "real": "double", "ram": None})
    return realtime_report(made, in_double)
