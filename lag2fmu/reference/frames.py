"""Poses and velocities of frames, composed one after the other along their parents; nothing here is differentiated.

R is the rotation matrix of a frame (r_world = x + R r), o its origin in the parent's axes. The frame is turned by
angles a_k about axes u_k; each axis is given in the axes R_k that the turns before it have reached. Then

    x = x_p + R_p o,   v = v_p + w_p x R_p o + R_p o_dot,   R_k+1 = R_k R(u_k, a_k),   w_k+1 = w_k + a_k_dot R_k u_k,

and for a unit quaternion w = w_p + 2 R_p (e0 e_dot - e0_dot e + e x e_dot). The algebra is + - * of NumPy arrays. Their
entries are real, complex (for the complex step), or SymPy expressions. Vectors are (3, *shape), matrices (3, 3,
*shape). Source: J. Wittenburg, Dynamics of Multibody Systems, 2nd edition, sections 2.1-2.6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from lag2fmu.description.places import AXES, WORLD, Frame
from lag2fmu.reference.functions import STEP, Array, Slots, atan2, unit_vector

_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
"""For each axis x, y, z the two others: the next one and the one before, in the cycle x, y, z."""


@dataclass(frozen=True)
class FramePose:
    """Where a frame is and how it moves, in world axes: R (3, 3), x (m), v (m/s), w (rad/s), each (3,)."""

    R: Array
    x: Array
    v: Array
    w: Array


@dataclass(frozen=True)
class Turn:
    """A turn about an axis: 0, 1, 2, or the slice of a unit vector; ``values``: cos and sin of the angle, its rate."""

    axis: int | slice
    values: slice


@dataclass(frozen=True)
class Link:
    """A frame on its parent: slices of the values that place it.

    ``origin``: o (3,), in m, and o_dot (3,), in m/s; ``quaternion``, if there is one: e (4,) and e_dot (4,).
    """

    name: str
    parent: str
    origin: slice
    turns: tuple[Turn, ...]
    quaternion: slice | None


@dataclass(frozen=True)
class Spot:
    """A point that is fixed to a frame or moves in it.

    ``values``: the slice of its position (3,), in m, in the frame's axes, and of the rate of this position, in m/s.
    """

    frame: str
    values: slice

    def motion(self, poses: dict[str, FramePose], values: Array) -> tuple[Array, Array]:
        """Position (m) and velocity (m/s) in world axes, (3, *shape) each."""
        pose, here = poses[self.frame], values[self.values]
        arm = apply(pose.R, here[:3])
        return pose.x + arm, pose.v + cross(pose.w, arm) + apply(pose.R, here[3:])


def links_of(frames: Iterable[Frame], slots: Slots) -> list[Link]:
    """The ``frames`` as links, parents first; their local expressions are added to ``slots``."""
    return [_link(frame, slots) for frame in _parents_first(frames)]


def spot_of(frame: str, position: Iterable[sp.Expr | int | float], slots: Slots) -> Spot:
    """The ``position`` (3,), in m, in the axes of ``frame``; its local expressions are added to ``slots``."""
    here = [slots.written(x) for x in position]
    return Spot(frame, slots.add([*here, *map(slots.rate, here)]))


def poses_of(links: Sequence[Link], values: Array) -> dict[str, FramePose]:
    """The poses of all frames and of the world for the ``values`` (slots, *shape) of the slots, in SI units.

    Source: J. Wittenburg, Dynamics of Multibody Systems, 2nd edition, sections 2.1-2.6.
    """
    one = np.zeros((3, 3, *values.shape[1:]), values.dtype)
    one[range(3), range(3)] = 1
    zero = np.zeros_like(one[0])
    poses = {WORLD: FramePose(one, zero, zero, zero)}
    for link in links:
        parent, origin = poses[link.parent], values[link.origin]
        arm = apply(parent.R, origin[:3])
        x, v = parent.x + arm, parent.v + cross(parent.w, arm) + apply(parent.R, origin[3:])
        R, w = parent.R, parent.w
        for turn in link.turns:
            axis = turn.axis if isinstance(turn.axis, int) else values[turn.axis]
            R, w = _turned(R, w, axis, values[turn.values])
        if link.quaternion is not None:
            R, w = _by_quaternion(R, w, values[link.quaternion])
        poses[link.name] = FramePose(R, x, v, w)
    return poses


def apply(matrix: Array, vector: Array) -> Array:
    """matrix . vector, (3, *shape): a ``vector`` in the frame's axes becomes one in world axes."""
    product: Array = (matrix * vector[None]).sum(axis=1)
    return product


def apply_transposed(matrix: Array, vector: Array) -> Array:
    """vector . matrix, (3, *shape): a ``vector`` in world axes becomes one in the frame's axes."""
    product: Array = (matrix * vector[:, None]).sum(axis=0)
    return product


def dot(a: Array, b: Array) -> Array:
    """a . b, (*shape)."""
    product: Array = (a * b).sum(axis=0)
    return product


def cross(a: Array, b: Array) -> Array:
    """a x b, (3, *shape)."""
    product: Array = a[_NEXT] * b[_LAST] - a[_LAST] * b[_NEXT]
    return product


def _rows_cross(matrix: Array, vector: Array) -> Array:
    """Each row of a matrix x vector, (3, 3, *shape)."""
    product: Array = matrix[:, _NEXT] * vector[_LAST] - matrix[:, _LAST] * vector[_NEXT]
    return product


# ------------------------------------------------------------------------------------------------------ one frame


def _parents_first(frames: Iterable[Frame]) -> list[Frame]:
    """The ``frames`` in an order in which each comes after its parent (the record refuses circles)."""
    left, ordered, known = list(frames), [], {WORLD}
    while left:
        ready = [frame for frame in left if frame.parent in known]
        ordered += ready
        known |= {frame.name for frame in ready}
        left = [frame for frame in left if frame.name not in known]
    return ordered


def _link(frame: Frame, slots: Slots) -> Link:
    written, rate = slots.written, slots.rate
    origin = [written(x) for x in frame.origin]
    turns = []
    for axis, angle in frame.rotations:
        a = written(angle)
        values = slots.add([sp.cos(a), sp.sin(a), rate(a)])
        own = AXES.index(axis) if isinstance(axis, str) else slots.add(unit_vector([written(x) for x in axis]))
        turns.append(Turn(own, values))
    e = None if frame.quaternion is None else [written(x) for x in frame.quaternion]
    quaternion = None if e is None else slots.add([*e, *map(rate, e)])
    return Link(frame.name, str(frame.parent), slots.add([*origin, *map(rate, origin)]), tuple(turns), quaternion)


def _turned(R: Array, w: Array, axis: int | Array, values: Array) -> tuple[Array, Array]:
    """R and w after a turn about ``axis``, one of the axes of R or a unit vector in them."""
    c, s, rate = values
    if isinstance(axis, int):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turned = R.copy()
        turned[:, i], turned[:, j] = c * R[:, i] + s * R[:, j], c * R[:, j] - s * R[:, i]
        return turned, w + rate * R[:, axis]
    # Rodrigues: each row r of R becomes c r + s r x u + (1 - c)(r . u) u
    along = apply(R, axis)
    return c * R + s * _rows_cross(R, axis) + (1 - c) * along[:, None] * axis, w + rate * along


def _by_quaternion(R: Array, w: Array, values: Array) -> tuple[Array, Array]:
    """R and w after the rotation of a unit quaternion, r -> r + 2 e0 e x r + 2 e x (e x r)."""
    e0, e, e0_dot, e_dot = values[0], values[1:4], values[4], values[5:]
    once = _rows_cross(R, e)
    return R + 2 * e0 * once + 2 * _rows_cross(once, e), w + 2 * apply(R, e0 * e_dot - e0_dot * e + cross(e, e_dot))


@dataclass(frozen=True)
class Mass:
    """A body: its mass (kg), and the entries (6,) of its inertia tensor (kg.m2) if it has one."""

    spot: Spot
    mass: slice
    inertia: slice | None


@dataclass(frozen=True)
class Element:
    """A spring or damper between two spots: its constant (N/m, N.s/m), and the natural length (m) of a spring."""

    ends: tuple[Spot, Spot]
    values: slice
    free: bool

    def gap(self, poses: dict[str, FramePose], values: Array) -> tuple[Array, Array]:
        """From the second end to the first, in m, and its rate in m/s."""
        (xa, va), (xb, vb) = (end.motion(poses, values) for end in self.ends)
        return xa - xb, va - vb


def changing(later: FramePose, quantity: str, gravity: Array) -> Array:
    """The angular acceleration (rad/s2) or specific force (m/s2) of a frame in world axes, (3, N), by a complex step.

    ``gravity`` is its acceleration in m/s2, (3, N).
    """
    change: Array = (later.v.imag if quantity == "specific_force" else later.w.imag) / STEP
    return np.broadcast_to(change, gravity.shape) - (gravity if quantity == "specific_force" else 0.0)


def turning(pose: FramePose, quantity: str, *, in_world: bool) -> Array:
    """The entries of velocities (m/s, rad/s), rotation matrix, its columns, or angles about x, y, z (rad), (k, N)."""
    R = pose.R
    if quantity in ("angular_velocity", "origin_velocity"):
        own = pose.w if quantity == "angular_velocity" else pose.v
        return own if in_world else apply_transposed(R, own)
    if quantity == "rotation":
        return R.reshape(9, *R.shape[2:])
    if quantity.endswith("_axis"):
        return R[:, "xyz".index(quantity[0])]
    cosine = np.sqrt(R[0, 0] ** 2 + R[0, 1] ** 2)
    return np.stack([atan2(-R[1, 2], R[2, 2]), atan2(R[0, 2], cosine), atan2(-R[0, 1], R[0, 0])])


def growth(gap: Array, rate: Array, root: Callable[[Any], Any]) -> Any:
    """How fast |gap| grows (m/s), (*batch), for ``gap`` (m) and its ``rate`` (m/s), (3, *batch) each."""
    return dot(gap, rate) / root(dot(gap, gap))


def rotational(w: Array, inertia: Array) -> Array:
    """w . J w (J) for w (3, *batch) in rad/s and the tensor's entries (6, *batch): xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = inertia
    x, y, z = w
    product: Array = xx * x * x + yy * y * y + zz * z * z + 2 * (xy * x * y + xz * x * z + yz * y * z)
    return product
