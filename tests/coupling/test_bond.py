"""Two mechanisms that are cut at a joint: force in and motion out on one side, motion in and force out on the other."""

from __future__ import annotations

import re
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from master import Wire, run
from ssp_reader import read_ssp
from stepping import Stepping
from sympy import cos, sin

import lag2fmu
from lag2fmu.dynamics.lagrange import with_derived
from lag2fmu.mechanism import Body, Mechanism, Ports, coordinate, signal
from lag2fmu.reference import integrate

pytestmark = [pytest.mark.fmu, pytest.mark.slow]

M, m, l, g = 4.0, 0.5, 0.6, 9.81  # noqa: E741


@cache
def cart() -> Mechanism:
    x = coordinate("x", "m")
    return Mechanism("cart", coordinates=[x], bodies=[Body("cart", M, (x, 0))])


def bob(x, theta) -> Body:
    return Body("bob", m, (x + l * sin(theta), -l * cos(theta)))


@cache
def hanging() -> Mechanism:
    """A pendulum on a support that the other side moves, which tells the force that this takes."""
    theta, x0 = coordinate("theta", "rad", start=0.8), signal("x0", "m", motion=True)
    return Mechanism(
        "hanging",
        coordinates=[theta],
        inputs=[x0],
        bodies=[bob(x0, theta)],
        gravity=g,
        ports=Ports(drives=["x0"]),
    )


def in_one_piece() -> Mechanism:
    x, theta = coordinate("x", "m"), coordinate("theta", "rad", start=0.8)
    return Mechanism("whole", coordinates=[x, theta], bodies=[Body("cart", M, (x, 0)), bob(x, theta)], gravity=g)


def test_terminals_bind_two_mechanisms(exported, tmp_path: Path) -> None:
    """One word connects place, velocity and force, which changes its sign; the error is of order 1 with held inputs.

    The acceleration is a local variable of the cart, no member of its terminal, and connected by itself. The force has
    the mass of the bob in it, so that the heavier side has to be the one that it acts on.
    """
    fmus = {"cart": exported(cart()), "hanging": exported(hanging())}
    path = lag2fmu.ssp(fmus, tmp_path / "bond.ssp", connect=["cart.x:hanging.x0", "cart.x_ddot:hanging.x0_ddot"])
    found = read_ssp(path)
    pairs = {(".".join(source), ".".join(target)): factor for (source, target), factor in found.factors.items()}
    assert pairs[("cart.x", "hanging.x0")] == 1.0
    assert pairs[("hanging.F_x0", "cart.Q_x")] == -1.0
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
    truth = integrate(with_derived(in_one_piece()), np.linspace(0.0, 1.0, 101), rtol=1e-11).trajectory["x"]
    errors = [np.abs(coupled(found, tmp_path, h)[:: round(0.01 / h)] - truth).max() for h in (0.002, 0.001)]
    assert errors[1] < 5e-3 * np.abs(truth).max()
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_repeated_exchange_keeps_the_order(degree: int, exported) -> None:
    """One exchange a step leaves order 1, eight leave degree + 1; figures as in docs/coupling.md."""
    paths = [exported(cart(), outputs=("x_ddot",)).path, exported(hanging()).path]
    truth = integrate(with_derived(in_one_piece()), np.linspace(0.0, 1.0, 101), rtol=1e-11).trajectory["x"]
    text = Path(__file__).parents[2].joinpath("docs", "coupling.md").read_text("utf-8")
    for rounds in (1, 8):
        row = re.search(rf"^\| {degree} \| {rounds} \| ([\d.e-]+) \| ([\d.e-]+) \|$", text, re.MULTILINE)
        assert row is not None
        found = [error(*paths, h, degree, rounds, truth) for h in (0.01, 0.001)]
        assert found == pytest.approx([float(x) for x in row.groups()], rel=0.05)


def error(first: Path, second: Path, step: float, degree: int, rounds: int, truth: np.ndarray) -> float:
    """The largest error of the cart's place in 1 s (m), with ``rounds`` exchanges of acceleration and force a step."""
    motion = [Wire("cart", name, "hanging", name.replace("x", "x0")) for name in ("x", "x_dot", "x_ddot")]
    wires = [*motion[:2], *([motion[2], Wire("hanging", "F_x0", "cart", "Q_x", -1.0)] * rounds)]
    with Stepping(first) as one, Stepping(second) as other:
        units = {"cart": one.start(tolerance=1e-11), "hanging": other.start(tolerance=1e-11)}
        found = run(units, wires, step, round(1.0 / step), degree, Wire("cart", "x", "", ""))
    return float(np.abs(np.array(found)[:: round(0.01 / step)] - truth).max())


def coupled(found, folder: Path, step: float) -> np.ndarray:
    """The place of the cart after each step until 1 s."""
    with Stepping(folder / found.components["cart"]) as one, Stepping(folder / found.components["hanging"]) as other:
        units = {"cart": one.start(tolerance=1e-10), "hanging": other.start(tolerance=1e-10)}
        wires = [Wire(*source, *target, factor) for (source, target), factor in found.factors.items()]
        wires.sort(key=lambda wire: wire.source.startswith("F_"))
        return np.array(run(units, wires, step, round(1.0 / step), 0, Wire("cart", "x", "", "")))
