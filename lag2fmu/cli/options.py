"""Options and arguments that several commands share, and what is made of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lag2fmu.errors import ExportError

if TYPE_CHECKING:
    from lag2fmu.language.units import Unit
    from lag2fmu.mechanism.record import Mechanism


SET = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Parameter, start value (in its declared unit, or '30 deg') or structural argument; repeatable.",
)
STOP_TIME = click.option("--stop-time", type=float, metavar="S", help="Stop time in seconds.")
INPUT = click.option(
    "--input",
    "inputs",
    type=click.Path(path_type=Path),
    metavar="CSV",
    help="Signals: time,name [unit],...; linear between; a column without a unit is in SI.",
)
HOLD = click.option("--hold", is_flag=True, help="Hold the signals during each communication step.")
PICTURES = (".png", ".svg", ".pdf")
CSV = (".csv", ".txt", "")


def load_mechanism(model: str, settings: tuple[str, ...]) -> Mechanism:
    """The mechanism ``model`` with what --set gave; that and its warnings go to standard error. Raises Lag2FmuError."""
    from lag2fmu.formats.loading import load, split_settings, with_settings
    from lag2fmu.mechanism.display import display_units

    structural, texts = split_settings(model, settings)
    mechanism = with_settings(load(model, structural), texts)
    echo_settings(texts, display_units(mechanism))
    for warning in mechanism.warnings:
        click.echo(f"warning: {warning}", err=True)
    return mechanism


def echo_settings(texts: Mapping[str, str], units: Mapping[str, Unit]) -> None:
    """Say on standard error what was set, with the unit in which it was read."""
    from lag2fmu.mechanism.display import shown, value_in_si

    for name, text in texts.items():
        click.echo(f"set {name} = {shown(name, value_in_si(name, text, units), units)}", err=True)


def check_picture(plot: Path | None) -> None:
    """Raise ExportError for a picture that could not be written."""
    if plot is not None:
        check_ending(plot, PICTURES)


def check_ending(path: Path, endings: tuple[str, ...]) -> None:
    """Raise ExportError for a file that could not be written, before the work is done."""
    if path.suffix not in endings:
        raise ExportError(f"'{path}': its ending must be one of {', '.join(filter(None, endings))}")
    try:
        is_folder = path.is_dir()
    except OSError as error:
        raise ExportError(f"'{str(path)[:60]}...' cannot be written: {error.strerror}; give a shorter name") from error
    if is_folder:
        raise ExportError(f"'{path}': is a folder; name a file")
    if not path.parent.is_dir():
        raise ExportError(f"'{path}': the folder '{path.parent}' does not exist")
