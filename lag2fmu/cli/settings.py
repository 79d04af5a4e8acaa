"""The option --set: the mechanism with the values that are set, and the message that shows them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import click

from lag2fmu.cli.options import STRUCTURAL
from lag2fmu.description.names import generalized_force
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import pairs_of, read_model, split_settings, values_of, with_settings
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units, shown, value_in_si
from lag2fmu.mechanism.record import Mechanism


def load_mechanism(model: str, settings: tuple[str, ...]) -> Mechanism:
    """The mechanism ``model`` with the ``settings`` NAME=VALUE; they and all warnings are shown on standard error.

    Raises LoadError for a model or setting that does not exist, MechanismError for one that is wrong.
    """
    chosen = click.get_current_context().meta.get(STRUCTURAL, ())
    structural, texts = split_settings(model, (*settings, *chosen))
    for name in pairs_of(chosen):
        if name not in structural:
            raise LoadError(f"--{name} is for robots in files (.urdf, .xml); '{model}' is none")
    mechanism = with_settings(read_model(model, structural), texts)
    if texts:
        echo_settings(texts, display_units(mechanism))
    for warning in mechanism.warnings:
        click.echo(f"warning: {warning}", err=True)
    return mechanism


def load_with_inputs(
    model: str, settings: Sequence[str], others: Collection[str] = ()
) -> tuple[Mechanism, dict[str, float], dict[str, Unit]]:
    """(mechanism, values (SI) of generalized forces and of ``others`` in ``settings``, units in which it is shown).

    Forces and ``others`` are variables of an FMU which the mechanism does not have. Raises as ``load_mechanism``.
    """
    apart = [x for x in settings if x.startswith(generalized_force("")) or x.partition("=")[0].strip() in others]
    mechanism = load_mechanism(model, tuple(item for item in settings if item not in apart))
    texts, units = pairs_of(apart), display_units(mechanism)
    echo_settings(texts, units)
    known = {*others, *(generalized_force(q.name) for q in mechanism.coordinates)}
    mechanism = with_settings(mechanism, {name: text for name, text in texts.items() if name not in known})
    return mechanism, values_of({name: text for name, text in texts.items() if name in known}, units), units


def echo_settings(texts: Mapping[str, str], units: Mapping[str, Unit]) -> None:
    """Show on standard error the values that were set, with their units; raises LoadError for a text without value."""
    for name, text in texts.items():
        click.echo(f"set {name} = {shown(name, value_in_si(name, text, units), units)}", err=True)
