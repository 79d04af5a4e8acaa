"""What follows from a description: everything that joints, quaternions and loads bring is written out, then checked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

from lag2fmu.description.joints import joined
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Constraint
from lag2fmu.description.record import Description
from lag2fmu.description.symbols import Coordinate
from lag2fmu.mechanism.check import check
from lag2fmu.mechanism.geometry import check_geometry
from lag2fmu.mechanism.joint_equations import written_out
from lag2fmu.mechanism.loads import with_inputs
from lag2fmu.mechanism.name_check import check_names
from lag2fmu.mechanism.norms import missing_norms
from lag2fmu.mechanism.scope import Scope, constrained

Origins = dict[str, str]
"""Place of a part that is not written -> place of what brings it: {'constraints.hinge_x': 'joints.hinge'}."""


class Completed(NamedTuple):
    """A description with everything written out, where that comes from, its scope, and what was let pass."""

    expanded: Description
    origins: Origins
    scope: Scope
    warnings: tuple[str, ...]


def completed(written: Description) -> Completed:
    """What follows from what is ``written``. Raises MechanismError (UnitError) for the first fault."""
    origins: Origins = {}
    closed = _with_joints(_with_places(written, origins), origins)
    scope, warnings = check(closed)
    expanded = _with_norms(closed, written, origins)
    if expanded is not closed:
        check_names(expanded)
        scope = scope.with_constraints(expanded.constraints)
    expanded = replace(expanded, coordinates=_decided(expanded, scope))
    of_user = {f"{table}.{part.name}" for table in _BROUGHT for part in getattr(written, table)}
    return Completed(expanded, {k: origin for k, origin in origins.items() if k not in of_user}, scope, warnings)


_BROUGHT = ("coordinates", "inputs", "frames", "constraints", "outputs")


def _with_places(written: Description, origins: Origins) -> Description:
    """What loads and joints on a parent bring, outputs with their number of entries; places have been checked then."""
    loads, inputs = with_inputs(written)
    origins |= {f"inputs.{item.name}": f"loads.{load}" for load, item in inputs}
    known = {q.name for q in written.coordinates}
    coordinates: dict[str, Coordinate] = {}
    for joint in written.joints:
        brought = {q.name: q for q in joint.own_coordinates() if q.name not in known}
        coordinates |= brought
        origins |= {f"coordinates.{name}": f"joints.{joint.name}" for name in brought}
    carried = [joint.frame for joint in written.joints if joint.parent is not None]
    origins |= {f"frames.{frame.name}": f"joints.{frame.name}" for frame in carried}
    sizes = {place.name: place.dimension for place in written.places}
    opened = replace(
        written,
        coordinates=(*written.coordinates, *coordinates.values()),
        inputs=(*written.inputs, *(item for _, item in inputs)),
        frames=joined(written.frames, carried, "frames"),
        loads=tuple(loads),
        outputs=tuple(replace(o, dimension=sizes.get(str(o.point), 3)) for o in written.outputs),
    )
    check_geometry(opened)
    return opened


def _with_joints(opened: Description, origins: Origins) -> Description:
    """What joints between two ends bring."""
    constraints: list[Constraint] = []
    reactions: list[Output] = []
    for joint, equations, outputs in written_out(opened):
        constraints += equations
        reactions += outputs
        of_joint = [*_places("constraints", equations), *_places("outputs", outputs)]
        origins |= dict.fromkeys(of_joint, f"joints.{joint.name}")
    return replace(
        opened,
        constraints=joined(opened.constraints, constraints, "constraints"),
        outputs=joined(opened.outputs, reactions, "outputs"),
    )


def _with_norms(closed: Description, written: Description, origins: Origins) -> Description:
    """The norms of quaternions that no constraint keeps yet; they stand between those that are written and joints'."""
    norms = list(missing_norms(closed))
    if not norms:
        return closed
    of_user = {c.name for c in written.constraints}
    own = [c for c in closed.constraints if c.name in of_user]
    of_joints = [c for c in closed.constraints if c.name not in of_user]
    origins |= {f"constraints.{norm.name}": f"frames.{frame}.quaternion" for frame, norm in norms}
    return replace(closed, constraints=(*own, *(norm for _, norm in norms), *of_joints))


def _places(table: str, parts: Iterable[Constraint | Output]) -> list[str]:
    return [f"{table}.{part.name}" for part in parts]


def _decided(m: Description, scope: Scope) -> tuple[Coordinate, ...]:
    """The coordinates; starts that nobody gave are guesses where a constraint may determine them."""
    q_bound, qd_bound = constrained(m, scope)
    return tuple(
        replace(
            q,
            given=False if q.given is None and q.name in q_bound else q.given,
            velocity_given=False if q.velocity_given is None and q.name in qd_bound else q.velocity_given,
        )
        for q in m.coordinates
    )
