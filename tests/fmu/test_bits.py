"""Bit for bit the same after rollback, elsewhere, after reset, among a hundred; and what is refused."""

from __future__ import annotations

import json
import math
import os
import random
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from stepping import DISCARD, ERROR, Stepping, bits

from lag2fmu.fmu import Fmu
from lag2fmu.formats.loading import load
from lag2fmu.reference import integrate

pytestmark = pytest.mark.fmu

MODELS = [
    ("double_pendulum", "dopri5"),
    ("cart_pole", "dopri5"),
    ("motion_driven_pendulum", "dopri5"),
    ("cart_pole", "dop853"),
    ("cart_pole", "rk4"),
]
PUSHES = {
    "double_pendulum": {"Q_theta1": 0.7, "Q_theta2": -0.4},
    "cart_pole": {"F": 1.5, "Q_theta": 0.1},
    "motion_driven_pendulum": {"y0": 0.1, "y0_dot": 0.3, "y0_ddot": 2.0},
}


@pytest.fixture(params=MODELS, ids="-".join)
def case(request, exported) -> tuple[Fmu, dict[str, float]]:
    """An FMU, and inputs that push it."""
    model, solver = request.param
    return exported(model, solver=solver), PUSHES[model]


def lengths(count: int, seed: int = 1) -> list[float]:
    """Communication steps of changing length, in s."""
    generator = random.Random(seed)
    return [generator.choice([0.01, 0.0237, 0.1, 0.003]) for _ in range(count)]


def elsewhere(**request: object) -> object:
    """The answer of other_process.py to ``request``; a crash there fails the test."""
    here = Path(__file__)
    done = subprocess.run(
        [sys.executable, str(here.with_name("other_process.py"))],
        input=json.dumps(request),
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, f"exit code {done.returncode}: {done.stderr}"
    return json.loads(done.stdout)


# ---------------------------------------------------------------------------------------------------------- the same


def test_after_rollback(case) -> None:
    fmu, push = case
    ahead = lengths(6)
    with Stepping(fmu.path) as host:
        host.start(push)
        host.steps(5, 0.05)
        saved, time = host.unit.getFMUstate(), host.time
        first = [bits(host.step(length)) for length in ahead]
        host.set({name: -3 * value for name, value in push.items()})
        host.set({"g": 3.0})
        wrong = [bits(host.step(length)) for length in lengths(9, seed=2)]
        for _ in range(3):
            host.unit.setFMUstate(saved)
            host.time = time
            assert [bits(host.step(length)) for length in ahead] == first
        assert not set(wrong) & set(first), "the way that is taken back was another one"


def test_inputs_and_parameters_are_restored_too(case) -> None:
    fmu, push = case
    with Stepping(fmu.path) as host:
        host.start(push)
        host.step(0.1)
        saved = host.unit.getFMUstate()
        names = [*push, "l1" if "l1" in host.references else "l", "g"]
        before = bits(host.get(names))
        host.set({name: 2.0 + number for number, name in enumerate(names)})
        assert bits(host.get(names)) != before
        host.unit.setFMUstate(saved)
        assert bits(host.get(names)) == before


def test_a_saved_state_is_filled_again(case) -> None:
    """fmi2GetFMUstate with a block of its own overwrites it (FMI 2.0, section 2.1.8)."""
    fmu, push = case
    with Stepping(fmu.path) as host:
        host.start(push)
        block = host.unit.getFMUstate()
        host.steps(3, 0.1)
        address = block.value
        host.unit.fmi2GetFMUstate(host.unit.component, block)
        assert block.value == address
        later = bits(host.step(0.1))
        host.unit.setFMUstate(block)
        host.time = 0.3
        assert bits(host.step(0.1)) == later
        host.unit.freeFMUstate(block)
        assert not block.value
        host.unit.freeFMUstate(block)  # freeing NULL is no error


def test_reading_in_between_changes_nothing(case) -> None:
    fmu, push = case
    with Stepping(fmu.path) as quiet, Stepping(fmu.path) as read:
        quiet.start(push)
        read.start(push)
        for length in lengths(12):
            read.get(list(read.references))
            read.set(push)  # the same values once more
            read.unit.freeFMUstate(read.unit.getFMUstate())
            read.derivative([f"der_{name}" for name in read.states], {"g": 1.0})
            assert bits(read.step(length)) == bits(quiet.step(length))


def test_in_another_process(case) -> None:
    fmu, push = case
    with Stepping(fmu.path) as host:
        host.start({**push, "g": 9.5}, tolerance=1e-8)
        host.steps(7, 0.03)
        state, time = host.unit.serializeFMUstate(host.unit.getFMUstate()).hex(), host.time
        changed = {name: -value for name, value in push.items()}
        host.set(changed)
        expected = [bits(states) for states in host.steps(10, 0.07)]
    found = elsewhere(
        action="continue", path=str(fmu.path), state=state, time=time, count=10, length=0.07, inputs=changed
    )
    assert found == expected


def test_after_reset(case) -> None:
    fmu, push = case
    with Stepping(fmu.path) as fresh, Stepping(fmu.path) as used:
        fresh.start()
        expected = [bits(fresh.step(length)) for length in lengths(8)]
        used.start({**push, "g": 1.0, "solver_tolerance": 1e-3}, tolerance=1e-2, stop_time=50.0)
        used.steps(10, 0.2)
        used.unit.reset()
        used.start()
        assert [bits(used.step(length)) for length in lengths(8)] == expected


def test_reset_leaves_the_error_state(case) -> None:
    fmu, _ = case
    with Stepping(fmu.path) as fresh, Stepping(fmu.path) as broken:
        broken.start()
        with pytest.raises(FMICallException):
            broken.set({"g": math.nan})
        with pytest.raises(FMICallException, match="error"):
            broken.step(0.1)
        broken.unit.reset()
        assert bits(broken.start().step(0.1)) == bits(fresh.start().step(0.1))


def test_a_hundred_instances_do_not_disturb_each_other(exported) -> None:
    path = exported("double_pendulum").path
    starts = [{"theta1": 0.01 * number, "Q_theta2": 0.02 * number} for number in range(100)]

    def alone(values: dict[str, float]) -> list[str]:
        with Stepping(path) as host:
            host.start(values)
            return [bits(states) for states in host.steps(10, 0.05)]

    with ExitStack() as stack:
        hosts = [stack.enter_context(Stepping(path)).start(values) for values in starts]
        found: list[list[str]] = [[] for _ in hosts]
        order = [number for number in range(100) for _ in range(10)]
        random.Random(3).shuffle(order)
        for number in order:
            found[number].append(bits(hosts[number].step(0.05)))
        assert found == [alone(values) for values in starts]
    assert len({run[-1] for run in found}) == 100


def test_an_instance_that_is_freed_does_not_disturb_the_others(exported) -> None:
    path = exported("double_pendulum").path
    with Stepping(path) as expected, Stepping(path) as host:
        expected.start()
        host.start()
        for _ in range(5):
            with Stepping(path) as passing:
                passing.start({"theta1": 1.0}).step(0.3)
            assert bits(host.step(0.05)) == bits(expected.step(0.05))


# ------------------------------------------------------------------------------------------------------ saved states


def block_of(path: Path, kind: str = "CoSimulation") -> str:
    """The serialized state of a fresh instance, as hexadecimal digits."""
    with Stepping(path, kind) as host:
        host.start()
        text: str = host.unit.serializeFMUstate(host.unit.getFMUstate()).hex()
        return text


def test_foreign_and_damaged_states_are_refused(exported) -> None:
    """In a process of its own: a crash there fails this test and no other one."""
    fmu = exported("double_pendulum")
    foreign = {
        "pendulum": block_of(exported("pendulum").path),
        "of the same size": block_of(exported("double_pendulum", outputs=("kinetic_energy",)).path),
        "model exchange": block_of(fmu.path, "ModelExchange"),
    }
    assert len(foreign["of the same size"]) == len(block_of(fmu.path))
    found = elsewhere(action="attack", path=str(fmu.path), foreign=foreign)
    assert found.pop("afterwards") == ["the same"]
    for kind, answers in found.items():
        assert not {"accepted", "silent"} & set(answers), (kind, answers)
        assert all(answer.startswith("fmi2") for answer in answers), (kind, answers)
    assert "model exchange and co-simulation do not share states" in found["model exchange"][0]
    assert "GUID" in found["of the same size"][0]
    assert {"checksum" in answer for answer in found["bit flipped"]} == {True, False}


# ------------------------------------------------------------------------------------------------------ what is refused


def refused(action: Callable[[], object], status: int, host: Stepping) -> str:
    """The sentence with which ``action`` is refused."""
    host.log.clear()
    with pytest.raises(FMICallException) as caught:
        action()
    assert caught.value.status == status
    assert host.sentences, "nothing was logged"
    return host.sentences[-1]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["theta1", "theta2_dot", "Q_theta1", "m1", "solver_step"])
def test_values_that_are_not_finite(name: str, value: float, exported) -> None:
    with Stepping(exported("double_pendulum").path) as host:
        sentence = refused(lambda: host.set({name: value}), ERROR, host)
        assert f"variable {name} " in sentence
        assert "finite" in sentence


@pytest.mark.parametrize(
    ("model", "name", "value"),
    [("elastic_pendulum", "l0", -1.0), ("elastic_pendulum", "l0", 0.0), ("pendulum", "solver_tolerance", -1e-9)],
)
def test_values_out_of_range(model: str, name: str, value: float, exported) -> None:
    with Stepping(exported(model).path) as host:
        others = list(host.references)
        before = bits(host.get(others))
        sentence = refused(lambda: host.set({"g": 3.0, name: value}), DISCARD, host)
        assert f"variable {name} " in sentence
        assert "nothing was set" in sentence
        assert bits(host.get(others)) == before, "not even the one in range"
        host.start().step(0.1)


@pytest.mark.parametrize("tolerance", [0.0, -1e-6, 1e-16, 1.0, 2.0, math.inf, math.nan])
def test_tolerances_out_of_range(tolerance: float, exported) -> None:
    with Stepping(exported("pendulum").path) as host:
        sentence = refused(lambda: host.start(tolerance=tolerance), ERROR, host)
        assert "expected a relative tolerance of at least 2e-15" in sentence
    with Stepping(exported("pendulum").path) as host:
        if tolerance != 0.0:
            status = DISCARD if math.isfinite(tolerance) else ERROR
            refused(lambda: host.set({"solver_tolerance": tolerance}), status, host)


def test_a_value_at_its_bound_is_taken(exported) -> None:
    with Stepping(exported("elastic_pendulum").path) as host:
        host.set({"l0": 1e-6})
        assert host.get(["l0"]) == [1e-6]


@pytest.mark.parametrize("reference", [9999, 2**32 - 1])
def test_wrong_value_references(reference: int, exported) -> None:
    calls = [
        lambda unit: unit.setReal([reference], [1.0]),
        lambda unit: unit.getReal([1, reference]),
        lambda unit: unit.getDirectionalDerivative([reference], [1], [1.0]),
        lambda unit: unit.getDirectionalDerivative([1], [reference], [1.0]),
    ]
    for call in calls:
        with Stepping(exported("double_pendulum").path) as host:
            host.start()
            assert str(reference) in refused(lambda call=call, unit=host.unit: call(unit), ERROR, host)


@pytest.mark.parametrize(
    "name", ["time", "theta_ddot", "p_theta", "kinetic_energy", "x", "der_theta_dot", "theta", "solver_step"]
)
def test_what_cannot_be_set_between_steps(name: str, exported) -> None:
    with Stepping(exported("pendulum").path) as host:
        host.start().step(0.1)
        shown = {"der_theta_dot": "theta_ddot"}.get(name, name)
        assert shown in refused(lambda: host.set({name: 0.5}), ERROR, host)


@pytest.mark.parametrize("length", [0.0, -0.1, math.nan, math.inf])
def test_communication_steps_that_are_no_steps(length: float, exported) -> None:
    with Stepping(exported("pendulum").path) as host:
        host.start().step(0.1)
        assert "communication step" in refused(lambda: host.step(length), ERROR, host)


def test_a_communication_point_that_is_not_the_end_of_the_last_step(exported) -> None:
    with Stepping(exported("pendulum").path) as host:
        host.start().step(0.1)
        sentence = refused(lambda: host.unit.doStep(0.3, 0.1), ERROR, host)
        assert "0.3" in sentence or "0.29999" in sentence
        assert "0.1" in sentence


def test_steps_beyond_the_stop_time(exported) -> None:
    with Stepping(exported("pendulum").path) as host:
        host.start(stop_time=1.0)
        host.steps(10, 0.1)  # ten tenths are not exactly 1
        assert "stop time" in refused(lambda: host.step(0.1), ERROR, host)


def test_a_step_may_end_at_the_stop_time_only_to_rounding(exported) -> None:
    with Stepping(exported("pendulum").path) as host:
        host.start(stop_time=1.0)
        host.step(0.9)
        assert "stop time" in refused(lambda: host.step(0.101), ERROR, host)


def test_another_guid_is_refused(exported) -> None:
    with pytest.raises(Exception, match="Failed to instantiate"):
        Stepping(exported("pendulum").path, guid="{00000000-0000-0000-0000-000000000000}")


# ---------------------------------------------------------------------------------------------------------- parameters


def test_a_tunable_parameter_takes_effect_between_steps(exported) -> None:
    model = "double_pendulum"
    mechanism = load(model)
    names = [name for q in mechanism.coordinates for name in (q.name, f"{q.name}_dot")]
    with Stepping(exported(model).path) as host:
        host.start(tolerance=1e-10)
        host.step(1.0)
        before = dict(zip(names, host.get(names), strict=True))
        acceleration = host.get(["theta1_ddot", "theta2_ddot"])
        host.set({"l2": 0.4, "m1": 3.0})
        assert bits(host.get(names)) == bits(list(before.values())), "q and qd stay continuous"
        assert host.get(["theta1_ddot", "theta2_ddot"]) != pytest.approx(acceleration, rel=1e-2)
        host.step(1.0)
        after = dict(zip(names, host.get(names), strict=True))
    times = np.array([1.0, 2.0])
    expected = integrate(mechanism, times, starts=before, parameters={"l2": 0.4, "m1": 3.0}).trajectory
    unchanged = integrate(mechanism, times, starts=before).trajectory
    for name in names:
        assert after[name] == pytest.approx(expected[name][-1], abs=1e-8)
        assert abs(expected[name][-1] - unchanged[name][-1]) > 1e-2, "the parameters matter"


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_dependent_parameters_follow(kind: str, exported) -> None:
    with Stepping(exported("cart_pole").path, kind) as host:
        assert host.get(["I0"]) == [pytest.approx(0.3 / 12, rel=1e-15)]
        host.set({"m": 0.6})
        assert host.get(["I0"]) == [pytest.approx(0.6 / 12, rel=1e-15)]
        host.start({"l": 2.0})
        host.set({"m": 0.9})
        assert host.get(["I0"]) == [pytest.approx(0.9 * 4 / 12, rel=1e-15)]


def test_dependent_parameters_act(exported) -> None:
    """The pole of twice the length from outside is the pole that was declared with twice the length."""
    mechanism = load("cart_pole")
    with Stepping(exported("cart_pole").path) as host:
        host.start({"l": 2.0}, tolerance=1e-10)
        found = host.step(1.0)
    expected = integrate(mechanism, [0.0, 1.0], parameters={"l": 2.0}).trajectory
    assert found == pytest.approx([expected[name][-1] for name in host.states], abs=1e-8)


# ---------------------------------------------------------------------------------------------- directional derivatives

DERIVED = ["cart_pole", "double_pendulum", "elastic_pendulum", "motion_driven_pendulum", "slides_problem_6"]


def knowns_and_unknowns(host: Stepping) -> tuple[list[str], list[str]]:
    """States, inputs and independent tunable parameters; and everything that is calculated."""
    variables = host.description.modelVariables
    knowns = [v.name for v in variables if v.causality in ("input", "parameter") and v.variability != "fixed"]
    unknowns = [v.name for v in variables if v.initial == "calculated"]
    return host.states + knowns, unknowns


def scattered(host: Stepping, names: list[str], seed: int) -> dict[str, float]:
    """Values of ``names`` off the start, in the range of the equations."""
    generator = random.Random(seed)
    return {name: value + generator.uniform(0.05, 0.3) for name, value in zip(names, host.get(names), strict=True)}


def differences(host: Stepping, point: dict[str, float], known: str, unknowns: list[str]) -> np.ndarray:
    """Central differences with an error of order 4."""
    h = 1e-3
    values = {}
    for k in (-2, -1, 1, 2):
        host.set({known: point[known] + k * h})
        values[k] = np.array(host.get(unknowns))
    host.set({known: point[known]})
    return (8 * (values[1] - values[-1]) - (values[2] - values[-2])) / (12 * h)


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize("model", DERIVED)
def test_directional_derivatives_are_the_limits_of_differences(model: str, kind: str, exported) -> None:
    """In initialization mode (both kinds) and in continuous-time mode, where everything can be varied."""
    with Stepping(exported(model).path, kind) as host:
        if kind == "ModelExchange":
            host.start()
        else:
            host.unit.setupExperiment()
            host.unit.enterInitializationMode()
        knowns, unknowns = knowns_and_unknowns(host)
        point = scattered(host, knowns, seed=5)
        host.set(point)
        total = np.zeros(len(unknowns))
        for number, known in enumerate(knowns, start=1):
            exact = np.array(host.derivative(unknowns, {known: 1.0}))
            expected = differences(host, point, known, unknowns)
            assert exact == pytest.approx(expected, rel=1e-7, abs=1e-7 * max(1.0, np.abs(expected).max())), known
            total += number * exact
        seed = {known: float(number) for number, known in enumerate(knowns, start=1)}
        assert host.derivative(unknowns, seed) == pytest.approx(total, rel=1e-11, abs=1e-10), "linear in the seed"


@pytest.mark.parametrize("model", DERIVED)
def test_co_simulation_derives_like_model_exchange_after_a_step(model: str, exported) -> None:
    path = exported(model).path
    with Stepping(path) as slave, Stepping(path, "ModelExchange") as free:
        slave.start()
        slave.step(0.37)
        free.start()
        free.set(dict(zip(slave.states, slave.get(slave.states), strict=True)))
        free.unit.setTime(slave.time)
        knowns, unknowns = knowns_and_unknowns(slave)
        for known in knowns:
            assert slave.derivative(unknowns, {known: 1.0}) == free.derivative(unknowns, {known: 1.0})


def test_derivative_along_time(exported) -> None:
    """Of the driven pendulum l theta_ddot = -(g + y0_ddot) sin(theta) - ..., with y0 = A cos(Omega t)."""
    with Stepping(exported("vertically_driven_pendulum").path, "ModelExchange") as host:
        host.start({"theta": 0.7})
        host.unit.setTime(0.3)
        expected = -0.05 * 10.0**3 * np.sin(3.0) * np.sin(0.7)
        assert host.derivative(["der_theta_dot"], {"time": 1.0}) == [pytest.approx(expected, rel=1e-12)]
