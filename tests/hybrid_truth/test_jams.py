"""A slip that turns until its contact loses its lever: the normal force grows beyond all bounds, and the contact jams.

The reference follows the slide by the normal impulse, in which nothing has a pole: dt = a(d) dp / (F W_zz), where the
lever a(d) = W_zz - mu W_zt d falls to 0 as the direction d of the slip turns (Genot, Brogliato, New results on Painleve
paradoxes, Eur. J. Mech. A 1999).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from lag2fmu import export
from lag2fmu.formats.text import read
from lag2fmu.verify.simulate import Run, simulate_fmu

pytestmark = pytest.mark.fmu

MOBILITY = np.array([[1.0, 0.0, 0.8], [0.0, 1.0, 0.0], [0.8, 0.0, 1.0]])
"""The inverse of the inertia along x, y, z."""

LOAD, FRICTION = 10.0, 1.5

TEXT = f"""
[mechanism]
name = "jam"
[coordinates]
x = {{ velocity = 0.6 }}
y = {{ velocity = 0.8 }}
z = {{ }}
[energy]
kinetic = "(x_dot**2 - 1.6*x_dot*z_dot + z_dot**2)/0.72 + y_dot**2/2"
potential = "{LOAD}*z"
[contacts.foot]
gap = "z"
slip = ["x_dot", "y_dot"]
friction = {FRICTION}
"""


def _push(slip: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a normal impulse of 1 changes the velocities by, friction included."""
    return np.asarray(MOBILITY @ np.append(-FRICTION * np.asarray(slip) / np.hypot(*slip), 1.0))


def _jam() -> NDArray[np.float64]:
    """t (s), x, y (m) where the lever is 0."""

    def slide(_: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        slip, change = np.asarray(state[3:]), _push(state[3:])
        time = change[2] / (LOAD * MOBILITY[2, 2])
        return np.concatenate(([time], slip * time, change[:2] - LOAD * MOBILITY[:2, 2] * time))

    def lever(_: float, state: NDArray[np.float64]) -> float:
        return float(_push(state[3:])[2])

    lever.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(slide, (0, 5), [0, 0, 0, 0.6, 0.8], events=lever, rtol=1e-12, atol=1e-14)
    return np.asarray(found.y[:3, -1])


@pytest.mark.parametrize(("solver", "tolerance"), [("dopri5", 1e-6), ("dopri5", 1e-9), ("radau5", 1e-9)])
def test_a_contact_without_a_lever_stops_its_slip(solver: str, tolerance: float, tmp_path: Path) -> None:
    """From there on what is pressed at x and y sticks: its limit, mu = 1.5, is above W_xz / W_xx = 0.8."""
    sentences: list[str] = []
    fmu = export(read(TEXT, "jam"), tmp_path / "jam.fmu", solver=solver)
    run = simulate_fmu(fmu.path, Run(0.02, 0.001, tolerance, warned=sentences.append))
    time, x, y = _jam()
    (sentence,) = sentences
    assert "an impact without a collision stopped the slip" in sentence
    told = re.search("at time ([^ ]+) s", sentence)
    assert told
    assert float(told[1]) == pytest.approx(time, rel=10 * tolerance)
    assert run["x"][-1] == pytest.approx(x, rel=10 * tolerance)
    assert run["y"][-1] == pytest.approx(y, rel=10 * tolerance)
    assert run["x_dot"][-1] == pytest.approx(0, abs=1e-12)
