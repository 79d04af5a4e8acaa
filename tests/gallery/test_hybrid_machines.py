"""Machines whose constraints, forces or states switch: closed forms and published numbers (g = 9.81)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import lag2fmu

pytestmark = pytest.mark.fmu

G = 9.81
OPEN, SLIDES = 1, 3


def test_a_gripper_takes_lifts_and_throws(motion) -> None:
    """The part rests, moves with the hand from t1 to t2, flies on with its velocity and stays on the table."""
    H, w, t1, t2 = 0.4, 3.0, 2.1, 2.8
    run = motion("gripper", 4.0, 200, 1e-10, ("z", "table_mode", "table_impacts"))
    hand, speed = H / 2 * (np.cos(w * t1) - np.cos(w * t2)), H / 2 * w * np.sin(w * t2)
    flight = hand + speed * (run.time - t2) - G * (run.time - t2) ** 2 / 2
    land = t2 + (speed + np.sqrt(speed**2 + 2 * G * hand)) / G
    held = H / 2 * (np.cos(w * t1) - np.cos(w * run.time))
    known = np.select([run.time < t1, run.time < t2, run.time < land], [0.0, held, flight], 0.0)
    assert run["z"] == pytest.approx(known, abs=1e-7)
    assert run["table_impacts"][-1] == 1
    clear = abs(run.time - t1) > 1e-9  # a communication point
    assert (run["table_mode"] == np.where((run.time > t1) & (run.time < land), OPEN, SLIDES))[clear].all()


def test_a_motor_runs_up_against_a_table(motion) -> None:
    """Between two points of the table current and speed follow a matrix exponential."""
    J, K, R, L, u = 0.002, 0.1, 0.5, 0.01, 24.0
    speeds, torques = np.array([0.0, 50.0, 100.0, 150.0, 200.0]), np.array([0.0, 0.1, 0.35, 0.8, 1.4])

    def piece(k: int) -> tuple[np.ndarray, np.ndarray]:
        """The matrix of (current, speed), and where it would come to rest."""
        slope = (torques[k + 1] - torques[k]) / (speeds[k + 1] - speeds[k])
        matrix = np.array([[-R / L, -K / L], [K / J, -slope / J]])
        return matrix, -np.linalg.solve(matrix, [u / L, -(torques[k] - slope * speeds[k]) / J])

    def after(t: np.ndarray | float, state: np.ndarray, k: int) -> np.ndarray:
        """The states (*times, 2) so long after ``state``."""
        matrix, rest = piece(k)
        return rest + expm(matrix * np.asarray(t)[..., None, None]) @ (state - rest)

    run = motion("dc_motor", 0.3, 100, 1e-10, ("i", "phi_dot"))
    start, state, known = 0.0, np.zeros(2), np.empty((101, 2))
    for k in range(4):
        later = run.time >= start - 1e-12
        known[later] = after(run.time[later] - start, state, k)
        fine = np.linspace(1e-9, 0.3, 300)
        beyond = fine[after(fine, state, k)[:, 1] > speeds[k + 1]]
        if not len(beyond):
            break
        length = brentq(lambda t, s=state, k=k: after(t, s, k)[1] - speeds[k + 1], 1e-9, beyond[0], xtol=1e-15)
        start, state = start + length, after(length, state, k)
    assert k >= 2
    assert run.values[:, 0] == pytest.approx(known[:, 0], abs=1e-5)
    assert run.values[:, 1] == pytest.approx(known[:, 1], abs=1e-5)


def test_a_load_drops_into_its_rope(motion) -> None:
    """It falls freely, loses the velocity along the rope when that is taut, and swings; the stop holds the trolley."""
    l, s = 1.5, 0.9  # noqa: E741
    depth = np.sqrt(l**2 - s**2)
    taut = np.sqrt(2 * depth / G)
    speed = G * taut * s / l  # across the rope
    stop = taut + 0.25
    run = motion("crane", stop, 100, 1e-10, ("x", "a", "b", "rope_mode", "end_lower_mode", "total_energy"))
    falling = run.time < taut
    assert run["a"][falling] == pytest.approx(np.full(falling.sum(), -s), abs=1e-9)
    assert run["b"][falling] == pytest.approx(-G * run.time[falling] ** 2 / 2, abs=1e-8)
    swing = solve_ivp(
        lambda t, q: [q[1], -G / l * np.sin(q[0])],
        (taut, stop),
        [-np.arcsin(s / l), speed / l],
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        t_eval=run.time[~falling],
    )
    assert (swing.y[0] < 0).all()
    assert run["a"][~falling] == pytest.approx(l * np.sin(swing.y[0]), abs=1e-7)
    assert run["b"][~falling] == pytest.approx(-l * np.cos(swing.y[0]), abs=1e-7)
    assert np.abs(run["x"]).max() <= 1e-9
    lost = ((G * taut) ** 2 - speed**2) / 2
    assert run["total_energy"][0] - run["total_energy"][-1] == pytest.approx(lost, rel=1e-7)
    assert (run["rope_mode"] == np.where(falling, OPEN, SLIDES)).all()


@pytest.mark.parametrize("solver", ["dopri5", "dop853"])
def test_a_crane_comes_to_rest_in_a_day(solver: str, exported) -> None:
    """Late in it trolley and load leave stop and rope by less than rounding shows, and come back at once."""
    names = ("rope_gap", "end_lower_gap", "end_upper_gap", "total_energy", "dissipated_energy")
    run = lag2fmu.simulate(exported("crane", solver=solver), stop_time=1e5, step=1e3, outputs=names)
    assert min(run[name].min() for name in names[:3]) > -1e-9
    assert run["total_energy"][-1] == pytest.approx(-9.81 * 1.5, abs=1e-5)
    assert run["total_energy"] + run["dissipated_energy"] == pytest.approx(0.0 * run.time, abs=1e-3)


def test_a_crane_is_the_same_in_model_exchange(exported) -> None:
    """Until after the trolley has left one stop and struck the other; the rope stays taut while the states drift."""
    path, outputs = exported("crane").path, ("x", "a", "b", "rope_mode", "end_upper_impacts")
    one, other = (
        lag2fmu.simulate(path, stop_time=4.5, step=0.05, outputs=outputs, kind=kind)
        for kind in ("co-simulation", "model-exchange")
    )
    assert other["end_upper_impacts"][-1] == one["end_upper_impacts"][-1] == 1
    assert other.values[-1] == pytest.approx(one.values[-1], abs=1e-3)


def test_a_woodpecker_comes_back_to_glockers_point(motion) -> None:
    """He gives a point of the cycle: phi_S = -0.2788, y_dot = -0.3411, phi_S_dot = -7.4583 while the sleeve slides.

    The run passes there again and again, every time the beak has struck once, and each turn nearer to the last.
    """
    outputs = ("y", "y_dot", "phi_S", "phi_S_dot", "bottom_mode", "beak_impacts")
    run = motion("woodpecker", 0.45, 900, 1e-8, outputs)
    angle, passed = run["phi_S"], []
    for i in np.flatnonzero((angle[:-1] > -0.2788) & (angle[1:] <= -0.2788) & (run["bottom_mode"][1:] > SLIDES)):
        part = (angle[i] + 0.2788) / (angle[i] - angle[i + 1])
        passed.append([run.time[i] + part * 0.0005, *(run.values[i] + part * (run.values[i + 1] - run.values[i]))])
    times, heights, speeds, _, rates, _, impacts = np.array(passed).T
    assert len(times) == 3
    assert list(impacts) == [1, 2, 3]
    assert speeds == pytest.approx(np.full(3, -0.3411), rel=0.015)
    assert rates == pytest.approx(np.full(3, -7.4583), rel=0.003)
    assert np.diff(times) == pytest.approx(np.full(2, times[0]), rel=2e-3)
    assert abs(np.diff(heights, 2)[0]) < 0.01 * abs(heights[0])
    assert abs(rates[2] - rates[1]) < abs(rates[1] - rates[0])
