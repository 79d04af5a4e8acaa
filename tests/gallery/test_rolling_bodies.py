"""Bodies in contact: a loaded cylinder, a sphere on a slope, the rattleback against its equations in body axes."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from quadrature import cycle
from scipy.integrate import solve_ivp

pytestmark = pytest.mark.fmu

G = 9.81


def test_rolling_cylinder(motion) -> None:
    """Period by quadrature of T = (I + m (R^2 + a^2 - 2 a R cos(phi))) phi_dot^2/2: Mechanics, section 32."""
    m, R, a, inertia, g = 2, mp.mpf("0.2"), mp.mpf("0.1"), mp.mpf("0.03"), mp.mpf("9.81")

    def rate(phi):
        return 2 * m * g * a * (mp.cos(phi) - mp.cos(1.5)) / (inertia + m * (R**2 + a**2 - 2 * a * R * mp.cos(phi)))

    run = motion("rolling_cylinder", cycle(rate, -1.5, 1.5))
    assert run["phi"][[10, -1]] == pytest.approx([-1.5, 1.5], rel=1e-8)
    assert run["x_axis"] == pytest.approx(-0.2 * run["phi"], abs=1e-15)


@pytest.mark.parametrize("kappa", [2 / 5, 2 / 3], ids=["homogeneous", "hollow"])
def test_sphere_on_incline(kappa: float, motion) -> None:
    """A parabola, by Newton's and Euler's equations; omega follows from the velocity of the centre, omega_z stays."""
    R, spin = 0.03, 2.0
    start = {"e1_dot": -0.15 / R, "e2_dot": -0.25 / R, "e3_dot": spin / 2}  # half of omega, where e0 is 1
    run = motion("sphere_on_incline", 2.0, kappa=kappa, **start)
    down = G * np.sin(0.3) / (1 + kappa)
    assert run["x"] == pytest.approx(-0.5 * run.time + down * run.time**2 / 2, abs=1e-8)
    assert run["y"] == pytest.approx(0.3 * run.time, abs=1e-8)
    assert run["omega_x"] == pytest.approx(np.full(21, -0.3 / R), abs=1e-6)
    assert run["omega_y"] == pytest.approx((-0.5 + down * run.time) / R, abs=1e-6)
    assert run["omega_z"] == pytest.approx(np.full(21, spin), abs=1e-6)


# --------------------------------------------------------------------------------------------------------- rattleback

AXES, DEPTH = np.array([0.2, 0.03, 0.02]), np.array([0, 0, 0.01])
INERTIA = np.array([[2e-4, -2e-5, 0], [-2e-5, 1.6e-3, 0], [0, 0, 1.7e-3]])


def skew(x: np.ndarray) -> np.ndarray:
    """The matrix of the cross product: skew(x) @ y = x x y."""
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


def stone(_: float, z: np.ndarray) -> np.ndarray:
    """Rates of the vertical u and the angular velocity w in body axes, (6,), by Newton's and Euler's equations; m = 1.

    The mass centre has the velocity v = r x w, r being the contact from it; eliminating the force at the contact,
    I dw + w x I w = r x (dv + w x v + g u) with dv = dr x w + r x dw.
    """
    u, w = z[:3], z[3:]
    turning, scaled = skew(w), AXES**2 * u
    du, size = -turning @ u, np.sqrt(u @ scaled)
    r = DEPTH - scaled / size
    dr = -(AXES**2 * du / size - scaled * (scaled @ du) / size**3)
    arm = skew(r)
    known = arm @ (-turning @ dr + turning @ (arm @ w) + G * u) - turning @ (INERTIA @ w)
    return np.concatenate([du, np.linalg.solve(INERTIA - arm @ arm, known)])


def test_rattleback(motion) -> None:
    """Until it has turned back: spun at -5 rad/s it stops and turns the other way."""
    run = motion("rattleback", 3.6, steps=36, tolerance=1e-11)
    tilt = np.radians(0.5)
    u = np.array([-np.cos(tilt) * np.sin(tilt), np.sin(tilt), np.cos(tilt) ** 2])
    exact = solve_ivp(stone, (0, 3.6), [*u, *(-5.0 * u)], "DOP853", run.time, rtol=1e-10, atol=1e-12).y
    assert np.sin(run["phi"]) == pytest.approx(exact[1], abs=1e-7)
    assert -np.cos(run["phi"]) * np.sin(run["chi"]) == pytest.approx(exact[0], abs=1e-7)
    along_vertical = run["psi_dot"] + run["chi_dot"] * np.sin(run["phi"])
    assert along_vertical == pytest.approx((exact[:3] * exact[3:]).sum(axis=0), abs=1e-6)
    assert run["psi_dot"][0] == -5.0
    assert run["psi_dot"][-1] > 1.0
