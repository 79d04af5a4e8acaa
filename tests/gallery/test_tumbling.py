"""Bodies in quaternions: against Euler's angles, against motions through the pole of those, and elliptic functions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipkinc

import lag2fmu

pytestmark = pytest.mark.fmu

G = 9.81


def test_heavy_top_as_in_eulers_angles(motion) -> None:
    run, euler = motion("heavy_top_quaternion", 1.0), motion("heavy_top", 1.0)
    for axis in "xyz":
        assert run[f"centre_{axis}"] == pytest.approx(euler[f"centre_{axis}"], abs=1e-9)
        assert run[f"omega_{axis}"] == pytest.approx(euler[f"omega_{axis}"], abs=1e-6)


def test_heavy_top_through_the_upright(motion) -> None:
    """From theta = 0 with theta_dot: p_phi = p_psi, and for u = cos(theta) u_dot^2 is a polynomial of third degree.

    u_dot^2 = 2 (E - m g l u) (1 - u^2)/I - (p (1 - u)/I)^2, differentiated so that it starts by itself; E is the energy
    without that of the spin (H. Goldstein, Classical Mechanics, section 5-7).
    """
    m, l, C = 0.5, 0.08, 1e-3  # noqa: E741
    I = 6e-4 + m * l**2  # noqa: E741
    rate, spin = 2.0, 30.0  # too slow for the top to sleep: it sinks far
    p, energy = C * spin, I * rate**2 / 2 + m * G * l

    def acceleration(u: float) -> float:
        fall = (energy - m * G * l * u) / I
        return -m * G * l / I * (1 - u**2) - 2 * fall * u + (p / I) ** 2 * (1 - u)

    start = {"e0": 1.0, "e1": 0.0, "e0_dot": 0.0, "e1_dot": rate / 2, "e2_dot": 0.0, "e3_dot": spin / 2}
    run = motion("heavy_top_quaternion", 2.0, steps=100, tolerance=1e-11, **start)
    exact = solve_ivp(
        lambda t, z: [z[1], acceleration(z[0])], (0, 2), [1.0, 0.0], "DOP853", run.time, rtol=1e-12, atol=1e-12
    )
    u = exact.y[0]
    assert run["centre_z"] == pytest.approx(l * u, abs=1e-8)
    assert (np.diff(np.sign(exact.y[1])) > 0).sum() >= 1 or (u[1:] > 0.999).any()
    norm = sum(run[f"e{i}"] ** 2 for i in range(4))
    assert norm == pytest.approx(np.ones(101), abs=1e-10)


def test_free_body(motion) -> None:
    """Landau, Lifshitz, Mechanics, formulas 37.8 to 37.10, for M^2 < 2 E I2: axes 1 and 3 exchanged."""
    I1, I2, I3, w1, w2 = 5.0, 10.0, 13.0, 0.01, 1.5
    energy2, M2 = I1 * w1**2 + I2 * w2**2, (I1 * w1) ** 2 + (I2 * w2) ** 2
    assert energy2 * I2 > M2
    run = motion("free_body", 20.0, steps=80, tolerance=1e-12)
    pace = np.sqrt((I1 - I2) * (energy2 * I3 - M2) / (I1 * I2 * I3) * -1)
    k2 = (I3 - I2) * (M2 - energy2 * I1) / ((I2 - I1) * (energy2 * I3 - M2))
    assert 0 < k2 < 1
    size = np.sqrt((M2 - energy2 * I1) / (I2 * (I2 - I1)))
    phase = pace * run.time + ellipkinc(np.arcsin(min(1.0, w2 / size)), k2)
    sn, cn, dn, _ = ellipj(phase, k2)
    assert run["omega_y"] == pytest.approx(size * sn, abs=1e-7)
    assert np.abs(run["omega_x"]) == pytest.approx(np.sqrt((energy2 * I3 - M2) / (I1 * (I3 - I1))) * dn, abs=1e-7)
    assert np.abs(run["omega_z"]) == pytest.approx(
        np.sqrt((M2 - energy2 * I1) / (I3 * (I3 - I1))) * np.abs(cn), abs=1e-7
    )
    assert (np.diff(np.sign(run["omega_y"])) != 0).any(), "it turned over"


def test_the_angular_momentum_of_a_free_body_stays(motion) -> None:
    """In the fixed axes: R I omega, with R from the quaternion, through all orientations."""
    run = motion("free_body", 20.0, steps=40)
    I, omega = np.array([5.0, 10.0, 13.0]), run.columns(["omega_x", "omega_y", "omega_z"])  # noqa: E741
    e = run.columns(["e0", "e1", "e2", "e3"])
    vector, scalar, L = e[:, 1:], e[:, :1], I * omega
    fixed = L + 2 * scalar * np.cross(vector, L) + 2 * np.cross(vector, np.cross(vector, L))
    assert fixed == pytest.approx(np.tile(fixed[0], (41, 1)), abs=1e-7)


@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_ball_that_spins_flies_straight(kind, exported) -> None:
    """Errors of the quaternion's norm pushed it, by 2.5e-5 m/s in model exchange."""
    values = {"z": 1.0, "x_dot": 2.0, "y_dot": -1.0, "e1_dot": 20.0, "e2_dot": -15.0, "e3_dot": 5.0}
    names = ["x_dot", "y_dot"]
    run = lag2fmu.simulate(
        exported("sliding_sphere"), stop_time=0.2, step=0.01, values=values, outputs=names, kind=kind
    )
    assert run.columns(names) == pytest.approx(np.tile([2.0, -1.0], (21, 1)), abs=1e-14)
