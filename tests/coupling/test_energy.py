"""What a run of a system tells of its coupling: energy made in bonds, steps, repetitions, and what is not judged."""

from __future__ import annotations

import numpy as np
import pytest
from by_hand import XML, by_hand
from click.testing import CliRunner
from train import CAR, WAGON_ALONE, K, M, W

import lag2fmu
from lag2fmu.cli import main
from lag2fmu.mechanism import Body, Mechanism, coordinate, signal
from lag2fmu.systems.coupling import SystemRun

pytestmark = pytest.mark.fmu

CONNECT = ("wagon.x:cart.y", "cart.f:wagon.F")
VALUES = {f"wagon.{name}": value for name, value in WAGON_ALONE.items()}


x, v = coordinate("x", "m"), signal("v", "m/s")
DRIVEN = Mechanism("driven", coordinates=[x], inputs=[v], bodies=[Body("car", 1.0, (x, 0))], forces={x: v - x.dot})
"""A mass that a damper pulls along."""


def energy(run: SystemRun) -> np.ndarray:
    """Of cart, wagon and the spring between them, in J; nothing takes any out but the coupling."""
    stretched = run["cart.x"] - run["wagon.x"]
    return M / 2 * run["cart.x_dot"] ** 2 + W / 2 * run["wagon.x_dot"] ** 2 + K / 2 * stretched**2


@pytest.mark.parametrize(
    ("fmi", "chosen", "accuracy"),
    [
        ("2.0", {"hold": True, "step": 0.01}, 1e-8),
        ("3.0", {"hold": True, "step": 0.002}, 1e-8),
        ("2.0", {"step": 0.01}, 2e-3),
        ("3.0", {"step": 0.01}, 0.1),
        ("2.0", {}, 2e-3),
    ],
)
def test_the_energy_that_the_coupling_makes(fmi: str, chosen: dict, accuracy: float, exported) -> None:
    """It is what the whole has more at the end: positive with held inputs, negative with second derivatives.

    Held inputs are counted exactly, others to the leading order in the step. Of inputs that go on to order 1 the
    terms of force and motion nearly cancel in an oscillation, so that a tenth is missed.
    """
    car = exported(CAR, fmi=fmi)
    precise = {"tolerance": 1e-11} if chosen else {}
    run = lag2fmu.simulate(
        {"cart": car, "wagon": car}, connect=CONNECT, values=VALUES, stop_time=1.0, **chosen, **precise
    )
    whole = energy(run)
    (bond,) = run.coupling.bonds
    assert (bond.effort, bond.motion) == ("cart.f:wagon.F", "wagon.x:cart.y")
    assert bond.made == pytest.approx(whole[-1] - whole[0], rel=accuracy)
    assert (bond.made > 0) == bool(chosen.get("hold"))
    assert bond.exchanged > whole[0]
    assert run.coupling.unjudged == ()


def test_steps_repetitions_and_what_is_not_judged(exported) -> None:
    car, ball = exported(CAR), exported("bouncing_ball")
    parts = {"cart": car, "wagon": car}
    run = lag2fmu.simulate(parts, connect=CONNECT, values=VALUES, stop_time=1.0, tolerance=1e-8)
    facts = run.coupling
    assert facts.repeated > 0
    assert facts.jumps == 0
    assert facts.error < 1e-8
    assert facts.shortest < facts.longest
    assert facts.steps * facts.shortest < 1.0 < facts.steps * facts.longest
    run = lag2fmu.simulate({"car": exported(DRIVEN), "ball": ball}, connect=["ball.y_dot:car.v"], stop_time=1.0)
    assert 0 < run.coupling.jumps < 40, "impacts are passed by steps of the shortest length, which are counted"
    assert run.coupling.bonds == ()
    (sentence,) = run.coupling.unjudged
    assert sentence == "the energy of ball.y_dot to car.v: no one motion comes back whose product with it is a power"


def test_a_system_that_cannot_repeat_says_so(tmp_path) -> None:
    other = by_hand(tmp_path / "o.fmu", description=XML.replace('canGetAndSetFMUstate="true"', ""))
    run = lag2fmu.simulate({"a": other, "b": other}, connect=["a.x:b.u"], stop_time=1.0)
    first, second = run.coupling.unjudged
    assert first == (
        "the length of the steps: inputs of 'b' are held within steps and 'a', 'b' cannot go "
        "back to a state before; halve --step and compare"
    )
    assert second == "the energy of a.x to b.u: the input has no unit"


def test_the_table_on_the_command_line(exported) -> None:
    car = exported(CAR).path
    words = ["simulate", f"cart={car}", f"wagon={car}", "--stop-time", "1", "--set", "wagon.m=2", "--set", "wagon.k=0"]
    for word in CONNECT:
        words += ["--connect", word]
    shown = CliRunner().invoke(main, words)
    assert shown.exit_code == 0, shown.output
    assert "coupling: " in shown.output
    assert "0 repeated; largest error of an input" in shown.output
    assert "cart.f:wagon.F, wagon.x:cart.y" in shown.output
    piped = CliRunner().invoke(main, [*words, "-o", "-"])
    assert "coupling: " not in piped.stdout
    assert "coupling: " in piped.stderr
