"""Collisions: disintegration, elastic collision, scattering; against the formulas of the book and whole paths."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.fmu

# ------------------------------------------------------------------------------------- disintegration (section 16)

M1, M2, K, FREE, DISTANCE = 1.0, 2.0, 400.0, 0.5, 0.3
RELEASED = K * (FREE - DISTANCE) ** 2 / 2
V0 = np.sqrt(2 * RELEASED * M2 / (M1 * (M1 + M2)))  # of the first part, in the frame of the mass centre


def apart(theta0: float, speed: float) -> dict[str, float]:
    """Start values: the spring at ``theta0`` to the velocity ``speed`` of both."""
    along, across = DISTANCE * np.cos(theta0) / (M1 + M2), DISTANCE * np.sin(theta0) / (M1 + M2)
    start = {"x1": M2 * along, "y1": M2 * across, "x2": -M1 * along, "y2": -M1 * across}
    return {k: float(x) for k, x in start.items()} | {"x1_dot": speed, "x2_dot": speed}


def test_disintegration_in_time(motion) -> None:
    """A quarter of an oscillation of the reduced mass, then straight on."""
    run = motion("disintegration", 0.5, tolerance=1e-11)
    w = np.sqrt(K * (M1 + M2) / (M1 * M2))
    free = run.time > np.pi / (2 * w)
    r = FREE + (FREE - DISTANCE) * np.where(free, w * run.time - np.pi / 2, -np.cos(w * run.time))
    assert run["r"] == pytest.approx(r, abs=1e-8)
    for i, part in ((1, M2 / (M1 + M2)), (2, -M1 / (M1 + M2))):
        place = run[f"x{i}"] + 1j * run[f"y{i}"]
        assert place == pytest.approx(3.0 * run.time + part * r * np.exp(1j * np.pi / 3), abs=1e-8)


@pytest.mark.parametrize("theta0", [0.4, np.pi / 3, 2.5])
def test_energies_and_angles_after_a_disintegration(theta0: float, motion) -> None:
    """T10 = epsilon m2/(m1 + m2) in the frame of the mass centre; tan(theta) = v0 sin(theta0)/(v0 cos(theta0) + V)."""
    run = motion("disintegration", 0.2, steps=1, tolerance=1e-11, **apart(theta0, 3.0))
    u, v = run["x1_dot"][-1], run["y1_dot"][-1]
    assert M1 * ((u - 3.0) ** 2 + v**2) / 2 == pytest.approx(RELEASED * M2 / (M1 + M2), rel=1e-8)
    assert np.arctan2(v, u) == pytest.approx(np.arctan2(V0 * np.sin(theta0), V0 * np.cos(theta0) + 3.0), abs=1e-8)
    assert M1 * u + M2 * run["x2_dot"][-1] == pytest.approx(3.0 * (M1 + M2), rel=1e-12)


def test_the_largest_angle_after_a_disintegration(motion) -> None:
    """sin(theta) = v0/V where V is larger; it belongs to cos(theta0) = -v0/V, and neighbours stay below."""

    def angle(theta0: float) -> float:
        run = motion("disintegration", 0.2, steps=1, tolerance=1e-11, **apart(theta0, 10.0))
        return float(np.arctan2(run["y1_dot"][-1], run["x1_dot"][-1]))

    middle = np.arccos(-V0 / 10.0)
    assert angle(middle) == pytest.approx(np.arcsin(V0 / 10.0), abs=1e-8)
    assert angle(middle) > max(angle(middle - 0.1), angle(middle + 0.1))


# --------------------------------------------------------------------------------- elastic collision (sections 17, 18)

REDUCED, BETA, SPEED = M1 * M2 / (M1 + M2), 0.5, 2.0


def test_elastic_collision_in_time(motion) -> None:
    """In U = beta/r^2: r^2 = c^2 + v^2 (t - t0)^2, and the angle is an arc tangent; the mass centre straight on."""
    run = motion("elastic_collision", 5.0, tolerance=1e-11)
    place, velocity = -4.0 + 0.3j, 2.0
    square = velocity**2 + 2 * BETA / (REDUCED * abs(place) ** 2)  # v^2 from afar
    v, t0 = np.sqrt(square), 4.0 * velocity / square
    c = np.sqrt(abs(place) ** 2 - (v * t0) ** 2)
    turned = -0.3 * velocity / (c * v) * (np.arctan(v * (run.time - t0) / c) + np.arctan(v * t0 / c))
    r = np.hypot(c, v * (run.time - t0))
    relative = r * np.exp(1j * (np.angle(place) + turned))
    assert run["r"] == pytest.approx(r, abs=1e-8)
    centre = (M1 * place + M1 * velocity * run.time) / (M1 + M2)
    assert run["x1"] + 1j * run["y1"] == pytest.approx(centre + M2 / (M1 + M2) * relative, abs=1e-8)
    assert run["x2"] + 1j * run["y2"] == pytest.approx(centre - M1 / (M1 + M2) * relative, abs=1e-8)


@pytest.mark.parametrize("b", [0.2, 0.7, 2.0])
def test_angles_and_energies_of_an_elastic_collision(b: float, motion) -> None:
    """Formulas 17.4 and 17.5, from far away to far away, as E is that of the relative motion at infinity."""
    far, energy = 1e4, REDUCED * SPEED**2 / 2
    near = np.sqrt(SPEED**2 - 2 * BETA / (REDUCED * far**2))
    start = {"x1": -far, "x1_dot": float(near), "y1": float(b * SPEED / near), "solver_max_step": 2.0}
    run = motion("elastic_collision", 2 * far / SPEED, steps=1, **start)
    first, second = (run[f"x{i}_dot"][-1] + 1j * run[f"y{i}_dot"][-1] for i in (1, 2))
    chi = np.pi * (1 - b / np.sqrt(b**2 + BETA / energy))
    relative = first - second
    assert np.angle(relative) == pytest.approx(chi, abs=1e-8)
    assert np.angle(first) == pytest.approx(np.arctan2(M2 * np.sin(chi), M1 + M2 * np.cos(chi)), abs=1e-8)
    assert -np.angle(second) == pytest.approx((np.pi - chi) / 2, abs=2e-8)
    lost = 4 * M1 * M2 / (M1 + M2) ** 2 * np.sin(chi / 2) ** 2
    assert M2 * abs(second) ** 2 / (M1 * SPEED**2) == pytest.approx(lost, abs=1e-8)
    assert M1 * abs(first) ** 2 / (M1 * SPEED**2) == pytest.approx(1 - lost, abs=1e-8)


# ------------------------------------------------------------------------------- Rutherford's formula (sections 18, 19)


def deflection(motion, b: float, v: float = 2.0, alpha: float = 4.0, far: float = 1e5) -> float:
    """The angle between the velocities far before and far behind the centre; b and v are those at infinity, m = 1."""
    near = np.sqrt(v**2 - 2 * alpha / np.hypot(far, b))
    start = {"x": -far, "y": float(b * v / near), "x_dot": float(near), "alpha": alpha, "solver_max_step": 2.0}
    run = motion("rutherford_scattering", 2 * far / v, steps=1, **start)
    return float(np.arctan2(run["y_dot"][-1], run["x_dot"][-1]))


@pytest.mark.parametrize("b", [0.05, 0.5, 5.0])
@pytest.mark.parametrize("alpha", [4.0, -4.0], ids=["repelled", "attracted"])
def test_deflection_in_a_coulomb_field(b: float, alpha: float, motion) -> None:
    """tan(chi/2) = |alpha|/(m v^2 b), Mechanics, section 19."""
    assert deflection(motion, b, alpha=alpha) == pytest.approx(np.sign(alpha) * 2 * np.arctan(1 / b), abs=1e-8)


def test_rutherford(motion) -> None:
    """d sigma/d Omega = b/sin(chi) |db/dchi| from deflections at 21 impact parameters, by their interpolation."""
    series = np.polynomial.Chebyshev.interpolate(
        lambda x: np.array([deflection(motion, float(b)) for b in x]), 20, domain=[0.5, 2.0]
    )
    for b in (0.8, 1.0, 1.5):
        chi = series(b)
        section = b / (np.sin(chi) * abs(series.deriv()(b)))
        assert section == pytest.approx((1 / (2 * np.sin(chi / 2) ** 2)) ** 2, rel=1e-8)
