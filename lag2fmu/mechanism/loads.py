"""Loads with ``input = true``, whose force or torque comes from outside: written out as inputs and a load of these."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.parts import Load
from lag2fmu.description.places import AXES, Place
from lag2fmu.description.symbols import Input
from lag2fmu.errors import MechanismError
from lag2fmu.language.units import NEWTON, TORQUE, Unit
from lag2fmu.language.vocabulary import symbol


def with_inputs(m: Description) -> tuple[list[Load], list[tuple[str, Input]]]:
    """The loads of ``m``, those with ``input=True`` written out, and (load, input) for every input in N or N.m.

    Raises MechanismError for a load that has a value as well.
    """
    written: list[Load] = []
    inputs: list[tuple[str, Input]] = []
    places = {place.name: place for place in m.places}
    for load in m.loads:
        load_written, own = opened(load, places) if load.input else (load, [])
        written.append(load_written)
        inputs += [(load.name, item) for item in own]
    return written, inputs


def opened(load: Load, places: Mapping[str, Place], what: str = "") -> tuple[Load, list[Input]]:
    """The ``load``, which has ``input=True``, written out, and its inputs, in N or N.m; ``places`` are by name.

    The doc of the inputs says ``what`` they are, by default a force or torque. Raises MechanismError for a load that
    has a value as well.
    """
    if load.force is not None or load.torque is not None:
        raise MechanismError(f"loads.{load.name}: 'input' and a value exclude each other; leave one out")
    written = replace(load, input=False)
    if load.point is not None:
        place = places.get(str(load.point))
        axes = AXES[: 2 if place is None else place.dimension]
        own = _along(load, axes, NEWTON, what or f"force '{load.name}' at {load.point}")
        return replace(written, force=_entries(own)), own
    place, what = places.get(str(load.body)), what or f"torque on {load.body}"
    if place is None or place.frame is None:
        return replace(written, torque=symbol(load.name)), [Input(load.name, TORQUE, doc=what)]
    own = _along(load, AXES, TORQUE, what)
    return replace(written, torque=_entries(own)), own


def _along(load: Load, axes: Iterable[str], unit: Unit, what: str) -> list[Input]:
    """An input NAME_x, ... for each entry of a force or torque."""
    of_frame = " of its frame" if load.axes == "frame" else ""
    return [Input(f"{load.name}_{axis}", unit, doc=f"{what}, along {axis}{of_frame}") for axis in axes]


def _entries(inputs: Iterable[Input]) -> tuple[sp.Symbol, ...]:
    return tuple(symbol(item.name) for item in inputs)


def rigid_place(m: Description, name: str, where: str) -> Place:
    """The body or point ``name``, which must have an angle or a frame, so that a torque can act there.

    Raises MechanismError with ``where`` if there is no such body or point.
    """
    place = next((part for part in (*m.bodies, *m.points) if part.name == name), None)
    if place is None:
        try:
            m.location(name)  # raises, for an unknown name, with the names that are known
        except MechanismError as error:
            raise MechanismError(f"{where}: {error}") from None
    if place is None or (place.angle is None and place.frame is None):
        raise MechanismError(
            f"{where}: '{name}' is not a rigid body with an angle or a frame, nor a point of one, so no torque acts on "
            "it; give it an angle and an inertia, put it on a frame, or let a force act"
        )
    return place
