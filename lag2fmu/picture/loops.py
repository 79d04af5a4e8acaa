"""Links read from closed loops: two holonomic constraints are the entries of a closed polygon of arms.

A bar without mass, or the part of a bar beyond its mass centre, is in no position of a body. It is in a pair of
constraints such as l1 cos(a) + l2 cos(b) - d = 0, l1 sin(a) + l2 sin(b) = 0. It begins where the arm of a body with
the same angles begins.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
import sympy as sp

from lag2fmu.description.parts import Constraint
from lag2fmu.graph.nodes import Node
from lag2fmu.picture.arms import ARM, ArmStep, steps
from lag2fmu.picture.skeleton import Skeleton, SkeletonLine

_MEETS = 1e-6
"""Points meet, and lines are parallel, up to this part of the size of the picture."""


def add_loops(skeleton: Skeleton) -> None:
    """Add the arms of planar loops to ``skeleton``, whose constraints are taken in pairs."""
    written = [c for c in skeleton.mechanism.constraints if c.kind == "holonomic"]
    if skeleton.reads and skeleton.mechanism.places and skeleton.mechanism.dimension == 2:
        for first in range(0, len(written) - 1, 2):
            _add_loop(skeleton, written[first : first + 2])


def _add_loop(skeleton: Skeleton, pair: Sequence[Constraint]) -> None:
    """Add every arm of the loop that turns as an arm of a body does."""
    s = skeleton
    turning = [x for x in steps(tuple(s.written(c.expression) for c in pair), s.order) if x.kind == ARM]
    vectors = [s.put.vector(_vector(step)) for step in turning]
    if len(turning) < 2 or not all(s.keep_length(vectors)):
        return
    alike = {link.angles: link for link in reversed(s.links)}
    _add_arms(s, pair, [(alike[x.angles], v) for x, v in zip(turning, vectors, strict=True) if x.angles in alike])


def _add_arms(s: Skeleton, pair: Sequence[Constraint], arms: Sequence[tuple[SkeletonLine, Sequence[Node]]]) -> None:
    """Join the start of each arm with its tip; an arm turns as its link of a body does and has a vector."""
    both = [[_tip(s, link.ends[0], sign, vector) for sign in (1, -1)] for link, vector in arms]
    joints = {i for link in s.links for i in link.ends}
    for number, (link, _) in enumerate(arms):
        others = joints.union(*(tips for k, tips in enumerate(both) if k != number))
        end = _chosen(s, link, both[number], others)
        if end is not None:
            s.join(f"constraints.{pair[0].name}", link.ends[0], end, arm=True, angles=link.angles)


def _vector(step: ArmStep) -> tuple[sp.Expr, ...]:
    return tuple(b - a for a, b in zip(step.start, step.end, strict=True))


def _tip(skeleton: Skeleton, start: int, sign: int, vector: Sequence[Node]) -> int:
    """The spot at start + sign * vector, which has two entries."""
    move = skeleton.graph.add if sign > 0 else skeleton.graph.subtract
    return skeleton.spot([move(x, y) for x, y in zip(skeleton.nodes(start)[:2], vector, strict=True)])


def _chosen(skeleton: Skeleton, link: SkeletonLine, tips: Sequence[int], others: Collection[int]) -> int | None:
    """The tip on the side of the body's ``link`` or, where the arm is not along it, the one at another joint.

    A loop may be written backwards, so that the sign of an arm tells nothing.
    """
    places = skeleton.positions(skeleton.start())
    start, end = (places[i] for i in link.ends)
    along, reach = end - start, places[tips[0]] - start
    size = float(np.linalg.norm(reach))
    if float(np.linalg.norm(np.cross(along, reach))) <= _MEETS * float(np.linalg.norm(along)) * size:
        return tips[0 if float(along @ reach) > 0 else 1]
    meeting = (i for i in tips if any(float(np.linalg.norm(places[i] - places[j])) < _MEETS * size for j in others))
    return next(meeting, None)
