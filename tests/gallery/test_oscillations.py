"""Small and anharmonic oscillations, rotating frames, fields, tops, ropes: closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from quadrature import cycle
from scipy.linalg import expm
from scipy.special import ellipj, ellipk

pytestmark = pytest.mark.fmu

G = 9.81


def test_coupled_masses(motion) -> None:
    """The sum of the normal modes sin(i j pi/(n + 1)) with frequencies 2 sqrt(k/m) sin(j pi/(2 (n + 1)))."""
    n, run = 3, motion("coupled_masses", 10.0)
    j = np.arange(1, n + 1)
    modes = np.sqrt(2 / (n + 1)) * np.sin(np.outer(j, j) * np.pi / (n + 1))
    frequencies = 2 * np.sqrt(10.0) * np.sin(j * np.pi / (2 * (n + 1)))
    expected = np.cos(np.outer(run.time, frequencies)) * (modes @ [0.1, 0, 0]) @ modes
    assert run.columns(["x1", "x2", "x3"]) == pytest.approx(expected, abs=1e-9)


def test_triatomic_molecule(motion) -> None:
    mA, mB, k, run = 1.0, 0.75, 10.0, motion("triatomic_molecule", 10.0)
    symmetrical, other = np.sqrt(k / mA), np.sqrt(k * (2 * mA + mB) / (mA * mB))
    total = 2 * mA + mB
    centre = (mA * 0.1 + mB * 0.05 - mA * 0.05) / total
    stretch = (0.1 + 0.05) / 2 * np.cos(symmetrical * run.time)  # (x1 - x3)/2
    # what remains is the mode (1, -2 mA/mB, 1), in which the mass centre rests
    amplitude = (0.1 - 0.05) / 2 - centre
    mode = amplitude * np.cos(other * run.time)
    assert run["x1"] == pytest.approx(centre + stretch + mode, abs=1e-9)
    assert run["x2"] == pytest.approx(centre - 2 * mA / mB * mode, abs=1e-9)
    assert run["x3"] == pytest.approx(centre - stretch + mode, abs=1e-9)


def test_wilberforce_pendulum(motion) -> None:
    """In resonance: two modes, omega^2 = k/m +- epsilon/(2 sqrt(m I)); all the energy changes over."""
    m, inertia, k, epsilon = 0.5, 1.4e-4, 2.75, 9.3e-3
    run = motion("wilberforce_pendulum", 40.0)
    split = epsilon / (2 * np.sqrt(m * inertia))
    fast, slow = (np.cos(np.sqrt(k / m + s * split) * run.time) for s in (1, -1))
    assert run["z"] == pytest.approx(0.05 * (fast + slow), abs=1e-8)
    assert run["theta"] == pytest.approx(0.05 * np.sqrt(m / inertia) * (fast - slow), abs=1e-7)


def test_anharmonic_oscillator(motion) -> None:
    """x = a cn(w t | p), w^2 = (k + beta a^2)/m, p = beta a^2/(2 (k + beta a^2)); a = m = 1, k = 4, beta = 3."""
    run = motion("anharmonic_oscillator", 10.0)
    assert run["x"] == pytest.approx(ellipj(np.sqrt(7.0) * run.time, 3.0 / 14.0)[1], abs=1e-8)


def test_the_frequency_grows_with_the_amplitude(motion) -> None:
    """By 3 beta a^2/(8 m omega_0) to first order (Mechanics, formula 28.13); the next order is 1e-4 of that."""
    a = 0.01
    exact = np.pi * np.sqrt(4 + 3 * a**2) / (2 * ellipk(3 * a**2 / (2 * (4 + 3 * a**2))))
    assert exact - 2 == pytest.approx(3 * 3 * a**2 / (8 * 2), rel=1e-4)
    run = motion("anharmonic_oscillator", 2 * np.pi / exact, tolerance=1e-12, x=a)
    assert run["x"][-1] == pytest.approx(a, rel=1e-8)
    assert run["x_dot"][-1] == pytest.approx(0.0, abs=1e-10)


def test_henon_heiles_on_its_axis_of_symmetry(motion) -> None:
    """For x = 0 the motion is one-dimensional in y^2/2 - y^3/3."""

    def rate(y):
        return (0.04 - y**2) - 2 * (0.2**3 - y**3) / 3

    low = np.roots([2 / 3, -1, 0, 0.04 - 2 * 0.2**3 / 3])
    other = float(min(low.real, key=lambda y: abs(y + 0.19)))
    run = motion("henon_heiles", cycle(rate, other, 0.2), x=0.0, x_dot=0.0)
    assert run["y"][[10, -1]] == pytest.approx([other, 0.2], rel=1e-8)
    assert np.abs(run["x"]).max() == 0.0


def test_henon_heiles_has_three_axes(motion) -> None:
    """A turn of the start by 120 degrees turns the motion."""
    run = motion("henon_heiles", 20.0)
    c, s = np.cos(2 * np.pi / 3), np.sin(2 * np.pi / 3)
    start = {"x": c * 0.1 - s * 0.2, "y": s * 0.1 + c * 0.2, "x_dot": c * 0.2, "y_dot": s * 0.2}
    turned = motion("henon_heiles", 20.0, **start)
    assert turned["x"] == pytest.approx(c * run["x"] - s * run["y"], abs=1e-8)
    assert turned["y"] == pytest.approx(s * run["x"] + c * run["y"], abs=1e-8)


def test_foucault_pendulum(motion) -> None:
    """An ellipse in the inertial frame, seen from one that turns with Omega sin(lat)."""
    run = motion("foucault_pendulum", 10.0)
    turning = 0.2 * np.sin(np.deg2rad(48.85))
    inertial = 0.1 * np.cos(3.0 * run.time) + 1j * 0.1 * turning / 3.0 * np.sin(3.0 * run.time)
    seen = inertial * np.exp(-1j * turning * run.time)
    assert run["x"] + 1j * run["y"] == pytest.approx(seen, abs=1e-9)


def test_falling_body(motion) -> None:
    """v_dot = g + 2 v x Omega, a linear equation, by the exponential of its matrix; and the formula of the book."""
    Omega, stop = 7.292115e-5, np.sqrt(200.0 / G)
    fall, run = motion("falling_body", stop, y_dot=0.0), motion("falling_body", stop)
    w_y = w_z = Omega * np.sqrt(0.5)
    turning = 2 * np.array([[0, w_z, -w_y], [-w_z, 0, 0], [w_y, 0, 0]])  # 2 v x Omega = turning @ v
    system = np.zeros((7, 7))
    system[:3, 3:6], system[3:6, 3:6], system[5, 6] = np.eye(3), turning, -G
    end = expm(system * stop) @ [0, 0, 100.0, 0, 5.0, 0, 1]
    assert run["x"][-1] == pytest.approx(end[0], rel=1e-8)
    assert run["y"][-1] == pytest.approx(end[1], rel=1e-8)
    assert run["z"][-1] == pytest.approx(end[2], abs=1e-8)
    assert fall["x"][-1] == pytest.approx(G * Omega * np.sqrt(0.5) * stop**3 / 3, rel=1e-6)


def test_charged_particle(motion) -> None:
    """A circle of frequency q B/m about a centre that drifts with E/B along x."""
    run = motion("charged_particle", 10.0)
    omega, drift = 2.0, 0.5 / 2.0
    velocity = (1.0 - drift) * np.exp(-1j * omega * run.time)  # v_x - drift + i v_y
    place = (velocity - velocity[0]) / (-1j * omega)
    assert run["x"] == pytest.approx(drift * run.time + place.real, abs=1e-8)
    assert run["y"] == pytest.approx(place.imag, abs=1e-8)
    assert run["z"] == pytest.approx(0.2 * run.time, rel=1e-10)


def test_double_atwood(motion) -> None:
    """The lower pulley acts as one mass 4 m2 m3/(m2 + m3)."""
    run = motion("double_atwood", 2.0)
    down = G * (4.0 - 3.0) / (4.0 + 3.0)
    assert run["x"] == pytest.approx(down * run.time**2 / 2, rel=1e-10, abs=1e-14)
    assert run["y"] == pytest.approx((3.0 - 1.0) / (3.0 + 1.0) * (G + down) * run.time**2 / 2, rel=1e-10, abs=1e-14)


def test_moving_frame(motion) -> None:
    run = motion("moving_frame", 10.0)
    assert run["x"] == pytest.approx(0.5 * run.time, rel=1e-12)
    assert run["y"] == pytest.approx(1.0 - 0.25 * run.time, rel=1e-12, abs=1e-12)


def test_symmetrical_top(motion) -> None:
    """Regular precession: phi_dot = M/I1, psi_dot = M cos(theta) (1/I3 - 1/I1), theta stays."""
    run = motion("symmetrical_top", 10.0, theta_dot=0.0)
    assert run["theta"] == pytest.approx(np.full(21, np.pi / 3), rel=1e-8)
    assert run["phi"] == pytest.approx(5.0 * run.time, rel=1e-8)
    assert run["psi"] == pytest.approx(0.02 * 5.0 * 0.5 * (1 / 0.03 - 1 / 0.02) * run.time, rel=1e-8)
