"""A scissor lift of five pairs of bars, which falls through the positions where all bars lie in one line."""

from collections.abc import Callable

import numpy as np
import pytest
import sympy as sp
from one_degree import OneDegree

import lag2fmu
from lag2fmu.mechanism import Body, Constraint, Mechanism, coordinate

pytestmark = pytest.mark.fmu

PAIRS, BAR, INERTIA, G, START = 5, 0.5, 0.02, 9.81, 0.8


def scissors() -> Mechanism:
    """Bars of mass 1, each with the place of its centre and its angle; one lower end is pinned, one slides."""
    bars, coordinates, rows = [], [], []

    def closed(name: str, difference: sp.Matrix) -> None:
        rows.extend(Constraint(f"{name}_{axis}", row) for axis, row in zip("xy", difference, strict=True))

    for i in range(2 * PAIRS):
        angle = START if i % 2 == 0 else np.pi - START
        places = BAR / 2 * np.cos(START), BAR * np.sin(START) * (i // 2 + 0.5)
        x, y = (
            coordinate(f"{axis}{i}", "m", guess=at, guess_velocity=0) for axis, at in zip("xy", places, strict=True)
        )
        given = {"start": angle} if i == 0 else {"guess": angle, "guess_velocity": 0}
        a = coordinate(f"a{i}", "rad", **given)
        half = BAR / 2 * sp.Matrix([sp.cos(a), sp.sin(a)])
        centre = sp.Matrix([x, y])
        bars.append((centre, centre - half, centre + half))
        coordinates += [x, y, a]
        if i % 2 == 1:
            closed(f"middle{i}", centre - bars[i - 1][0])
        if i > 1:  # its lower end is the upper end of the bar that leans the other way
            closed(f"end{i}", bars[i][1] - bars[i - 1 if i % 2 == 0 else i - 3][2])
    closed("pin", bars[0][1])
    rows.append(Constraint("slider", bars[1][1][1]))
    bodies = [
        Body(f"b{i}", 1, tuple(bars[i][0]), angle=coordinates[3 * i + 2], inertia=INERTIA) for i in range(2 * PAIRS)
    ]
    return Mechanism("scissors", coordinates=coordinates, bodies=bodies, constraints=rows, gravity=G)


def kinematics(a: complex) -> np.ndarray:
    """Place of the centre and angle of a bar of each pair: both bars move alike."""
    return np.array([part for i in range(PAIRS) for part in (BAR / 2 * np.cos(a), BAR * (i + 0.5) * np.sin(a), a)])


@pytest.mark.parametrize(("tolerance", "bar"), [(1e-10, 1e-6), (1e-12, 1e-6)])
def test_scissors_fall_through_their_folded_positions(tolerance: float, bar: float, exported: Callable) -> None:
    """Four equations are lost at once, or five. What was left of them ended runs, as did rounding that they blew up."""
    lift = OneDegree(kinematics, np.tile([1, 1, INERTIA], PAIRS), np.tile([0, G, 0], PAIRS))
    run = lag2fmu.simulate(exported(scissors()), stop_time=2.0, step=0.02, tolerance=tolerance)
    exact = lift.run(START, 0.0, run.time)
    assert np.count_nonzero(np.diff(np.floor(exact / (np.pi / 2)))) >= 2
    assert run["a0"] == pytest.approx(exact, abs=bar)
    assert run[f"a{2 * PAIRS - 1}"] == pytest.approx(np.pi - exact, abs=bar)
