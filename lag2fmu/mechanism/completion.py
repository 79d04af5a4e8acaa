"""From a description to what follows: entries of parts, joints, quaternions and loads are written out, then checked."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from lag2fmu.description.description import Description
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Constraint, Damper, Definition
from lag2fmu.description.places import Frame
from lag2fmu.description.symbols import Coordinate
from lag2fmu.mechanism.assembly import assembled
from lag2fmu.mechanism.check import check
from lag2fmu.mechanism.completed import Completed
from lag2fmu.mechanism.compliance import compliant_contacts
from lag2fmu.mechanism.contact_lengths import skewed_contacts
from lag2fmu.mechanism.energy_check import bent_places, check_energies, cut_angles
from lag2fmu.mechanism.event_check import check_events, check_meaning
from lag2fmu.mechanism.filters import with_filters
from lag2fmu.mechanism.geometry import check_geometry
from lag2fmu.mechanism.joint_equations import written_out
from lag2fmu.mechanism.loads import with_inputs
from lag2fmu.mechanism.merging import joined
from lag2fmu.mechanism.name_check import check_names
from lag2fmu.mechanism.norms import missing_norms
from lag2fmu.mechanism.ports import input_names, with_chosen_inputs, with_ports
from lag2fmu.mechanism.scope import Scope, constrained, fixed_parameters
from lag2fmu.mechanism.unilaterals import check_gaps, check_open, unilaterals

Origins = dict[str, str]
"""{place of an entry that nobody wrote: place of what brings it}, such as {'constraints.hinge_x': 'joints.hinge'}."""


def completed(written: Description) -> Completed:
    """Everything that follows from the description ``written``.

    Raises MechanismError for the first fault, which is a UnitError for dimensions.
    """
    whole, of_parts = assembled(written)
    opened, of_places = _with_places(whole)
    check_geometry(opened)
    check_events(opened)
    pressed, of_contacts = _with_compliance(opened)
    closed, of_joints = _with_joints(pressed)
    of_user = {place for table in _BROUGHT for place in _places(table, getattr(written, table))}
    brought = of_joints.keys() - of_user
    scope, warnings = check(
        closed, {f"constraints.{c.kind}.{c.name}" for c in closed.constraints if f"constraints.{c.name}" in brought}
    )
    expanded, of_norms = _with_norms(closed, whole)
    if of_norms:
        check_names(expanded)
        scope = scope.with_constraints(expanded.constraints)
    expanded = replace(expanded, coordinates=_decided(expanded, scope))
    origins = of_parts | of_places | of_contacts | of_joints | of_norms
    check_meaning(expanded, scope)
    check_energies(expanded)
    found = tuple(unilaterals(expanded))
    check_gaps(expanded, found)
    check_open(expanded, found)
    kept = {place: origin for place, origin in origins.items() if place not in of_user}
    latches = tuple(c for c in expanded.constraints if c.while_ is not None)
    permanent = replace(expanded, constraints=tuple(c for c in expanded.constraints if c.while_ is None))
    fixed = fixed_parameters(permanent, scope, (unilateral.gap for unilateral in found))
    chosen = permanent.ports.inputs
    hidden = frozenset() if chosen is None else frozenset(input_names(permanent)) - frozenset(chosen)
    odd = (*warnings, *cut_angles(expanded), *bent_places(expanded), *_held_guesses(expanded, scope))
    odd += tuple(skewed_contacts(expanded, found))
    return Completed(permanent, kept, odd, found, latches, fixed, hidden)


_BROUGHT = ("coordinates", "inputs", "frames", "definitions", "dampers", "constraints", "outputs")


def _places(table: str, parts: Iterable[Any]) -> list[str]:
    return [f"{table}.{part.name}" for part in parts]


def _with_places(written: Description) -> tuple[Description, Origins]:
    """The description with the entries of filters, ports, loads and joints; outputs know their number of entries."""
    known = {*(q.name for q in written.coordinates), *written.driven}
    written, origins = with_filters(written)
    coordinates: dict[str, Coordinate] = {}
    frames: list[Frame] = []
    for joint in (joint for joint in written.joints if joint.parent is not None):
        brought = {q.name: q for q in joint.own_coordinates() if q.name not in known}
        coordinates |= brought
        frames.append(joint.frame)
        of_joint = [*_places("coordinates", brought.values()), f"frames.{joint.name}"]
        origins |= dict.fromkeys(of_joint, f"joints.{joint.name}")
    standing = replace(
        written,
        coordinates=(*written.coordinates, *coordinates.values()),
        frames=joined(written.frames, frames, "frames"),
    )
    ported, of_ports = with_ports(standing)
    loads, inputs = with_inputs(ported)
    origins |= of_ports | {f"inputs.{item.name}": f"loads.{load}" for load, item in inputs}
    sizes = {place.name: place.dimension for place in ported.places}
    opened = replace(
        ported,
        inputs=(*ported.inputs, *(item for _, item in inputs)),
        loads=tuple(loads),
        outputs=tuple(replace(o, dimension=sizes.get(str(o.point), ported.dimension)) for o in ported.outputs),
    )
    return with_chosen_inputs(opened, origins), origins


def _with_compliance(opened: Description) -> tuple[Description, Origins]:
    """The description with the entries of compliant contacts: definitions, dampers and outputs."""
    definitions: list[Definition] = []
    dampers: list[Damper] = []
    outputs: list[Output] = []
    origins: Origins = {}
    for found in compliant_contacts(opened):
        definitions += found.definitions
        dampers += found.dampers
        outputs += found.outputs
        of_contact = [*_places("definitions", found.definitions), *_places("dampers", found.dampers)]
        of_contact += _places("outputs", found.outputs)
        origins |= dict.fromkeys(of_contact, f"contacts.{found.contact.name}")
    pressed = replace(
        opened,
        definitions=joined(opened.definitions, definitions, "definitions", by="contact"),
        dampers=joined(opened.dampers, dampers, "dampers", by="contact"),
        outputs=joined(opened.outputs, outputs, "outputs", by="contact"),
    )
    return pressed, origins


def _with_joints(opened: Description) -> tuple[Description, Origins]:
    """The description with the entries of joints between two ends: constraints and outputs."""
    constraints: list[Constraint] = []
    reactions: list[Output] = []
    origins: Origins = {}
    for joint, equations, outputs in written_out(opened):
        constraints += equations
        reactions += outputs
        of_joint = [*_places("constraints", equations), *_places("outputs", outputs)]
        origins |= dict.fromkeys(of_joint, f"joints.{joint.name}")
    closed = replace(
        opened,
        constraints=joined(opened.constraints, constraints, "constraints"),
        outputs=joined(opened.outputs, reactions, "outputs"),
    )
    return closed, origins


def _with_norms(closed: Description, written: Description) -> tuple[Description, Origins]:
    """The description with constraints on the norms of quaternions that no constraint keeps yet.

    These constraints stand between the written ones and those of joints.
    """
    norms = list(missing_norms(closed))
    of_user = {c.name for c in written.constraints}
    own = [c for c in closed.constraints if c.name in of_user]
    of_joints = [c for c in closed.constraints if c.name not in of_user]
    origins = {f"constraints.{norm.name}": f"frames.{frame}.quaternion" for frame, norm in norms}
    return replace(closed, constraints=(*own, *(norm for _, norm in norms), *of_joints)), origins


def _decided(m: Description, scope: Scope) -> tuple[Coordinate, ...]:
    """The coordinates; a start that nobody gave has become a guess where a constraint may determine it."""
    q_bound, qd_bound = constrained(m, scope)
    return tuple(
        replace(
            q,
            given=False if q.given is None and q.name in q_bound else q.given,
            velocity_given=False if q.velocity_given is None and q.name in qd_bound else q.velocity_given,
        )
        for q in m.coordinates
    )


def _held_guesses(m: Description, scope: Scope) -> Iterator[str]:
    """Warnings of guesses that no constraint improves: latches, which alone contain them, hold what they find."""
    bound, _ = constrained(m, scope)
    latches = {
        c.name: scope.names_in(f"constraints.{c.kind}.{c.name}", c.expression)
        for c in m.constraints
        if c.holonomic and c.while_ is not None
    }
    for q in m.coordinates:
        holders = [name for name, used in latches.items() if q.name in used]
        if q.given is False and q.name not in bound and holders:
            yield (
                f"coordinates.{q.name}: its guess is its start, since {holders[0]}, which holds at times only, holds "
                "its expression at the value where it catches; write 'start'"
            )
