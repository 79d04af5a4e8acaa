"""Loads that are inputs of the FMU themselves, written out: the inputs, and the load that refers to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lag2fmu.description.parts import Load
from lag2fmu.description.places import AXES, Place
from lag2fmu.description.record import Description
from lag2fmu.description.symbols import Input
from lag2fmu.errors import MechanismError
from lag2fmu.language.units import NEWTON, TORQUE
from lag2fmu.language.vocabulary import symbol


def with_inputs(m: Description) -> tuple[list[Load], list[tuple[str, Input]]]:
    """The loads of ``m``, those with ``input=True`` written out, and (load, input) for every input in N or N.m.

    Raises MechanismError for one that has a value as well.
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
    """The ``load``, which is an input itself, with the inputs that it refers to, in N or N.m; ``places`` by name.

    ``what`` it is says their doc, by default that of a load.

    Raises MechanismError for one that has a value as well.
    """
    own = _inputs_of(load, places, what)
    entries = [symbol(item.name) for item in own]
    value = entries[0] if [item.name for item in own] == [load.name] else entries
    key = "force" if load.point is not None else "torque"
    return replace(load, input=False, **{key: value}), own  # type: ignore[arg-type]


def _inputs_of(load: Load, places: Mapping[str, Place], what: str) -> list[Input]:
    """An input for each entry of the force or torque: NAME for a planar torque, else NAME_x, ...; N or N.m."""
    if load.force is not None or load.torque is not None:
        raise MechanismError(f"loads.{load.name}: 'input' and a value exclude each other; leave one out")
    is_force = load.point is not None
    name = str(load.point if is_force else load.body)
    place = places.get(name)
    if not is_force and (place is None or place.frame is None):
        return [Input(load.name, TORQUE, doc=f"torque on {name}")]
    what = what or (f"force '{load.name}' at {name}" if is_force else f"torque on {name}")
    of_frame = " of its frame" if load.axes == "frame" else ""
    return [
        Input(f"{load.name}_{axis}", NEWTON if is_force else TORQUE, doc=f"{what}, along {axis}{of_frame}")
        for axis in AXES[: 2 if place is None else place.dimension]
    ]


def rigid_place(m: Description, name: str, where: str) -> Place:
    """The body or point ``name``, which has an angle or a frame, so that a torque can act on what it is fixed to.

    Raises MechanismError with ``where`` if there is none.
    """
    place = next((part for part in (*m.bodies, *m.points) if part.name == name), None)
    if place is None:
        try:
            m.location(name)  # of an unknown name it tells which there are
        except MechanismError as error:
            raise MechanismError(f"{where}: {error}") from None
    if place is None or (place.angle is None and place.frame is None):
        raise MechanismError(
            f"{where}: '{name}' is not a rigid body with an angle or a frame, nor a point of one, so no torque acts on "
            "it; give it an angle and an inertia, put it on a frame, or let a force act"
        )
    return place
