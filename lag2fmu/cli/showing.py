"""The work of the verb ``show``."""

from __future__ import annotations

from pathlib import Path
from shutil import get_terminal_size

import click

from lag2fmu.analysis.report import analysis_report
from lag2fmu.cli.options import check_picture
from lag2fmu.cli.settings import load_mechanism
from lag2fmu.cli.terminal import knows_unicode
from lag2fmu.errors import ExportError
from lag2fmu.formats.write import write
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.procedure.steps import procedure
from lag2fmu.verify.plan import check_limit


def show_mechanism(
    model: str,
    style: str | None,
    plot: Path | None,
    analysis: bool,
    coupling: bool,
    full: bool,
    realtime: bool,
    limit: float,
    settings: tuple[str, ...],
) -> None:
    """Print the steps, the text and the analysis of ``model``, or with ``realtime`` what it takes; draw it.

    Raises Lag2FmuError for a model that cannot be loaded or derived, and for options that do not fit together.
    """
    if (analysis or coupling) and style == "toml":
        raise ExportError("--analysis and --coupling are written as text or LaTeX; leave out '--format toml'")
    check_picture(plot)
    mechanism = load_mechanism(model, settings)
    if realtime:
        _check_alone(style, plot, analysis, coupling, full)
        click.echo(_taken(mechanism), nl=False)
        return
    style = style or ("unicode" if knows_unicode() else "text")
    width = get_terminal_size().columns
    click.echo(write(mechanism) if style == "toml" else procedure(mechanism, style, full=full, width=width), nl=False)
    if analysis or coupling:
        click.echo(analysis_report(mechanism, style, coupled=coupling, limit=check_limit(limit)), nl=False)
    if plot is not None:
        from lag2fmu.verify.plots.figures import save
        from lag2fmu.verify.plots.mechanism import mechanism_figure

        save(mechanism_figure(mechanism), plot)


def _check_alone(*others: object) -> None:
    """Raise ExportError where one of the ``others`` is chosen beside the report of real time."""
    if any(others):
        raise ExportError("--realtime is a report of its own; leave the other options of show out")


def _taken(mechanism: Mechanism) -> str:
    """What ``mechanism`` takes as plain C, as Markdown."""
    from lag2fmu.evidence.realtime import realtime_report
    from lag2fmu.fmu.firmware import firmware

    return realtime_report(firmware(mechanism))
