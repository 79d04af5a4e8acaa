"""Lengths and places by which actuators, tendons and couplings of a robot act."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import sympy as sp

from lag2fmu.description.description import Description
from lag2fmu.description.places import AXES, WORLD, Point
from lag2fmu.formats.robots.parts import Parts
from lag2fmu.formats.robots.tree import Span, Sum, Transmission, Wrench
from lag2fmu.formats.robots.writing import numbers
from lag2fmu.language.vocabulary import symbol
from lag2fmu.mechanism.poses import Poses, poses_of, times

_TURNS, _OF_QUATERNION = 6, 3
"""The turns that are written out in one expression, and for how many of them a quaternion counts."""


def length_of(length: Sum | Span, name: str, parts: Parts) -> tuple[sp.Expr, sp.Expr]:
    """A length and its rate as expressions in coordinates, where straight from place to place of as many as move it."""
    if isinstance(length, Span):
        return _way_along(length, name, parts)
    factors = [factor for _, factor in length]
    gears = gears_of(name, factors, parts)
    joints = [parts.joints[joint] for joint, _ in length]
    at, rate = (sp.Add(*(x * symbol(f"{q}{dot}") for q, x in zip(joints, gears, strict=True))) for dot in ("", "_dot"))
    return at, rate


def _way_along(span: Span, name: str, parts: Parts) -> tuple[sp.Expr, sp.Expr]:
    """The sum of the distances from place to place, times the gear, and its rate."""
    metre = parts.metre()
    frames = tuple(replace(x, origin=tuple(_with_unit(o, metre) for o in x.origin)) for x in parts.frames)
    poses = poses_of(Description("way", coordinates=tuple(parts.coordinates), frames=frames))
    way = rate = sp.S.Zero
    for ends in pairwise(span.spots):
        carriers = [parts.carriers[link] for link, _ in ends]
        base = poses.common(carriers[0][0], carriers[1][0])
        (start, first), (end, last) = (
            _seen(poses, frame, base, sp.Matrix(numbers(pose.origin + matrix @ place)) * metre, name, parts)
            for (frame, matrix, pose), (_, place) in zip(carriers, ends, strict=True)
        )
        apart, moved = end - start, last - first
        distance = sp.sqrt(sp.Add(*(x**2 for x in apart)))
        way += distance
        rate += sp.Add(*(x * v for x, v in zip(apart, moved, strict=True))) / distance
    gear = gear_of(name, span.gear, parts)
    return gear * way, gear * rate


def _seen(poses: Poses, frame: str, base: str, at: sp.Matrix, name: str, parts: Parts) -> tuple[sp.Matrix, sp.Matrix]:
    """The place and the velocity, each (3, 1), of what is fixed ``at`` a place of ``frame``, in the axes of ``base``.

    On a long way their entries get names, because a turn makes three terms of one.
    """
    moved = sp.zeros(3, 1)
    for carrier in _stages(poses, frame, base):
        pose = poses.pose(frame, carrier)
        at, moved = pose.at(at), pose.moved(at) + times(pose.rotation, moved)
        if carrier != base:
            at, moved = (
                sp.Matrix([parts.define(f"{word}_of_{name}_{axis}", x) for axis, x in zip(AXES, entries, strict=True)])
                for word, entries in (("place", at), ("velocity", moved))
            )
        frame = carrier
    return at, moved


def _stages(poses: Poses, frame: str, base: str) -> Iterator[str]:
    """Frames on the way from ``frame`` to ``base``, which is the last, with few turns from one to the next."""
    turns = 0
    for link in poses.chain(frame, base)[::-1]:
        own = len(link.rotations) + _OF_QUATERNION * (link.quaternion is not None)
        if turns and turns + own > _TURNS:
            yield link.name
            turns = 0
        turns += own
    yield base


def _with_unit(entry: object, metre: sp.Expr) -> sp.Expr:
    """An ``entry`` of a place, which is a length in m where it is a number."""
    x = sp.sympify(entry)
    return x * metre if x.is_number else x


def gears_of(name: str, factors: Sequence[float], parts: Parts) -> list[sp.Expr]:
    """Factors as parameters, none where a single one is 1: of several one takes lengths and another one angles."""
    if len(factors) == 1:
        return [gear_of(name, factors[0], parts)]
    return [_ratio(f"gear_{name}_{k}", x, parts) if x else sp.S.Zero for k, x in enumerate(factors, 1)]


def gear_of(name: str, factor: float, parts: Parts) -> sp.Expr:
    """A factor as a parameter, nothing where it is 1."""
    return sp.S.One if factor == 1.0 else _ratio(f"gear_{name}", factor, parts)


def _ratio(name: str, factor: float, parts: Parts) -> sp.Expr:
    """A parameter that is a number without a dimension, unless another one is so and the two together have one."""
    made = parts.parameter(name, factor)
    parts.plain.append(str(made))
    return made


def spots_of(along: Span, name: str, parts: Parts) -> list[str]:
    """The names of its points."""
    return [spot_of(link, place, f"{name}_site_{k}", parts) for k, (link, place) in enumerate(along.spots, 1)]


def spot_of(link: str, place: Sequence[float], name: str, parts: Parts) -> str:
    """The name of a new point at a ``place`` of a ``link``."""
    carrier, matrix, pose = parts.carriers[link]
    name = parts.names.entry("places", name)
    parts.points.append(Point(name, numbers(pose.origin + matrix @ place), carrier))
    return name


def idle(along: Transmission, parts: Parts) -> str:
    """Why a force ``along`` something moves nothing, '' where it may."""
    if isinstance(along, Wrench) and parts.carriers[along.link][0] == WORLD:
        return "it acts on the world, which does not move"
    if isinstance(along, Span) and len({parts.carriers[link][0] for link, _ in along.spots}) == 1:
        return "its ends do not move to each other"
    return ""
