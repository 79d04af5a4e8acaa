"""Ports, written out: loads with their inputs, points at the origins of frames, outputs of places."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from lag2fmu.description import names
from lag2fmu.description.description import Description
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Load
from lag2fmu.description.places import WORLD, Body, Frame, Place, Point
from lag2fmu.description.symbols import Input, names_of
from lag2fmu.errors import MechanismError
from lag2fmu.language.identifiers import suggestion
from lag2fmu.mechanism.drives import check_drives
from lag2fmu.mechanism.loads import opened, rigid_place
from lag2fmu.mechanism.merging import joined

Origins = dict[str, str]

MOTION = {"poses": "position", "velocities": "velocity", "accelerations": "acceleration"}
TURNING = {"poses": "angle", "velocities": "angular_velocity", "accelerations": "angular_acceleration"}
"""{field of the ports: quantity of a point, or of a place that turns}."""


class Site(NamedTuple):
    """Where a port is: the ``place`` at which forces act, and its ``frame``, which is None in the plane and the world.

    ``added``: a new point at the origin of a frame, None if the mechanism has a place there.
    """

    name: str
    place: Place
    frame: str | None
    added: Point | None = None


def with_ports(m: Description) -> tuple[Description, Origins]:
    """``m`` with the loads, inputs, points and outputs of its ports, and {place of such an entry: its port}.

    If an input of the same name is declared, it is used instead of a new one. Raises MechanismError for an unknown
    place, a torque on a place that cannot turn, and axes of a frame where there is none.
    """
    listed = m.ports.listed()
    sites = {spot: _site(m, spot, f"ports.{field}") for field, spots in listed.items() for spot in spots}
    if not sites:
        return m, {}
    points = {site.added.name: site.added for site in sites.values() if site.added is not None}
    m = replace(m, points=joined(m.points, points.values(), "points", by="port"))
    loads, inputs, origins = _forces(m, sites)
    outputs = list(_outputs(m, sites))
    origins |= dict.fromkeys((f"points.{name}" for name in points), "ports")
    origins |= {f"outputs.{output.name}": "ports" for output in outputs}
    found = replace(
        m,
        inputs=(*m.inputs, *inputs),
        loads=joined(m.loads, loads, "loads", by="port"),
        outputs=joined(m.outputs, outputs, "outputs", by="port"),
    )
    return found, origins


def _forces(m: Description, sites: Mapping[str, Site]) -> tuple[list[Load], list[Input], Origins]:
    """The loads of the ports, their inputs that are not declared yet, and {place: port} of both."""
    places, declared = {place.name: place for place in (*m.places, *m.bodies)}, {u.name for u in m.inputs}
    loads: list[Load] = []
    inputs: list[Input] = []
    origins: Origins = {}
    for field, load in _loads(m, sites):
        spot = sites[field.partition(".")[2]].name
        what = f"force at {spot}" if load.point is not None else f"torque on {spot}"
        written, own = opened(load, places, what)
        new = [item for item in own if item.name not in declared]
        loads.append(written)
        inputs += new
        origins |= {f"loads.{load.name}": f"ports.{field}"} | {f"inputs.{x.name}": f"ports.{field}" for x in new}
    return loads, inputs, origins


def input_names(m: Description) -> tuple[str, ...]:
    """The names of the inputs as in the vector u: Q of every coordinate, plain inputs, motions with derivatives."""
    forces = (names.generalized_force(q.name) for q in m.coordinates)
    return (*forces, *(name for u in (*m.plain_inputs, *m.motions) for name in names_of(u)))


def with_chosen_inputs(m: Description, origins: Origins) -> Description:
    """``m`` with its choice of inputs written as names of variables; inputs of ports are always among them.

    The name of a motion stands for its derivatives too, that of a load for all of its inputs. Raises MechanismError for
    a name that is no input, and for a drive of a name that is no prescribed motion.
    """
    check_drives(m)
    if m.ports.inputs is None:
        return m
    known = {x: (x,) for x in input_names(m)} | {u.name: names_of(u) for u in m.inputs}
    known |= {name: (names.target(name),) for name in m.filtered}
    for place, origin in origins.items():
        table, _, name = place.partition(".")
        if table == "inputs" and origin.startswith("loads."):
            load = origin.removeprefix("loads.")
            known[load] = (*known.get(load, ()), *known[name])
    chosen: list[str] = [u.name for u in m.inputs if origins.get(f"inputs.{u.name}", "").startswith("ports.")]
    for name in m.ports.inputs:
        if name not in known:
            raise MechanismError(f"ports.inputs: there is no input '{name}'; {suggestion(name, known)}")
        chosen += known[name]
    return replace(m, ports=replace(m.ports, inputs=tuple(dict.fromkeys(chosen))))


def _site(m: Description, spot: str, where: str) -> Site:
    """The point, body or frame ``spot``; raises MechanismError with ``where`` if there is none, or more than one."""
    table, _, name = spot.rpartition(".")
    every: dict[str, tuple[Body | Point | Frame, ...]] = {"bodies": m.bodies, "points": m.points, "frames": m.frames}
    found = {of: part for of, parts in every.items() for part in parts if part.name == name and table in ("", of)}
    if len(found) > 1:
        both = " or ".join(f"'{kind}.{name}'" for kind in found)
        raise MechanismError(f"{where}: '{name}' is the name of two places; write {both}")
    if not found:
        known = [part.name for parts in every.values() for part in parts]
        raise MechanismError(f"{where}: there is no point, body or frame '{spot}'; {suggestion(spot, known)}")
    (place,) = found.values()
    if isinstance(place, Frame):
        place = origin = Point(f"{name}_origin", (0, 0, 0), frame=name)
        return Site(name, place, name, origin)
    return Site(name, place, None if place.frame in (None, WORLD) else str(place.frame))


def _loads(m: Description, sites: Mapping[str, Site]) -> Iterator[tuple[str, Load]]:
    """(place of the port, load) for each force and torque; raises MechanismError for one that cannot act there."""
    for spot, axes in m.ports.acting("forces"):
        site, where = sites[spot], f"forces.{spot}"
        _check_placed(site, where)
        _check_axes(site, axes, where)
        yield where, Load(f"{site.name}_force", point=site.place.name, input=True, axes=axes)
    for spot, axes in m.ports.acting("torques"):
        site, where = sites[spot], f"torques.{spot}"
        rigid_place(m, site.place.name, f"ports.{where}")
        _check_axes(site, axes, where)
        yield where, Load(f"{site.name}_torque", body=site.place.name, input=True, axes=axes)


def _check_axes(site: Site, axes: str, where: str) -> None:
    if axes != WORLD and site.frame is None:
        raise MechanismError(f"ports.{where}: '{site.name}' has no frame to take the axes of; give 'world'")


def _check_placed(site: Site, where: str) -> None:
    if site.place.position is None and site.place.frame is None:
        raise MechanismError(f"ports.{where}: '{site.name}' only turns and is at no place; let a torque act on it")


def _outputs(m: Description, sites: Mapping[str, Site]) -> Iterator[Output]:
    """The outputs of the places whose motion is an output of the FMU."""
    for field, quantity in MOTION.items():
        for spot in getattr(m.ports, field):
            site = sites[spot]
            if site.place.position is not None or site.place.frame is not None:
                yield _output(site, quantity, point=site.place.name)
            turning = TURNING[field]
            if site.frame is not None:
                yield _output(site, m.ports.rotation if field == "poses" else turning, frame=site.frame)
            elif site.place.angle is not None:
                yield _output(site, turning, point=site.place.name)


def _output(site: Site, quantity: str, **of: str) -> Output:
    doc = f"{quantity.replace('_', ' ')} of {site.name}"
    return Output(f"{site.name}_{quantity}", doc=doc, quantity=quantity, **of)  # type: ignore[arg-type]
