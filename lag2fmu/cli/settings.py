"""The option --set: the mechanism with the values that are set, and the message that shows them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

import click

from lag2fmu.cli.options import STRUCTURAL
from lag2fmu.description.names import generalized_force
from lag2fmu.errors import LoadError
from lag2fmu.formats.loading import pairs_of, read_model, split_settings, values_of, with_settings
from lag2fmu.language.unit_parser import parse_unit
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
    given = read_model(model, structural)
    mechanism = with_settings(given, texts)
    if texts:
        echo_settings(texts, display_units(mechanism))
    for warning in (*_turned_round(given, mechanism), *mechanism.warnings):
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
    known = {*others, *(generalized_force(q.name) for q in mechanism.coordinates)}
    mechanism = with_settings(mechanism, {name: text for name, text in texts.items() if name not in known})
    values = values_of({name: text for name, text in texts.items() if name in known}, units)
    echo_settings(texts, units)
    return mechanism, values, units


def _turned_round(given: Mechanism, mechanism: Mechanism) -> Iterator[str]:
    """Warnings of lengths that are positive in the ``given`` mechanism and negative in the one that was made of it.

    Equations do not mind a negative length, as of a pendulum, which then hangs the other way round.
    """
    length, before = parse_unit("m").dimension, {p.name: p.value for p in given.parameters}
    units = display_units(mechanism)
    for p in mechanism.parameters:
        if p.unit is not None and p.unit.dimension == length and (p.value or 0.0) < 0 < (before.get(p.name) or 0.0):
            value = shown(p.name, p.value or 0.0, units)
            yield f"parameters.{p.name}: {value} is negative; a length is not, but a place may be"


def echo_settings(texts: Mapping[str, str], units: Mapping[str, Unit]) -> None:
    """Show on standard error the values that were set, with their units; raises LoadError for a text without value."""
    for name, text in texts.items():
        click.echo(f"set {name} = {shown(name, value_in_si(name, text, units), units)}", err=True)
