"""Derivatives by FMI 3.0: directional ones, adjoint ones, and what depends on what."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from stepping3 import Stepping3
from sympy import sqrt

from lag2fmu import simulate
from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter, signal

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


def test_a_slope_without_bound_counts_along_its_own_variable_alone(exported) -> None:
    """Critical damping c = 2 sqrt(k m) of a spring that is set to 0, and a valve by sqrt(u) that is shut.

    Radau5 takes its Jacobian from these derivatives; with k = 0 and u = 0 the mass keeps its velocity.
    """
    x, k, u = coordinate("x", start=0.3, velocity=2.0), parameter("k", 0.0), signal("u")
    force = -2 * sqrt(k) * x.dot + sqrt(u) * x
    energy = Energy(x.dot**2 / 2, k * x**2 / 2)
    mechanism = Mechanism("slack", coordinates=[x], parameters=[k], inputs=[u], energy=energy, forces={x: force})
    fmu = exported(mechanism, solver="radau5", fmi="3.0")
    with Stepping3(fmu.path) as unit:
        unit.start()
        r = unit.references
        for k_is, u_is in ((0.0, 0.0), (4.0, 0.0), (0.0, 9.0)):
            unit.set({"k": k_is, "u": u_is})
            expected = [-k_is + np.sqrt(u_is), -2 * np.sqrt(k_is)]
            knowns = [r["x"], r["x_dot"]]
            directional = [unit.unit.getDirectionalDerivative([r["x_ddot"]], [known], [1.0], 1)[0] for known in knowns]
            assert directional == pytest.approx(expected, abs=1e-15)
            assert unit.unit.getAdjointDerivative([r["x_ddot"]], knowns, [1.0], 2) == pytest.approx(expected, abs=1e-15)
        unit.set({"k": 0.0, "u": 0.0})
        with pytest.raises(FMICallException):
            unit.unit.getDirectionalDerivative([r["x_ddot"]], [r["k"]], [1.0], 1)
    assert simulate(fmu, stop_time=1.0)["x"][-1] == pytest.approx(2.3, abs=1e-12)


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
