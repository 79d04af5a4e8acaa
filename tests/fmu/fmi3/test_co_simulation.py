"""Co-simulation by FMI 3.0: the numbers of 2.0, event mode, early return, intermediate updates, saved states.

The ball is dropped from 1 m, e = 0.8, g = 9.81: impacts at t1, t1 (1 + 2e), ..., rest at t1 (1 + e)/(1 - e) in closed
form.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from stepping import Stepping, bits
from stepping3 import Stepping3

pytestmark = pytest.mark.fmu

NAMES = ["y", "y_dot", "y_ddot", "dissipated_energy"]
TIMES = [k * 0.01 for k in range(451)]
G, E = 9.81, 0.8
T1 = math.sqrt(2.0 / G)
IMPACTS = [T1 * (1.0 + 2.0 * sum(E**i for i in range(1, k + 1))) for k in range(10)]
REST = T1 * (1.0 + E) / (1.0 - E)


@pytest.fixture
def ball(exported):
    """The FMU of a bouncing ball."""
    return exported("bouncing_ball", fmi="3.0").path


@pytest.mark.parametrize(("events", "early"), itertools.product([False, True], repeat=2))
def test_the_trajectory_is_that_of_2_0(exported, ball, events: bool, early: bool) -> None:
    with Stepping(exported("bouncing_ball").path) as unit:
        unit.start(stop_time=5.0)
        expected = [unit.get(NAMES)]
        for start, end in itertools.pairwise(TIMES):
            unit.unit.doStep(start, end - start)
            expected.append(unit.get(NAMES))
    with Stepping3(ball, events=events, early=early) as unit3:
        rows, times = unit3.start(stopTime=5.0).run(TIMES, NAMES)
    assert list(map(bits, rows)) == list(map(bits, expected))
    assert bool(times) == (events and early)
    if times:
        assert times[:10] == pytest.approx(IMPACTS, abs=1e-13)
        assert times[-1] == pytest.approx(REST, abs=1e-9)


def test_a_clock_ticks_once_an_impact(ball) -> None:
    with Stepping3(ball, events=True, early=True) as unit:
        unit.start(stopTime=5.0)
        clock, count = [unit.references["floor_impact"]], [unit.references["floor_impacts"]]
        event, _, early, last = unit.unit.doStep(0.0, 1.0)
        assert (event, early) == (True, True)
        assert last == pytest.approx(T1, abs=1e-14)
        before = unit.get(["y_dot"])[0]
        unit.unit.enterEventMode()
        assert (unit.unit.getClock(clock), unit.unit.getInt32(count)) == ([False], [0])
        assert unit.unit.updateDiscreteStates()[0] is True
        assert (unit.unit.getClock(clock), unit.unit.getInt32(count)) == ([True], [1])
        assert unit.get(["y_dot"])[0] == pytest.approx(-E * before, rel=1e-14)
        assert unit.unit.updateDiscreteStates()[0] is False
        assert unit.unit.getClock(clock) == [False]
        unit.unit.enterStepMode()


def test_a_state_saved_within_an_event(ball) -> None:
    """Before the impact, while the clock ticks, and after it, within the instance and, serialized, in another one."""
    steps = [0.6 + 0.01 * k for k in range(200)]
    with Stepping3(ball, events=True, early=True) as unit, Stepping3(ball, events=True, early=True) as other:
        unit.start(stopTime=5.0)
        last = unit.unit.doStep(0.0, 0.6)[3]
        unit.unit.enterEventMode()
        saved = [unit.unit.getFMUState()]
        for _ in range(2):
            unit.unit.updateDiscreteStates()
            saved.append(unit.unit.getFMUState())
        clocks = []
        runs = set()
        for state in saved:
            copy = other.unit.deserializeFMUState(unit.unit.serializeFMUState(state))
            for each, kept in ((unit, state), (other, copy)):
                each.unit.setFMUState(kept)
                clocks.append(each.unit.getClock([each.references["floor_impact"]])[0])
                each.settle()
                rows, _ = each.run([last, *steps], NAMES)
                runs.add(tuple(map(bits, rows[1:])))
                each.unit.freeFMUState(kept)
    assert clocks == [False, False, True, True, False, False]
    assert len(runs) == 1


def test_inputs_before_and_after_an_event(ball) -> None:
    """A force that begins at the impact: the acceleration has a value before and after it, and no event is lost."""
    with Stepping3(ball, events=True, early=True) as unit:
        unit.start(stopTime=5.0)
        last = unit.unit.doStep(0.0, 1.0)[3]
        assert unit.get(["y_ddot"]) == [-G]
        unit.unit.enterEventMode()
        unit.set({"Q_y": 1.0})
        assert unit.get(["y_ddot", "y_dot"]) == pytest.approx([-G + 2.0, -G * T1])
        assert [result[0] for result in unit.settle()] == [True, False]
        assert unit.get(["y_ddot"]) == pytest.approx([-G + 2.0])
        assert unit.unit.getInt32([unit.references["floor_impacts"]]) == [1]
        up = E * G * T1
        assert unit.get(["y_dot"])[0] == pytest.approx(up, rel=1e-13)
        event, _, _, again = unit.unit.doStep(last, 2.0)
    assert event
    assert again - last == pytest.approx(2.0 * up / (G - 2.0), rel=1e-10)


def test_an_event_that_the_importer_ignores_is_passed(ball) -> None:
    with Stepping3(ball, events=True, early=True) as unit:
        unit.start(stopTime=5.0)
        last = unit.unit.doStep(0.0, 0.6)[3]
        _, _, early, end = unit.unit.doStep(last, 0.6 - last)
        assert (early, end) == (False, 0.6)
        assert unit.unit.getInt32([unit.references["floor_impacts"]]) == [1]


def test_intermediate_updates_are_the_ends_of_solver_steps(ball) -> None:
    """They tell the flight as it is, in order, and change nothing, also if derivatives are read in them."""
    seen: list[tuple[float, float, float]] = []

    def update(time: float, sets: bool, may: bool) -> None:
        assert (sets, may) == (False, False)
        y, y_dot = followed.get(["y", "y_dot"])
        followed.unit.getOutputDerivatives([followed.references["y_dot"]], [1])
        seen.append((time, y, y_dot))

    with Stepping3(ball, update=update, intermediate=["y", "y_dot"]) as followed, Stepping3(ball) as alone:
        rows, _ = followed.start(stopTime=5.0).run(TIMES, NAMES)
        expected, _ = alone.start(stopTime=5.0).run(TIMES, NAMES)
    assert list(map(bits, rows)) == list(map(bits, expected))
    times = np.array([time for time, *_ in seen])
    assert len(times) > 20
    assert (np.diff(times) >= 0.0).all()
    for time, y, y_dot in seen:
        if time <= IMPACTS[0]:
            assert (y, y_dot) == pytest.approx((1.0 - 0.5 * G * time**2, -G * time), abs=1e-12)


@pytest.mark.parametrize("ask", [0.0, 0.25, math.inf])
def test_an_early_return_is_made_at_the_time_that_was_asked_for(exported, ask: float) -> None:
    asked: list[float] = []

    def update(time: float, sets: bool, may: bool) -> float | None:
        if asked or time < 0.1:
            return None
        asked.append(min(time + ask, 2.0) if ask < math.inf else math.inf)
        return asked[0]

    path = exported("double_pendulum", fmi="3.0").path
    names = ["theta1", "theta2_dot"]
    with Stepping3(path, early=True, update=update) as unit, Stepping3(path) as other:
        event, _, early, last = unit.start(stopTime=3.0).unit.doStep(0.0, 2.0)
        assert (event, early, last) == (False, ask < math.inf, min(asked[0], 2.0))
        rows, _ = other.start(stopTime=3.0).run([0.0, last], names)
        assert unit.get(names) == pytest.approx(rows[-1], abs=1e-5)


def test_inputs_of_intermediate_updates_are_those_of_input_derivatives(exported) -> None:
    """A cubic torque, set in intermediate updates of 3.0 and by derivatives in 2.0."""

    def torque(t: float) -> list[float]:
        """The torque (N m) and its three derivatives by time."""
        return [1.0 + 2.0 * t - 3.0 * t**2 + t**3, 2.0 - 6.0 * t + 3.0 * t**2, -6.0 + 6.0 * t, 6.0]

    def update(time: float, sets: bool, may: bool) -> None:
        if sets:
            unit.set({"Q_theta1": torque(time)[0]})

    names = ["theta1", "theta2", "theta1_dot", "theta2_dot", "Q_theta1"]
    with Stepping(exported("double_pendulum").path) as old:
        old.start(stop_time=2.0, tolerance=1e-10)
        expected = []
        for k in range(20):
            value, *derivatives = torque(0.1 * k)
            old.set({"Q_theta1": value})
            reference = old.references["Q_theta1"]
            old.unit.setRealInputDerivatives([reference] * 3, [1, 2, 3], derivatives)
            old.step(0.1)
            expected.append(old.get(names))
    path = exported("double_pendulum", fmi="3.0").path
    with Stepping3(path, update=update, intermediate=["Q_theta1", "theta1"]) as unit:
        unit.set({"Q_theta1": torque(0.0)[0]})
        rows, _ = unit.start(stopTime=2.0, tolerance=1e-10).run([0.1 * k for k in range(21)], names)
    assert np.array(rows[1:]) == pytest.approx(np.array(expected), abs=1e-9)


def test_what_is_refused_in_an_intermediate_update(ball) -> None:
    def update(time: float, sets: bool, may: bool) -> None:
        with pytest.raises(FMICallException):
            unit.get(["y_dot"])

    with Stepping3(ball, update=update, intermediate=["y"], logging=False) as unit:
        unit.start(stopTime=5.0)
        with pytest.raises(FMICallException, match="error"):
            unit.unit.doStep(0.0, 1.0)
    [(status, category, sentence)] = unit.log
    assert (status, category) == (3, "logStatusError")
    assert "y_dot was not among the required intermediate variables" in sentence
