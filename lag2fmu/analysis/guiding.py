"""Places as motions: points, bodies and outputs of positions that inputs guide, as constraints.

A guide is a constraint, place(q) = y, with the prescribed motion y. Its multiplier is the force that holds the place on
its path, and its reaction on the coordinates, G^T multiplier, are the generalized forces that do the same.
Source: J. J. Craig, Introduction to Robotics, 3rd edition, section 5.9 (forces at a hand and torques at joints).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lag2fmu.analysis.evaluation import operating_inputs
from lag2fmu.description.description import Description
from lag2fmu.description.joints import Joint
from lag2fmu.description.outputs import Output
from lag2fmu.description.parts import Constraint
from lag2fmu.description.places import Point
from lag2fmu.description.symbols import Input
from lag2fmu.dynamics.derivation import derive
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError
from lag2fmu.graph.batches import evaluate
from lag2fmu.language.unit_parser import parse_unit
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.assembly import assembled
from lag2fmu.mechanism.record import Mechanism, complete

GUIDE = "_guide"
"""What stands behind the name of a place in that of its guide."""


@dataclass(frozen=True)
class Guides:
    """The ``motions`` (unit, start, no kind yet) of guided places, and what holds the places on them."""

    motions: tuple[Input, ...]
    joints: tuple[Joint, ...]
    points: tuple[Point, ...]
    constraints: tuple[Constraint, ...]

    def added(self, d: Description, motions: Sequence[Input]) -> Description:
        """``d`` with the guides and their ``motions`` as inputs, which take the place of outputs of their names."""
        taken = {u.name for u in self.motions}
        return replace(
            d,
            inputs=(*d.inputs, *motions),
            joints=(*d.joints, *self.joints),
            points=(*d.points, *self.points),
            constraints=(*d.constraints, *self.constraints),
            outputs=tuple(o for o in d.outputs if taken.isdisjoint(o.names)),
            coordinates=tuple(replace(q, given=False, velocity_given=False) for q in d.coordinates),
        )


def guidable(mechanism: Mechanism) -> tuple[str, ...]:
    """The names of the points, bodies and outputs that may be guided; an output has to be an expression."""
    d = assembled(mechanism.description)[0]
    shown = (o.name for o in d.outputs if o.expression is not None)
    return tuple(dict.fromkeys((*(p.name for p in (*d.points, *d.placed_bodies)), *shown)))


def guides(mechanism: Mechanism, places: Sequence[str]) -> Guides:
    """What guides the ``places`` of ``mechanism``, names of ``guidable``; motions start where the places start.

    The motions of a point or body NAME are NAME_x, NAME_y and in space NAME_z, that of an output has its name. Raises
    DerivationError for places that no coordinate moves, and for mechanisms with modes, Lag2FmuError as ``derive`` does.
    """
    if mechanism.hybrid:
        raise DerivationError(
            f"mechanism '{mechanism.name}' has contacts, stops, dry friction or switches, and its places cannot be "
            "guided; prescribe coordinates, or leave out what may be, by --without friction, stops, contacts"
        )
    d = assembled(mechanism.description)[0]
    points = {place.name for place in (*d.points, *d.placed_bodies)}
    outputs = {o.name: o for o in d.outputs}
    probes = [Output(x, point=x, quantity="position") if x in points else outputs[x] for x in places]
    equations = derive(complete(replace(d, outputs=tuple(probes))))
    values, found = operating_inputs(equations), Guides((), (), (), ())
    _check_movable(equations)
    for name, probe in zip(places, equations.mechanism.outputs, strict=True):
        starts = evaluate(equations.graph, [equations.outputs[entry] for entry in probe.names], values)
        unit = parse_unit(probe.unit) if isinstance(probe.unit, str) else probe.unit
        what = f"{probe.doc or f'place of {name}'}, guided"
        motions = [Input(x, unit, float(at), True, doc=what) for x, at in zip(probe.names, starts, strict=True)]
        found = _with(found, name, motions, None if name in points else outputs[name])
    return found


def _check_movable(equations: EquationsOfMotion) -> None:
    """Raise DerivationError for outputs that no coordinate moves."""
    g, moving = equations.graph, {q.name for q in equations.mechanism.coordinates}
    still = [name for name, node in equations.outputs.items() if g.symbols([node]).isdisjoint(moving)]
    if still:
        raise DerivationError(
            f"mechanism '{equations.mechanism.name}': no coordinate moves {', '.join(still)}, so nothing can guide it "
            "there; prescribe coordinates, or an output that moves"
        )


def _with(found: Guides, name: str, motions: Sequence[Input], output: Output | None) -> Guides:
    """``found`` with the guide of a place along its ``motions``, or of an ``output`` along its only one."""
    guide, moved = f"{name}{GUIDE}", (*found.motions, *motions)
    if output is not None:
        row = Constraint(guide, output.expression - symbol(motions[0].name))
        return replace(found, motions=moved, constraints=(*found.constraints, row))
    target = Point(guide, tuple(symbol(u.name) for u in motions))
    joint = Joint(f"{name}_held", "spherical" if len(motions) == 3 else "revolute", between=(guide, name))
    return replace(found, motions=moved, joints=(*found.joints, joint), points=(*found.points, target))
