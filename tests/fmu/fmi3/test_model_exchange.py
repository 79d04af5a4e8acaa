"""Model exchange by FMI 3.0: states, derivatives, indicators, events; the importer's solver is a step of Euler's or
FMPy's CVode."""

from __future__ import annotations

import math
from ctypes import byref, c_double, c_size_t

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Model
from stepping3 import Stepping3

pytestmark = pytest.mark.fmu

G, E = 9.81, 0.8
T1 = math.sqrt(2.0 / G)


@pytest.fixture
def ball(exported):
    """The FMU of a bouncing ball."""
    return exported("bouncing_ball", fmi="3.0").path


def vector(unit: Stepping3, function: str, size: int) -> list[float]:
    """The numbers that a function writes."""
    values = (c_double * size)()
    getattr(unit.unit, function)(unit.unit.component, values, size)
    return list(values)


def test_an_impact(ball) -> None:
    with Stepping3(ball, "ModelExchange") as unit:
        count = c_size_t()
        unit.unit.fmi3GetNumberOfContinuousStates(unit.unit.component, byref(count))
        assert count.value == 3
        unit.unit.fmi3GetNumberOfEventIndicators(unit.unit.component, byref(count))
        indicators = count.value
        assert indicators == len(unit.description.eventIndicators)
        unit.start()
        unit.unit.setTime(T1)
        unit.set({"y": -1e-8, "y_dot": -G * T1})
        assert vector(unit, "fmi3GetContinuousStateDerivatives", 3) == [-G * T1, -G, 0.0]
        listed = [variable.variable.name for variable in unit.description.eventIndicators]
        values = vector(unit, "fmi3GetEventIndicators", indicators)
        assert unit.get(listed) == values
        assert min(values) < 0.0
        assert unit.unit.completedIntegratorStep() == (False, False)
        unit.unit.enterEventMode()
        assert vector(unit, "fmi3GetContinuousStates", 3)[1] == -G * T1
        clock = [unit.references["floor_impact"]]
        assert unit.unit.updateDiscreteStates() == (True, False, False, True, False, 0.0)
        assert unit.unit.getClock(clock) == [True]
        assert unit.unit.updateDiscreteStates() == (False, False, False, True, False, 0.0)
        assert unit.unit.getClock(clock) == [False]
        unit.unit.enterContinuousTimeMode()
        states = vector(unit, "fmi3GetContinuousStates", 3)
        late = 1e-8 / (G * T1)  # since the gap was 0, in a step of T1: the ball has risen again since
        assert states[:2] == pytest.approx([E * 1e-8, E * G * T1 - (1 + E) * G * late], rel=1e-13, abs=1e-13)
        assert min(vector(unit, "fmi3GetEventIndicators", indicators)) > 0.0
        unit.unit.enterEventMode()
        assert unit.unit.updateDiscreteStates() == (False, False, False, False, False, 0.0)


def test_cvode_lets_the_ball_bounce(ball, monkeypatch: pytest.MonkeyPatch) -> None:
    """FMPy sees each impact of the first 3 s once; the height is that of the closed form."""
    entered, enter = [], FMU3Model.enterEventMode
    monkeypatch.setattr(FMU3Model, "enterEventMode", lambda unit: entered.append(enter(unit)))
    run = fmpy.simulate_fmu(
        str(ball),
        fmi_type="ModelExchange",
        stop_time=3.0,
        relative_tolerance=1e-10,
        output_interval=0.05,
        output=["y", "floor_impacts"],
    )
    fallen, bounce = T1, 0
    while fallen + 2.0 * T1 * E ** (bounce + 1) < 3.0:
        bounce += 1
        fallen += 2.0 * T1 * E**bounce
    speed, since = G * T1 * E ** (bounce + 1), 3.0 - fallen
    assert run["y"][-1] == pytest.approx(speed * since - 0.5 * G * since**2, abs=1e-6)
    assert run["floor_impacts"][-1] == bounce + 1 == len(entered)


def test_sizes_count_elements(exported) -> None:
    """Arrays of two coordinates: one value reference, two numbers."""
    with Stepping3(exported("double_pendulum", fmi="3.0", arrays=True).path) as unit:
        unit.start()
        q, qd, inputs = (unit.references[name] for name in ("q", "qd", "Q"))
        assert len(unit.unit.getFloat64([q, qd, 0], 5)) == 5
        unit.unit.setFloat64([inputs], [1.0, -2.0])
        assert unit.unit.getFloat64([inputs, q], 4)[:2] == [1.0, -2.0]
        with pytest.raises(FMICallException):
            unit.unit.getFloat64([q, qd], 3)
    assert "the array of values has 3 elements; the 2 variables have 4 in all" in unit.log[-1][2]


@pytest.mark.slow
def test_accelerations_that_were_read_before_an_event_are_those_after_it_too(exported) -> None:
    """A block of 1 kg on a belt that a spring of 1 N/m draws back: it sticks up to 1 N, and slides under 0.5 N."""
    with Stepping3(exported("block_on_belt", fmi="3.0").path, "ModelExchange") as unit:
        unit.start()
        unit.set({"x": 1.1})
        unit.unit.enterEventMode()
        assert unit.get(["x_ddot"]) == pytest.approx([0.0], abs=1e-12)
        unit.unit.updateDiscreteStates()
        assert unit.get(["x_ddot"]) == pytest.approx([0.5 - 1.1], rel=1e-12)
