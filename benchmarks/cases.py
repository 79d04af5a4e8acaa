"""The mechanisms that the derivation is measured on: as a user writes them, and as rows that the peers are built from.

P(n): planar chain of n uniform rods with relative angles, P(n)a with absolute ones; B(n): P(n)a with springs between
the rods, a beam, which only its energies are known of; C(n): a cart that carries n rods;
T14: planar humanoid, a tree of 14 coordinates; S(n): spatial arm, revolute joints about x, y, z in turn, full inertia
tensors. Parameters are seeded, the same for all, and stay variables at run time.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sympy import Integer, cos, sin

from lag2fmu.mechanism import Body, Frame, Mechanism, Spring, coordinate, parameter

Floats = NDArray[np.float64]
Scalar = Any
"""A number, a node of a graph or a symbol of a peer: what can be added and multiplied."""

STATES = 64
SPATIAL = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass(frozen=True)
class Rod:
    """A planar link that hangs down at angle 0 from its ``parent`` (-1: the base), at the parent's end or its start.

    ``center``: the mass centre as a fraction of the length.
    """

    parent: int
    at_end: bool
    center: float
    mass: Scalar
    length: Scalar
    inertia: Scalar


@dataclass(frozen=True)
class Segment:
    """A spatial link: it turns about its ``axis`` (0, 1, 2) at ``place`` (3,) of the link before, in m; SI units."""

    axis: int
    place: Sequence[Scalar]
    mass: Scalar
    center: Sequence[Scalar]
    inertia: Sequence[Sequence[Scalar]]


@dataclass(frozen=True)
class Case:
    """One mechanism; ``base`` of a planar one is "fixed", a "cart" along x, or "free" along x and y.

    ``tree``: (parent, at_end, center) of each rod, empty for a spatial arm; ``values``: {parameter: value}.
    """

    name: str
    n: int
    base: str
    absolute: bool
    tree: tuple[tuple[int, bool, float], ...]
    values: Mapping[str, float]

    @property
    def planar(self) -> bool:
        """Whether the links are rods."""
        return bool(self.tree)

    @property
    def offset(self) -> int:
        """The number of coordinates of the base."""
        return {"fixed": 0, "cart": 1, "free": 2}[self.base]

    def rods(self, p: Mapping[str, Scalar]) -> list[Rod]:
        """The planar links with the parameters ``p``."""
        return [Rod(*row, p[f"m{i}"], p[f"l{i}"], p[f"I{i}"]) for i, row in enumerate(self.tree)]

    def segments(self, p: Mapping[str, Scalar]) -> list[Segment]:
        """The spatial links with the parameters ``p``."""
        links = []
        for i in range(self.n):
            xx, yy, zz, xy, xz, yz = (p[f"{name}{i}"] for name in SPATIAL)
            place, center = ([p[f"{letter}{axis}{i}"] for axis in "xyz"] for letter in "dc")
            links.append(Segment(i % 3, place, p[f"m{i}"], center, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        return links

    def mechanism(self) -> Mechanism:
        """The mechanism as a user writes it: flat sums of positions for rods, frames for an arm."""
        return _planar(self) if self.planar else _spatial(self)

    def states(self, number: int = STATES) -> tuple[Floats, Floats]:
        """Random states x = (q, qd), (number, 2n), and forces Q, (number, n); the same in every run."""
        rng = np.random.default_rng(1)
        q, qd, Q = (rng.uniform(-bound, bound, (number, self.n)) for bound in (3.0, 1.0, 2.0))
        return np.hstack([q, qd]), Q


def case(name: str) -> Case:
    """The case ``name``; raises ValueError for a name of none."""
    found = re.fullmatch(r"(?:([PCSB])([1-9]\d?)(a?)|T14)", name)
    if found is None or (found[3] and found[1] != "P"):
        raise ValueError(f"unknown case '{name}'; known are P<n>, P<n>a, B<n>, C<n>, S<n> and T14")
    rng = np.random.default_rng(7)
    if name == "T14":
        return Case(name, 14, "free", False, HUMANOID, _rod_values(rng, len(HUMANOID)))
    links = int(found[2])
    if found[1] == "S":
        return Case(name, links, "fixed", False, (), _segment_values(rng, links))
    chain = tuple((i - 1, True, 0.5) for i in range(links))
    if found[1] == "C":
        return Case(name, links + 1, "cart", False, chain, {"mc": 1.7, **_rod_values(rng, links)})
    stiffness = {"k": 50.0} if found[1] == "B" else {}
    return Case(name, links, "fixed", bool(found[3] or stiffness), chain, stiffness | _rod_values(rng, links))


HUMANOID = (
    (-1, True, 0.5),  # trunk, on the hip
    (0, True, 0.5),  # head
    *((0, True, 0.436), (2, True, 0.682)),  # upper arm and forearm, left
    *((0, True, 0.436), (4, True, 0.682)),  # and right
    *((0, False, 0.433), (6, True, 0.433), (7, True, 0.5)),  # thigh, shank and foot, left
    *((0, False, 0.433), (9, True, 0.433), (10, True, 0.5)),  # and right
)
"""(parent, at its end, centre) of the segments. Centres: D. A. Winter, Biomechanics of Human Movement, table 3.1."""


def _rod_values(rng: np.random.Generator, links: int) -> dict[str, float]:
    values = {"g": 9.81}
    for i in range(links):
        m, l = rng.uniform(0.5, 2), rng.uniform(0.3, 1.2)  # noqa: E741
        values |= {f"m{i}": m, f"l{i}": l, f"I{i}": m * l * l / 12}
    return values


def _segment_values(rng: np.random.Generator, links: int) -> dict[str, float]:
    values = {"g": 9.81}
    for i in range(links):
        m, size = rng.uniform(0.5, 4), rng.uniform(0.05, 0.4, 3)
        R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        I = R @ np.diag(m / 12 * (size @ size - size**2)) @ R.T  # noqa: E741
        place, center = rng.uniform(-0.4, 0.4, 3), rng.uniform(-0.2, 0.2, 3)
        values |= {f"m{i}": m} | {f"d{axis}{i}": float(x) for axis, x in zip("xyz", place, strict=True)}
        values |= {f"c{axis}{i}": float(x) for axis, x in zip("xyz", center, strict=True)}
        entries = (I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2])
        values |= {f"{name}{i}": float(x) for name, x in zip(SPATIAL, entries, strict=True)}
    return values


def _planar(case: Case) -> Mechanism:
    p = {name: parameter(name, value) for name, value in case.values.items()}
    names = {"fixed": (), "cart": ("x",), "free": ("x", "y")}[case.base]
    base = [coordinate(name) for name in names]
    angles = [coordinate(f"q{i}", start=0.3) for i in range(len(case.tree))]
    bodies = [Body("cart", p["mc"], (base[0], 0))] if case.base == "cart" else []
    start, end, total = [], [], []
    for i, rod in enumerate(case.rods(p)):
        inner = rod.parent
        phi = angles[i] + (total[inner] if inner >= 0 and not case.absolute else 0)
        x, y = (*base, 0, 0)[:2] if inner < 0 else (end if rod.at_end else start)[inner]
        along = (rod.length * sin(phi), -rod.length * cos(phi))
        c = Integer(1) / 2 if rod.center == 0.5 else rod.center
        bodies.append(Body(f"b{i}", rod.mass, (x + c * along[0], y + c * along[1]), angle=phi, inertia=rod.inertia))
        start.append((x, y))
        end.append((x + along[0], y + along[1]))
        total.append(phi)
    bent = [b - a for a, b in zip([0, *angles], angles, strict=False)] if "k" in p else []
    springs = [Spring(f"s{i}", p["k"], angle) for i, angle in enumerate(bent)]
    unknown, given = [*base, *angles], p.values()
    return Mechanism(case.name, coordinates=unknown, parameters=given, bodies=bodies, springs=springs, gravity=p["g"])


def _spatial(case: Case) -> Mechanism:
    p = {name: parameter(name, value) for name, value in case.values.items()}
    angles = [coordinate(f"q{i}", start=0.3) for i in range(case.n)]
    frames, bodies = [], []
    for i, link in enumerate(case.segments(p)):
        parent = f"f{i - 1}" if i else "world"
        frames.append(Frame(f"f{i}", parent, link.place, [("xyz"[link.axis], angles[i])]))
        inertia = [p[f"{name}{i}"] for name in SPATIAL]
        bodies.append(Body(f"b{i}", link.mass, frame=f"f{i}", center=link.center, inertia=inertia))
    return Mechanism(case.name, coordinates=angles, parameters=p.values(), frames=frames, bodies=bodies, gravity=p["g"])
