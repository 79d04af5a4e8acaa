"""What --set gave: the mechanism that has it, and what is said of it."""

from __future__ import annotations

from collections.abc import Mapping

import click

from lag2fmu.cli.options import STRUCTURAL
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import load, pairs_of, split_settings, with_settings
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units, shown, value_in_si
from lag2fmu.mechanism.record import Mechanism


def load_mechanism(model: str, settings: tuple[str, ...]) -> Mechanism:
    """The mechanism ``model`` with what --set gave; that and its warnings go to standard error. Raises Lag2FmuError."""
    chosen = click.get_current_context().meta.get(STRUCTURAL, ())
    structural, texts = split_settings(model, (*settings, *chosen))
    for name in pairs_of(chosen):
        if name not in structural:
            raise LoadError(f"--{name} is for robots in files (.urdf, .xml); '{model}' is none")
    mechanism = with_settings(load(model, structural), texts)
    echo_settings(texts, display_units(mechanism))
    for warning in mechanism.warnings:
        click.echo(f"warning: {warning}", err=True)
    return mechanism


def echo_settings(texts: Mapping[str, str], units: Mapping[str, Unit]) -> None:
    """Say on standard error what was set, with the unit in which it was read. Raises LoadError for what is no value."""
    for name, text in texts.items():
        click.echo(f"set {name} = {shown(name, value_in_si(name, text, units), units)}", err=True)
