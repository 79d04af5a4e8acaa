"""The places of labels where there is room, and how names are written in a picture."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from lag2fmu.graph.batches import Floats

_GREEK = dict(
    zip(
        [
            "alpha",
            "beta",
            "gamma",
            "delta",
            "epsilon",
            "zeta",
            "eta",
            "theta",
            "iota",
            "kappa",
            "lambda",
            "mu",
            "nu",
            "xi",
            "pi",
            "rho",
            "sigma",
            "tau",
            "phi",
            "chi",
            "psi",
            "omega",
            "Gamma",
            "Delta",
            "Theta",
            "Lambda",
            "Xi",
            "Pi",
            "Sigma",
            "Phi",
            "Psi",
            "Omega",
        ],
        "αβγδεζηθικλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ",
        strict=True,
    )
)
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_WORD = re.compile(r"[A-Za-z_]\w*")
_DIRECTIONS = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
_RINGS = (1.0, 1.7, 2.6, 4.0, 6.0, 9.0)
_WIDTH, _HEIGHT = 0.58, 1.0
"""The width of a character, as a multiple of its height."""


class Label(NamedTuple):
    """A ``text`` centred at ``at`` (2,), of letters ``size`` high, in a ``style`` of strokes; it names the ``part``."""

    part: str
    style: str
    text: str
    at: tuple[float, float]
    size: float


class Wish(NamedTuple):
    """A label for the point ``near`` (2,), at least ``away`` from it; with ``inside`` over it, if there is room."""

    part: str
    style: str
    text: str
    near: tuple[float, float]
    size: float
    away: float = 2.0
    inside: bool = False


def pretty(text: str) -> str:
    """Greek letters and indices as they are written by hand: theta_1 -> θ₁, k*x**2 -> k x²."""
    text = text.replace("**2", "²").replace("**3", "³").replace("*", " ")
    return _WORD.sub(lambda found: _name(found[0]), text)


def _name(word: str) -> str:
    found = re.fullmatch(r"([A-Za-z]+?)_?(\d+)", word)
    head, index = (found[1], found[2]) if found else (word, "")
    if not index and word.partition("_")[0] in _GREEK:
        head, _, rest = word.partition("_")
        return f"{_GREEK[head]}_{rest}" if rest else _GREEK[head]
    if head not in _GREEK and len(head) > 1:
        return word
    return _GREEK.get(head, head) + index.translate(_SUBSCRIPTS)


def placed(wishes: Iterable[Wish], obstacles: Sequence[Floats]) -> list[Label]:
    """The labels, each where it covers least of the ``obstacles`` (polylines (k, 2)) and no other label."""
    crowd = np.vstack([_filled(line) for line in obstacles]) if obstacles else np.zeros((0, 2))
    labels: list[Label] = []
    taken = np.zeros((0, 4))
    for wish in wishes:
        half = half_of(wish.text, wish.size)
        best = np.array(wish.near)
        cost = 0.1 if wish.inside and not _covered(best, half, crowd, taken) else np.inf
        for ring, distance in enumerate(_RINGS):
            if cost <= 5 * ring:
                break
            for turn, direction in enumerate(_DIRECTIONS):
                center = np.array(wish.near) + np.array(direction) * (half + wish.away * distance)
                here = 5 * ring + 0.3 * turn + _covered(center, half, crowd, taken)
                if here < cost:
                    best, cost = center, here
        taken = np.vstack([taken, [*best, *half]])
        labels.append(Label(wish.part, wish.style, wish.text, (float(best[0]), float(best[1])), wish.size))
    return labels


def half_of(text: str, size: float) -> Floats:
    """Half the width and height (2,) of a ``text`` whose letters are ``size`` high."""
    return np.array([_WIDTH * len(text), _HEIGHT]) * size / 2


def _covered(center: Floats, half: Floats, crowd: Floats, taken: Floats) -> float:
    """The cost of a label at ``center``: 3 for each point of a line under it, 1000 for each label under it."""
    inside = (np.abs(crowd - center) < half + 0.5).all(axis=1).sum()
    over = (np.abs(taken[:, :2] - center) < taken[:, 2:] + half + 0.4).all(axis=1).sum()
    return float(3 * inside + 1000 * over)


def _filled(line: Floats) -> Floats:
    """Points along a polyline, one in each unit of length."""
    pieces = [line[:1]]
    for a, b in pairwise(line):
        count = max(2, int(np.ceil(float(np.linalg.norm(b - a)))) + 1)
        pieces.append(a + np.linspace(0.0, 1.0, count)[1:, None] * (b - a))
    return np.vstack(pieces)
