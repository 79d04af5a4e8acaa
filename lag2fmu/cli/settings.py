"""The option --set: the mechanism with the values that are set, and the message that shows them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import click

from lag2fmu.cli.options import STRUCTURAL
from lag2fmu.description.names import generalized_force, velocity
from lag2fmu.errors import Lag2FmuError, LoadError
from lag2fmu.formats.loading import pairs_of, read_model, split_settings, values_of, with_settings
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units, shown, turned_round, value_in_si
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
    set_here = values_of(texts, display_units(mechanism))
    for warning in (*turned_round(given, set_here), *_moved(mechanism, set_here), *mechanism.warnings):
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


def _moved(mechanism: Mechanism, values: Mapping[str, float]) -> list[str]:
    """A sentence on guesses among the ``values`` (SI) of ``mechanism`` that its constraints move."""
    guesses = {q.name for q in mechanism.coordinates if q.given is False}
    guesses |= {velocity(q.name) for q in mechanism.coordinates if q.velocity_given is False}
    if guesses.isdisjoint(values):
        return []
    from lag2fmu.dynamics.lagrange import derive
    from lag2fmu.verify.remarks import moved_guesses

    try:
        reached = derive(mechanism).mechanism.coordinates
    except Lag2FmuError:  # the verb itself tells of it, if it needs the equations
        return []
    start = {q.name: q.start for q in reached} | {velocity(q.name): q.velocity for q in reached}
    return moved_guesses(guesses, values, start)


def echo_settings(texts: Mapping[str, str], units: Mapping[str, Unit]) -> None:
    """Show on standard error the values that were set, with their units; raises LoadError for a text without value."""
    for name, text in texts.items():
        click.echo(f"set {name} = {shown(name, value_in_si(name, text, units), units)}", err=True)
