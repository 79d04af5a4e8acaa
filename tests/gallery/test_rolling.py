"""Rolling and skating: circles, limits and frequencies in closed form; the bicycle against published numbers."""

from __future__ import annotations

import kkt
import numpy as np
import pytest
from bicycle import EIGENVALUES

import lag2fmu
from lag2fmu.dynamics import derive
from lag2fmu.dynamics.starts import start_values
from lag2fmu.formats.loading import load
from lag2fmu.reference import Equations

G = 9.81


@pytest.mark.fmu
@pytest.mark.parametrize(("theta", "turning"), [(0.3, -4.0), (1.0, -12.0)])
def test_a_disc_rolls_in_circles(theta: float, turning: float, motion) -> None:
    """The moment of momentum about the centre: A W^2 sin cos - (C + m R^2) W w cos - m g R sin = 0, W = phi_dot.

    w = psi_dot + W sin(theta) is the angular velocity about the axis.
    """
    m, R = 0.1, 0.05
    A, C = m * R**2 / 4, m * R**2 / 2
    w = (A * turning**2 * np.sin(theta) * np.cos(theta) - m * G * R * np.sin(theta)) / (
        (C + m * R**2) * turning * np.cos(theta)
    )
    spin = w - turning * np.sin(theta)
    period = 2 * np.pi / abs(turning)
    run = motion("rolling_disc", period, theta=theta, phi_dot=turning, psi_dot=spin)
    assert run["theta"] == pytest.approx(np.full(21, theta), abs=1e-8)
    assert run["phi"][-1] == pytest.approx(-2 * np.pi, rel=1e-8)
    centre = 1j * R * spin / turning
    assert run["x"] + 1j * run["y"] == pytest.approx(centre - centre * np.exp(1j * run["phi"]), abs=1e-8)


@pytest.mark.fmu
def test_upright_rolling_is_stable_when_it_is_fast(motion) -> None:
    """A small lean swings with the frequency (C (C + m R^2) psi_dot^2/A - m g R)/(A + m R^2), squared, or grows."""
    R, lean = 0.05, 1e-5
    critical = G / (3 * R)
    for square in (2 * critical, 0.5 * critical):
        frequency, spin = np.sqrt(complex(4 / 5 * (3 * square - G / R))), np.sqrt(square)
        # A phi_dot + C psi_dot theta is conserved to first order; where it vanishes, upright is the middle of the swing
        run = motion("rolling_disc", 0.5, tolerance=1e-12, theta=lean, phi_dot=-2 * spin * lean, psi_dot=spin)
        assert run["theta"] == pytest.approx(lean * np.cos(frequency * run.time).real, abs=1e-6 * lean, rel=1e-6)


@pytest.mark.fmu
def test_a_ball_on_a_turntable_runs_in_circles(motion) -> None:
    """velocity - (2/7) Omega z x r is conserved: a circle with 2/7 Omega about a centre that the start gives."""
    rate = 2 / 7 * 5.0
    run = motion("sphere_on_turntable", 2 * np.pi / rate)
    centre = 0.2 - 0.1j / (1j * rate)
    assert run["x"] + 1j * run["y"] == pytest.approx(centre + (0.2 - centre) * np.exp(1j * rate * run.time), abs=1e-8)


@pytest.mark.fmu
def test_a_ball_on_a_table_at_rest_rolls_straight_on(motion) -> None:
    run = motion("sphere_on_turntable", 1.0, Omega=0.0)
    assert run["y"] == pytest.approx(0.1 * run.time, abs=1e-10)
    assert run["x"] == pytest.approx(np.full(21, 0.2), abs=1e-10)


@pytest.mark.fmu
def test_chaplygin_sleigh(motion) -> None:
    """u = U tanh(b (t - t0)), omega = k U/cosh(b (t - t0)), b = a k^2 U, k^2 = m/(J + m a^2)."""
    m, J, a, u, omega = 1.0, 0.2, 0.3, -0.5, 0.5
    k = np.sqrt(m / (J + m * a**2))
    U = np.hypot(u, omega / k)
    b = a * k**2 * U
    run = motion("chaplygin_sleigh", 10.0)
    phase = b * run.time + np.arctanh(u / U)
    assert run["u"] == pytest.approx(U * np.tanh(phase), abs=1e-8)
    assert run["phi_dot"] == pytest.approx(k * U / np.cosh(phase), abs=1e-8)
    angle = 2 * k * U / b * (np.arctan(np.tanh(phase / 2)) - np.arctan(np.tanh(phase[0] / 2)))
    assert run["phi"] == pytest.approx(angle, abs=1e-8)


@pytest.mark.fmu
def test_slides_problem_2(motion, exported) -> None:
    """phi = phi0 cos(w t), w^2 = 2 k/(3 m); the friction on the disc is I phi_ddot/R, minus the multiplier's part."""
    m, R, k, start = 2.0, 0.2, 200.0, 0.3
    w = np.sqrt(2 * k / (3 * m))
    bare = motion("slides_problem_2", 2.0)
    fmu = exported("slides_problem_2", outputs=("multiplier_rolling",), explicit=True)
    run = lag2fmu.simulate(fmu, stop_time=2.0, step=0.1, tolerance=1e-10)
    swing = start * np.cos(w * run.time)
    assert bare["phi"] == pytest.approx(swing, abs=1e-8)
    assert run["phi"] == pytest.approx(swing, abs=1e-8)
    assert run["x"] == pytest.approx(R * swing, abs=1e-9)
    # on phi the constraint x - R phi acts with -R multiplier
    assert run["multiplier_rolling"] == pytest.approx(m * R / 2 * w**2 * swing, abs=1e-6)


# ------------------------------------------------------------------------------------------------------------ bicycle


RADIUS = 0.3


class Bicycle:
    """Accelerations of the bicycle from the derived equations, dependent coordinates and velocities solved for."""

    def __init__(self) -> None:
        mechanism = load("whipple_bicycle")
        self.equations, self.energies = derive(mechanism), Equations(mechanism).energies
        self.values = start_values(mechanism)
        self.names = [c.name for c in mechanism.coordinates]

    def accelerations(self, q: dict[str, float], qd: dict[str, float]) -> dict[str, float]:
        free = [name not in q for name in self.names], [name not in qd for name in self.names]
        place, rate = (np.array([x.get(name, 0.0) for name in self.names]) for x in (q, qd))
        place, rate = self.energies.consistent(place, rate, 0.0, {}, free)
        self.values |= dict(zip(self.names, place, strict=True))
        self.values |= {f"{name}_dot": x for name, x in zip(self.names, rate, strict=True)}
        return dict(zip(self.names, kkt.solve(self.equations, self.values)[0], strict=True))

    def eigenvalues(self, speed: float) -> np.ndarray:
        """Of lean and steer at upright straight riding, (4,), by differences of fourth order."""

        def rates(z: np.ndarray) -> np.ndarray:
            found = self.accelerations(
                {"x": 0.0, "y": 0.0, "psi": 0.0, "phi": z[0], "delta": z[1], "theta_R": 0.0, "theta_F": 0.0},
                {"phi": z[2], "delta": z[3], "theta_R": -speed / RADIUS},
            )
            return np.array([z[2], z[3], found["phi"], found["delta"]])

        h, unit = 1e-3, np.eye(4)
        columns = [8 * (rates(h * e) - rates(-h * e)) - (rates(2 * h * e) - rates(-2 * h * e)) for e in unit]
        return np.sort_complex(np.linalg.eigvals(np.array(columns).T / (12 * h)))


@pytest.fixture(scope="module")
def bicycle() -> Bicycle:
    return Bicycle()


@pytest.mark.long
@pytest.mark.parametrize(("speed", "published"), EIGENVALUES)
def test_whipple_bicycle_linearised(speed: float, published: list[complex], bicycle: Bicycle) -> None:
    found = bicycle.eigenvalues(speed)
    for value in published:
        assert np.abs(found - value).min() < 1e-8


def test_whipple_bicycle_in_a_general_state(bicycle: Bicycle) -> None:
    """Table 1 of P. Basu-Mandal, A. Chatterjee, J. M. Papadopoulos, Proc. R. Soc. A 463, 2007, in the letters here.

    There theta, psi, phi are angles 3-1-3 of the rear frame with z up: yaw -theta, roll pi/2 - psi, pitch pi - phi;
    psi_f, beta_r and beta_f count the other way round.
    """
    q = {"x": 0.0, "y": 0.0, "psi": 0.0, "phi": np.pi / 2 - 0.9501292851472, "delta": -0.2311385135743}
    q |= {"theta_R": 0.0, "theta_F": 0.0}
    qd = {"psi": -0.7830033527065, "phi": -0.6068425835418, "delta": -0.4859824687093, "theta_R": -8.9129896614890}
    found = bicycle.accelerations(q, {"phi": qd["phi"], "delta": qd["delta"], "theta_R": qd["theta_R"]})
    solved = {name: bicycle.values[name] for name in ("chi", "psi_dot", "chi_dot", "theta_F_dot")}
    assert solved == pytest.approx(
        {
            "chi": np.pi - 3.1257073014894,
            "psi_dot": qd["psi"],
            "chi_dot": 0.0119185528069,
            "theta_F_dot": -8.0133620584155,
        },
        abs=1e-12,
    )
    published = {"psi": -0.8353281706379, "phi": 7.8555281128244, "chi": -0.1205543897884, "delta": 4.6198904039403}
    published |= {"theta_R": -1.8472554144217, "theta_F": -2.4548072904550}
    assert {name: found[name] for name in published} == pytest.approx(published, abs=2e-12)


@pytest.mark.fmu
def test_a_pushed_bicycle_rights_itself(motion) -> None:
    """At 4.6 m/s, within the stable speeds of the paper; lateral energy turns into speed, the sum stays."""
    run = motion("whipple_bicycle", 5.0, steps=50, tolerance=1e-8)
    assert np.abs(run["phi"]).max() > 0.05
    assert abs(run["phi"][-1]) < 0.02
    assert abs(run["theta_R_dot"][-1] * RADIUS) > 4.6
