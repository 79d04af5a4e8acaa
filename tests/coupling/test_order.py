"""A cart and a wagon with a spring between them, as two FMUs and as one mechanism: the order of the coupling's error.

Source of the orders: M. Arnold, C. Clauss, T. Schierz, Error analysis and error estimates for co-simulation in FMI for
Model Exchange and Co-Simulation v2.0, Archive of Mechanical Engineering 60 (2013), section 4.
"""

from __future__ import annotations

import re
from math import log10
from pathlib import Path

import numpy as np
import pytest
from master import Wire, run
from stepping import Stepping
from train import CAR, WAGON_ALONE, K, M, W, X, Y, wagon_in_one_piece

pytestmark = pytest.mark.fmu

STEPS = (0.01, 0.001)


def error(exported, degree: int, step: float) -> float:
    """The largest error of the wagon's position in 1 s, in m."""
    wires = [Wire("wagon", "x", "cart", "y"), Wire("cart", "f", "wagon", "F")]
    path = exported(CAR).path
    with Stepping(path) as cart, Stepping(path) as wagon:
        cart.start(tolerance=1e-11)
        wagon.start(WAGON_ALONE, tolerance=1e-11)
        found = run({"cart": cart, "wagon": wagon}, wires, step, round(1.0 / step), degree, wires[0])
    return float(np.abs(np.array(found) - wagon_in_one_piece()[:: round(1000 * step)]).max())


def test_the_mechanism_in_one_piece_is_known() -> None:
    """The mass centre rests, and the two swing against each other."""
    times = np.linspace(0.0, 1.0, 1001)
    swing = (X - Y) * np.cos(np.sqrt(K / M + K / W) * times)
    assert wagon_in_one_piece() == pytest.approx((M * X + W * Y - M * swing) / (M + W), abs=1e-11)


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_derivatives_of_inputs_raise_the_order(degree: int, exported) -> None:
    """Order 1 with held inputs, 2 and 3 with first and second derivatives; figures as in docs/coupling.md."""
    errors = [error(exported, degree, step) for step in STEPS]
    assert log10(errors[0] / errors[1]) == pytest.approx(degree + 1, abs=0.1)
    text = Path(__file__).parents[2].joinpath("docs", "coupling.md").read_text("utf-8")
    row = re.search(rf"^\| {degree} \|.*\| ([\d.e-]+) \| ([\d.e-]+) \|$", text, re.MULTILINE)
    assert row is not None
    assert errors == pytest.approx([float(x) for x in row.groups()], rel=0.05)
