"""Inputs that are polynomials in a communication step, and time derivatives of outputs, exact against other paths."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
import sympy as sp
from fmpy.fmi1 import FMICallException
from numpy.typing import NDArray
from stepping import Stepping, bits

from lag2fmu.formats.loading import load
from lag2fmu.language.expressions import TIME
from lag2fmu.reference import integrate
from lag2fmu.reference.signals import Signals, signals_of

pytestmark = pytest.mark.fmu

t = TIME
LIFT = 0.02 + 0.3 * t - 0.8 * t**2 + 0.5 * t**3
CUBIC: dict[str, dict[str, sp.Expr]] = {
    "double_pendulum": {"Q_theta1": 1 - 4 * t + 9 * t**2 - 5 * t**3, "Q_theta2": 0.3 * t - t**3},
    "cart_pole": {"F": 2 - 3 * t - 4 * t**2 + 8 * t**3, "Q_theta": 0.1 - 0.5 * t + t**3},
    "motion_driven_pendulum": {"y0": LIFT, "y0_dot": LIFT.diff(t), "y0_ddot": LIFT.diff(t, 2)},
    "six_axis_arm": {f"Q_theta_{i}": 4 * i - 30 * t + 20 * i * t**2 - 40 * t**3 for i in range(1, 7)},
}
"""Polynomials of order 3 in time by model and input, in SI units."""


def set_inputs(host: Stepping, inputs: Mapping[str, sp.Expr], order: int = 3) -> None:
    """Set ``inputs`` as they are at the present time, with their derivatives up to ``order``."""
    host.set({name: float(x.subs(t, host.time)) for name, x in inputs.items()})
    rates = [(name, k, float(x.diff(t, k).subs(t, host.time))) for name, x in inputs.items() for k in (1, 2, 3)]
    chosen = [(host.references[name], k, value) for name, k, value in rates if k <= order]
    references, orders, values = zip(*chosen, strict=True)
    host.unit.setRealInputDerivatives(references, orders, values)


def rates_of(host: Stepping, names: Sequence[str], order: int) -> NDArray[np.float64]:
    """The time derivatives of outputs."""
    references = [host.references[name] for name in names]
    return np.array(host.unit.getRealOutputDerivatives(references, [order] * len(names)))


def signals(model: str, breaks: NDArray[np.float64]) -> Signals:
    """The inputs of ``model`` for a direct integration that ends a step at each of ``breaks``."""
    motions = {u.name for u in load(model).motions}
    given = {name: x for name, x in CUBIC[model].items() if name.removesuffix("_dot").removesuffix("_ddot") == name}
    assert motions <= given.keys()
    return Signals(signals_of(load(model), given, 0.0).at, breaks)


# --------------------------------------------------------------------------------------------------------- inputs


@pytest.mark.parametrize("model", ["double_pendulum", "cart_pole", "motion_driven_pendulum"])
def test_one_long_step_follows_a_cubic_input(model: str, exported) -> None:
    """One step of 1 s and 100 of 0.01 s, the input set once or anew each time, against SciPy with the same cubic."""
    grid = np.array([0.0, 1.0])
    reference = integrate(load(model), grid, inputs=signals(model, grid), rtol=1e-13)
    for count in (1, 100):
        with Stepping(exported(model).path) as host:
            host.start(tolerance=1e-12)
            for _ in range(count):
                set_inputs(host, CUBIC[model])
                found = host.step(1.0 / count)
            expected = [reference.trajectory[name][-1] for name in host.states]
            assert found == pytest.approx(expected, abs=1e-9), count
            ends = [float(x.subs(t, 1)) for x in CUBIC[model].values()]
            assert host.get(list(CUBIC[model])) == pytest.approx(ends, abs=1e-12), "an input stays where it was led"


@pytest.mark.parametrize("model", ["cart_pole", "motion_driven_pendulum"])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_result_does_not_depend_on_the_communication_step(model: str, tolerance: float, exported) -> None:
    """Communication steps from 0.1 ms to 1 s, with constant inputs and with polynomials."""
    polynomials = {name: derivatives_of(x) for name, x in CUBIC[model].items()}
    for order in (0, 3):
        ends = []
        for count in (1, 4, 30, 1000, 10000):
            with Stepping(exported(model).path) as host:
                host.start({"F": 1.5} if model == "cart_pole" else {"y0_ddot": 2.0}, tolerance=tolerance)
                for number in range(count):
                    if order:
                        set_expanded(host, polynomials, number / count)
                    host.unit.doStep(number / count, 1 / count)
                ends.append(host.get(host.states))
        spread = np.ptp(ends, axis=0).max()
        assert 0 < spread < 100 * tolerance, (order, ends)


def derivatives_of(x: sp.Expr) -> NDArray[np.float64]:
    """The coefficients of 1, t, t^2, t^3 in a cubic polynomial and in its derivatives (4, 4)."""
    taylors = [sp.Poly(x.diff(t, k), t).all_coeffs()[::-1] for k in range(4)]
    return np.array([[*map(float, taylor), *[0.0] * (4 - len(taylor))] for taylor in taylors])


def set_expanded(host: Stepping, polynomials: Mapping[str, NDArray[np.float64]], time: float) -> None:
    """As ``set_inputs``, quickly: ``polynomials`` are those of ``derivatives_of``."""
    for name, coefficients in polynomials.items():
        values = (coefficients @ (1.0, time, time**2, time**3)).tolist()
        reference = host.references[name]
        host.unit.setReal([reference], values[:1])
        host.unit.setRealInputDerivatives([reference] * 3, [1, 2, 3], values[1:])


def test_lower_orders_are_worse_by_orders_of_the_step(exported) -> None:
    """Held inputs, and Taylor polynomials of order 1 and 2 of a sine: errors of order H, H^2 and H^3."""
    model, inputs = "cart_pole", {"F": 3 * sp.sin(5 * t)}
    reference = integrate(load(model), [0.0, 1.0], inputs=inputs, rtol=1e-13)
    steps = [0.1, 0.05, 0.025]
    for order in (0, 1, 2, 3):
        errors = []
        for length in steps:
            with Stepping(exported(model).path) as host:
                host.start(tolerance=1e-12)
                for _ in range(round(1 / length)):
                    host.set({"F": float(inputs["F"].subs(t, host.time))})
                    if order:
                        set_inputs(host, inputs, order)
                    found = host.step(length)
                errors.append(np.abs(np.subtract(found, [reference.trajectory[n][-1] for n in host.states])).max())
        assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(order + 1, abs=0.3), errors


def test_input_derivatives_are_saved_cleared_and_forgotten(exported) -> None:
    path = exported("double_pendulum").path
    inputs = CUBIC["double_pendulum"]
    with Stepping(path) as host, Stepping(path) as fresh, Stepping(path) as copy:
        host.start()
        set_inputs(host, inputs)
        block = host.unit.serializeFMUstate(host.unit.getFMUstate())
        first = [bits(host.step(0.2)), bits(host.step(0.2))]
        copy.unit.setFMUstate(copy.unit.deSerializeFMUstate(block))
        assert [bits(copy.step(0.2)), bits(copy.step(0.2))] == first, "held in the second step, moved in the first"
        fresh.start({name: float(x.subs(t, 0)) for name, x in inputs.items()})
        assert bits(fresh.step(0.2)) != first[0]
        held = host.get(list(inputs))
        host.step(0.2)
        assert host.get(list(inputs)) == held
        set_inputs(host, inputs)
        host.unit.reset()
        fresh.unit.reset()
        assert bits(host.start().step(0.3)) == bits(fresh.start().step(0.3))


# --------------------------------------------------------------------------------------------------------- outputs

STENCIL = 4
SPACING = 0.004
"""Values at 2 STENCIL + 1 times, SPACING s apart: differences of order 8."""


def differences(values: NDArray[np.float64], order: int) -> NDArray[np.float64]:
    """Derivatives (k,) by time at the middle of ``values`` (2 STENCIL + 1, k)."""
    offsets = np.arange(-STENCIL, STENCIL + 1)
    powers = np.vander(offsets, increasing=True).T.astype(float)
    weights = np.linalg.solve(powers, np.eye(len(offsets))[order] * math.factorial(order))
    found: NDArray[np.float64] = weights @ values / SPACING**order
    return found


@pytest.mark.parametrize("model", CUBIC)
def test_output_derivatives_are_exact(model: str, exported) -> None:
    """Of all variables as outputs, along a motion that is driven by cubic inputs.

    Against differences of order 8, of the outputs themselves and of a direct integration on the independent path.
    """
    fmu = exported(model, outputs=("all",))
    names = [v.name for v in fmu.description.variables if v.causality == "output"]
    assert {"external_power", "generalized_energy"} < set(names)
    assert any(name.endswith("_ddot") for name in names)
    times = 0.3 + SPACING * np.arange(-STENCIL, STENCIL + 1)
    values = []
    with Stepping(fmu.path) as host:
        host.start(tolerance=1e-13)
        for time in times:
            set_inputs(host, CUBIC[model])
            host.step(time - host.time)
            host.time = float(time)
            values.append(host.get(names))
            if len(values) == STENCIL + 1:
                found = {order: rates_of(host, names, order) for order in (1, 2)}
    independent = integrate(load(model), [0.0, *times], inputs=signals(model, times), rtol=1e-13).trajectory
    common = [name for name in names if name in independent]
    assert len(common) >= len(names) // 2
    for order, derivatives in found.items():
        own = differences(np.array(values), order)
        scale = np.maximum(np.abs(own), np.abs(own).max() * 1e-3)
        assert np.abs((derivatives - own) / scale).max() < 2e-8, dict(zip(names, derivatives / own, strict=True))
        other = differences(independent.columns(common)[1:], order)
        places = [names.index(name) for name in common]
        assert np.abs((derivatives[places] - other) / scale[places]).max() < 2e-8


def test_derivatives_of_states_are_velocities_and_accelerations(exported) -> None:
    with Stepping(exported("double_pendulum").path) as host:
        host.start({"Q_theta1": 1.0}).step(0.5)
        states = host.states
        accelerations = host.get(["theta1_ddot", "theta2_ddot"])
        assert rates_of(host, states, 1).tolist() == [*host.get(states[2:]), *accelerations]
        assert rates_of(host, states[:2], 2).tolist() == accelerations


def test_an_input_that_is_led_moves_the_outputs(exported) -> None:
    """y = y0 - l cos(theta): its derivatives take those of y0, which is an input of its own beside y0_dot."""
    with Stepping(exported("motion_driven_pendulum").path) as host:
        host.start({"l": 2.0})
        still = rates_of(host, ["y"], 1), rates_of(host, ["y"], 2)
        host.unit.setRealInputDerivatives([host.references["y0"]] * 2, [1, 2], [7.0, 11.0])
        assert rates_of(host, ["y"], 1) - still[0] == pytest.approx(7.0)
        assert rates_of(host, ["y"], 2) - still[1] == pytest.approx(11.0)


def test_what_is_declared() -> None:
    """What the tests above hold the FMU to is what modelDescription.xml says."""
    from lag2fmu.codegen import DEFAULT_SOLVER
    from lag2fmu.dynamics import derive, lower
    from lag2fmu.fmu.backends.native import describe
    from lag2fmu.fmu.versions.fmi2 import to_xml

    equations = derive(load("pendulum"))
    text = to_xml(describe(load("pendulum"), equations, lower(equations), DEFAULT_SOLVER)[0]).decode()
    assert text.count('canInterpolateInputs="true"') == text.count('maxOutputDerivativeOrder="2"') == 1


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda unit, r: unit.setRealInputDerivatives([r["Q_theta"]], [4], [1.0]), "expected 1 to 3"),
        (lambda unit, r: unit.setRealInputDerivatives([r["Q_theta"]], [0], [1.0]), "expected 1 to 3"),
        (lambda unit, r: unit.setRealInputDerivatives([r["theta"]], [1], [1.0]), "theta is not an input"),
        (lambda unit, r: unit.setRealInputDerivatives([r["Q_theta"]], [1], [math.nan]), "finite"),
        (lambda unit, r: unit.setRealInputDerivatives([999], [1], [1.0]), "999"),
        (lambda unit, r: unit.getRealOutputDerivatives([r["theta"]], [3]), "expected 1 to 2"),
        (lambda unit, r: unit.getRealOutputDerivatives([r["p_theta"]], [1]), "p_theta is not an output"),
    ],
)
def test_refusals(call, words: str, exported) -> None:
    with Stepping(exported("pendulum").path) as host:
        host.start().step(0.1)
        with pytest.raises(FMICallException):
            call(host.unit, host.references)
        assert words in host.sentences[-1]


def test_output_derivatives_before_the_end_of_initialization_are_given(exported) -> None:
    with Stepping(exported("pendulum").path) as host:
        host.set({"theta_dot": 0.7})
        host.unit.setupExperiment()
        host.unit.enterInitializationMode()
        host.unit.setRealInputDerivatives([host.references["Q_theta"]], [1], [2.0])
        assert rates_of(host, ["theta"], 1) == [0.7]
