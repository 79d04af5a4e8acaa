"""Options and arguments that several commands share, and what is made of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lag2fmu.errors import ExportError

if TYPE_CHECKING:
    from lag2fmu.mechanism import Mechanism


SET = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Parameter, start value or structural argument; repeatable.",
)
STOP_TIME = click.option("--stop-time", type=float, metavar="S", help="Stop time in seconds.")
INPUT = click.option(
    "--input", "inputs", type=click.Path(path_type=Path), metavar="CSV", help="Signals: time,name,...; linear between."
)
HOLD = click.option("--hold", is_flag=True, help="Hold the signals during each communication step.")
PICTURES = (".png", ".svg", ".pdf")


def load_mechanism(model: str, settings: tuple[str, ...]) -> Mechanism:
    """The mechanism ``model`` with what --set gave; its warnings go to standard error. Raises Lag2FmuError."""
    from lag2fmu.mechanism.loading import load, split_settings, with_values

    structural, values = split_settings(model, settings)
    mechanism = with_values(load(model, structural), values)
    for warning in mechanism.warnings:
        click.echo(f"warning: {warning}", err=True)
    return mechanism


def check_picture(plot: Path | None) -> None:
    """Raise ExportError for a picture that could not be written."""
    if plot is not None:
        check_ending(plot, PICTURES)


def check_ending(path: Path, endings: tuple[str, ...]) -> None:
    """Raise ExportError for a file that could not be written, before the work is done."""
    if path.suffix not in endings:
        raise ExportError(f"'{path}': its ending must be one of {', '.join(endings)}")
    if not path.parent.is_dir():
        raise ExportError(f"'{path}': the folder '{path.parent}' does not exist")
