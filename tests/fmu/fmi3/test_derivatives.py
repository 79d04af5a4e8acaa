"""Derivatives by FMI 3.0: directional ones, adjoint ones, and what depends on what."""

from __future__ import annotations

import numpy as np
import pytest
from stepping3 import Stepping3

pytestmark = pytest.mark.fmu


def knowns_and_unknowns(unit: Stepping3) -> tuple[list[int], list[int], list[int], list[int]]:
    """Value references of all knowns and unknowns, and the sizes of each."""
    variables = [v for v in unit.description.modelVariables if v.type == "Float64"]
    sizes = {v.valueReference: int(np.prod([d.start for d in v.dimensions])) if v.dimensions else 1 for v in variables}
    known = [v.valueReference for v in variables if v.causality in ("input", "parameter", "independent")]
    known = [r for r in known if not unit_name(unit, r).startswith("solver_")]
    states = [v for v in variables if v.causality == "output" and v.initial == "exact"]
    known += [v.valueReference for v in states]
    unknown = [v.valueReference for v in variables if v.causality in ("output", "local")]
    indicators = {v.variable.valueReference for v in unit.description.eventIndicators}
    unknown = list(dict.fromkeys(r for r in unknown if r not in indicators))
    return known, unknown, [sizes[r] for r in known], [sizes[r] for r in unknown]


def unit_name(unit: Stepping3, reference: int) -> str:
    """The name of a value reference."""
    return next(name for name, r in unit.references.items() if r == reference)


@pytest.mark.parametrize("arrays", [False, True])
@pytest.mark.parametrize("model", ["bouncing_ball", "four_bar_linkage"])
def test_adjoint_products_are_transposed_directional_ones(exported, model: str, arrays: bool) -> None:
    random = np.random.default_rng(7)
    with Stepping3(exported(model, fmi="3.0", arrays=arrays).path) as unit:
        knowns, unknowns, n, m = knowns_and_unknowns(unit)
        for enter in (unit.unit.enterInitializationMode, unit.unit.exitInitializationMode):  # and step mode
            enter()
            for _ in range(3):
                seed, weights = random.normal(size=sum(n)), random.normal(size=sum(m))
                forward = unit.unit.getDirectionalDerivative(unknowns, knowns, list(seed), sum(m))
                back = unit.unit.getAdjointDerivative(unknowns, knowns, list(weights), sum(n))
                scale = np.linalg.norm(weights) * np.linalg.norm(forward)
                assert weights @ np.array(forward) == pytest.approx(seed @ np.array(back), abs=1e-13 * scale)


def test_dependencies_are_those_of_the_description(exported) -> None:
    with Stepping3(exported("bouncing_ball", fmi="3.0").path) as unit:
        structure = unit.description
        checked = 0
        for unknown in structure.outputs + structure.derivatives:
            if unknown.dependencies is None:
                continue
            expected = [known.valueReference for known in unknown.dependencies]
            kinds = [{"constant": 1, "dependent": 5}[kind] for kind in unknown.dependenciesKind or []]
            found = unit.dependencies(unknown.variable.name)
            assert [known for known, _ in found] == expected
            assert not kinds or [kind for _, kind in found] == kinds
            checked += 1
        assert checked > 0
