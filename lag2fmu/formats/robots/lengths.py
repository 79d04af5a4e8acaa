"""Lengths and places by which actuators, tendons and couplings of a robot act."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from lag2fmu.description.places import WORLD, Point
from lag2fmu.formats.robots.parts import Parts
from lag2fmu.formats.robots.tree import Span, Sum, Transmission, Wrench
from lag2fmu.formats.robots.writing import numbers
from lag2fmu.language.vocabulary import symbol


def length_of(length: Sum, name: str, parts: Parts) -> tuple[sp.Expr, sp.Expr]:
    """A length and its rate as expressions."""
    factors = [factor for _, factor in length]
    gears = gears_of(name, factors, parts)
    joints = [parts.joints[joint] for joint, _ in length]
    at, rate = (sp.Add(*(x * symbol(f"{q}{dot}") for q, x in zip(joints, gears, strict=True))) for dot in ("", "_dot"))
    return at, rate


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
