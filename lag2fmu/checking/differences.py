"""The comparison of derivatives that an FMU gives with differences of the FMU itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lag2fmu.checking.description import Variable
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.session import Model

STEP = 1e-4
"""The steps of differences, relative to the known; central differences of smooth functions err by about 1e-8."""
_BAR = 1e-3
"""Differences and derivative must agree to this, relative to the greater one and the size of the unknown."""

_ROUNDING = 1e-12
"""Of the greatest derivative, or of 1 if that is more: what may remain where all of it cancels."""

_PRODUCT_BAR = 1e-9
"""Products with one Jacobian must agree to this, relative to the sum of the terms' sizes."""

Sides = tuple[float, float]
"""Differences to above and to below."""


def to_sides(here: Sequence[float], above: Sequence[float], below: Sequence[float], step: float) -> list[Sides]:
    """The differences of several unknowns whose values are known at a point and a step above and below it."""
    return [((a - c) / step, (c - b) / step) for a, b, c in zip(above, below, here, strict=True)]


def wanted(own: float, size: float, fine: Sides, coarse: Sides, greatest: float = 0.0) -> float | None:
    """The derivative by differences that contradicts the derivative ``own``; None if ``own`` may be right.

    ``size`` is that of the unknown; ``fine`` and ``coarse`` are differences by two steps; ``greatest`` is the greatest
    derivative of all by this known, of which rounding remains in those that cancel. Central differences that do
    not agree with one another say nothing. At a kink the derivative may be that to either side, because an FMU with
    events may be in another mode at a moved start.
    """
    central, other = sum(fine) / 2, sum(coarse) / 2
    bar = _BAR * (max(abs(central), abs(own)) + 1e-3 * abs(size) + 1e-6) + _ROUNDING * greatest
    if not abs(central - other) < bar / 10:  # this is so for NaN, too
        return None
    return None if any(abs(own - x) <= bar for x in (central, *fine)) else central


def not_listed(unknown: Variable, known: Variable, mode: str) -> Finding:
    """A known that is not among the dependencies of an unknown that varies with it."""
    problem = f"'{unknown.name}' varies with '{known.name}' in {mode}, which is not among its dependencies"
    return Finding("dependency-missing", unknown.place, problem, "list it")


def contradicted(model: Model, mode: str, names: tuple[str, str], own: float, other: float) -> Finding:
    """The derivative of one by the other of ``names`` that is ``own`` for the FMU and ``other`` by differences."""
    problem = f"in {mode}, d {names[0]} / d {names[1]} = {own:.6g}, but differences give {other:.6g}"
    return Finding("directional", model.kind, problem, "check the derivative and the dependencies")


def weights(count: int) -> list[float]:
    """Numbers of both signs and different sizes: a seed."""
    return [(-1.0) ** i * (1.0 + 0.25 * (i % 5)) for i in range(count)]


def product_findings(
    model: Model,
    mode: str,
    function: str,
    rows: Sequence[Sequence[float]],
    seed: Sequence[float],
    given: Sequence[float],
) -> Iterator[Finding]:
    """The first element of what ``function`` has ``given`` that is not the product of its row and the seed.

    ``rows`` (m, k) are the Jacobian, known from calls for one known each, ``seed`` is (k,) and ``given`` (m,).
    """
    products = [[a * b for a, b in zip(row, seed, strict=True)] for row in rows]
    greatest = max((sum(map(abs, terms)) for terms in products), default=0.0)
    for i, (terms, own) in enumerate(zip(products, given, strict=True)):
        bar = _PRODUCT_BAR * (sum(map(abs, terms)) + abs(own)) + _ROUNDING * max(greatest, 1.0)
        if not abs(own - sum(terms)) <= bar:
            rule = "adjoint" if function == "GetAdjointDerivative" else "directional"
            problem = f"in {mode}, element {i + 1} of {model.prefix}{function} is {own:.10g}, not {sum(terms):.10g}"
            yield Finding(rule, model.kind, problem, "both are products with one Jacobian")
            return
