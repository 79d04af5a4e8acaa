"""What is on frames, against closed forms, published and hand-derived equations, and the balance of energy."""

import numpy as np
import pytest
from spatial_mechanisms import (
    TENSOR,
    carousel,
    double_joint,
    everything_spatial,
    free_symmetric_body,
)

from lag2fmu.formats.loading import load
from lag2fmu.reference import Equations, Trajectory, integrate, sympy_accelerations

MODELS = ("heavy_top", "furuta_pendulum", "six_axis_arm", "humanoid_planar")
CASES = {
    **{name: (load(name), {}) for name in MODELS},
    "free": (free_symmetric_body(0.4, 0.3), {}),
    "double_joint": (double_joint(), {"tau_x": 0.3, "tau_y": -1.0, "tau_z": 2.0}),
    "carousel": (carousel(True), {"y": 0.4, "y_dot": -1.0, "y_ddot": 2.0, "F": 3.0}),
    "everything": (
        everything_spatial(),
        {"y": 0.3, "y_dot": 0.7, "y_ddot": -0.9, "F": 1.5, "turn_x": 1.0, "turn_z": -2.0, "kick_y": 3.0, "Q_q0": 0.5},
    ),
}
Floats = np.ndarray


def states(n: int, count: int = 10) -> tuple[Floats, Floats, Floats]:
    """Random times (m,) in s and q, qd (m, n)."""
    random = np.random.default_rng(3)
    return random.uniform(0, 5, count), random.uniform(0.2, 1.2, (count, n)), random.uniform(-2, 2, (count, n))


# ------------------------------------------------------------------------------------------------- every mechanism


@pytest.mark.parametrize("case", CASES)
def test_energy_is_balanced_to_rounding(case: str) -> None:
    mechanism, inputs = CASES[case]
    equations, (t, q, qd) = Equations(mechanism), states(len(mechanism.coordinates))
    balance = equations.balance(t, q, qd, equations.accelerations(t, q, qd, inputs), inputs)
    assert np.abs(balance.residual).max() < 1e-14 * balance.scale.max()


@pytest.mark.parametrize(
    "case",
    [
        *("heavy_top", "furuta_pendulum", "free", "double_joint", "carousel"),
        pytest.param("everything", marks=pytest.mark.all_models),
    ],
)
def test_accelerations_agree_with_sympy(case: str) -> None:
    mechanism, inputs = CASES[case]
    symbolic, (t, q, qd) = sympy_accelerations(mechanism), states(len(mechanism.coordinates), 3)
    found = Equations(mechanism).accelerations(t, q, qd, inputs)
    expected = np.array([symbolic(*state, inputs) for state in zip(t, q, qd, strict=True)])
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-10)


@pytest.mark.parametrize("case", ["free", "carousel", "everything"])
def test_one_state_and_a_long_batch_agree(case: str) -> None:
    mechanism, inputs = CASES[case]
    equations, (t, q, qd) = Equations(mechanism), states(len(mechanism.coordinates), 5000)
    batch, outputs = equations.accelerations(t, q, qd, inputs), equations.outputs(t, q, qd, inputs)
    assert list(outputs) == list(mechanism.output_names)
    for i in (0, 4095, 4999):
        state = (t[i], q[i], qd[i], inputs)
        assert equations.accelerations(*state) == pytest.approx(batch[i], rel=1e-10)
        one = equations.outputs(*state)
        assert [one[name] for name in outputs] == pytest.approx([x[i] for x in outputs.values()], rel=1e-12)


# ------------------------------------------------------------------------------------------------------ closed forms


def test_steady_precession_of_the_heavy_top() -> None:
    """(A + m l^2) phi_dot^2 cos(theta) - C w3 phi_dot + m g l = 0 (Goldstein, equation 5-72)."""
    equations = Equations(load("heavy_top"))
    p, theta, w3 = equations.energies.parameters, 0.6, 90.0
    A, weight = p["A"] + p["m"] * p["l"] ** 2, p["m"] * p["g"] * p["l"]
    for phi_dot in np.roots([A * np.cos(theta), -p["C"] * w3, weight]):
        qd = [phi_dot, 0.0, w3 - phi_dot * np.cos(theta)]
        assert equations.accelerations(0.0, [0.3, theta, 0.2], qd) == pytest.approx(0, abs=1e-9)
        assert equations.outputs(0.0, [0.3, theta, 0.2], qd)["omega_z"] == pytest.approx(w3, rel=1e-14)


def column(trajectory: Trajectory, name: str) -> Floats:
    return trajectory.columns([name])[:, 0]


def test_conserved_quantities_of_the_heavy_top() -> None:
    mechanism = load("heavy_top")
    times = np.linspace(0, 1, 51)
    run = integrate(mechanism, times, rtol=1e-10).trajectory
    p, theta = Equations(mechanism).energies.parameters, column(run, "theta")
    phi_dot, theta_dot, psi_dot = (column(run, f"{name}_dot") for name in ("phi", "theta", "psi"))
    A = p["A"] + p["m"] * p["l"] ** 2
    spin = p["C"] * (psi_dot + phi_dot * np.cos(theta))
    vertical = A * np.sin(theta) ** 2 * phi_dot + spin * np.cos(theta)
    energy = A / 2 * (theta_dot**2 + (phi_dot * np.sin(theta)) ** 2) + spin**2 / p["C"] / 2
    energy += p["m"] * p["g"] * p["l"] * np.cos(theta)
    for quantity in (spin, vertical, energy):
        assert quantity == pytest.approx(quantity[0], rel=1e-9)
    assert np.ptp(theta) > 0.3
    assert energy == pytest.approx(column(run, "generalized_energy"), rel=1e-12)


@pytest.mark.parametrize(("A", "C"), [(0.4, 0.3), (0.4, 0.7)])
def test_a_free_symmetric_body_precesses_steadily(A: float, C: float) -> None:
    """phi_dot = L / A, psi_dot = L cos(theta) (1/C - 1/A) about the fixed L along z (Landau, Lifshitz, section 33)."""
    L, theta = 1.3, 0.8
    rates = np.array([L / A, 0.0, L * np.cos(theta) * (1 / C - 1 / A)])
    equations, t = Equations(free_symmetric_body(A, C)), np.linspace(0, 9, 40)
    q = np.array([0.1, theta, 0.2]) + t[:, None] * rates
    qd = np.broadcast_to(rates, q.shape)
    assert equations.accelerations(t, q, qd) == pytest.approx(0, abs=1e-13)
    values = equations.outputs(t, q, qd)
    w = np.array([values[f"w_{axis}"] for axis in "xyz"])
    R = np.array([values[f"R_{i}{j}"] for i in "123" for j in "123"]).reshape(3, 3, -1)
    momentum = np.einsum("ijk,jk->ik", R, np.array([A, A, C])[:, None] * w)
    assert momentum == pytest.approx(np.outer([0, 0, L], np.ones(len(t))), abs=1e-14)
    assert np.einsum("ijk,jk->ik", R, w) == pytest.approx(np.array([values[f"omega_{axis}"] for axis in "xyz"]))


# ------------------------------------------------------------------------------------------------- written equations


def test_a_spatial_arm_agrees_with_hand_derived_equations() -> None:
    """T = a(q2)/2 q1_dot^2 + b(q2) q1_dot q2_dot + d/2 q2_dot^2, V = -m g l sin(q2)."""
    (xx, yy, zz, xy, xz, yz), m, length, g = TENSOR, 2.0, 0.7, 9.81
    t, q, qd = states(2)
    torque = {"tau_x": 0.3, "tau_y": -1.0, "tau_z": 2.0}
    s, c, (v1, v2) = np.sin(q[:, 1]), np.cos(q[:, 1]), qd.T
    a = m * length**2 * c**2 + xx * s**2 + zz * c**2 - 2 * xz * s * c
    b, d = -xy * s + yz * c, m * length**2 + yy
    a_slope = 2 * (xx - zz - m * length**2) * s * c - 2 * xz * (c**2 - s**2)
    b_slope = -xy * c - yz * s
    Q1, Q2 = -torque["tau_x"] * s + torque["tau_z"] * c, torque["tau_y"]  # tau . dw/dqd in the arm's axes
    right = np.array([Q1 - a_slope * v1 * v2 - b_slope * v2**2, Q2 + a_slope * v1**2 / 2 + m * g * length * c])
    expected = np.array([right[0] * d - b * right[1], a * right[1] - b * right[0]]) / (a * d - b**2)
    assert Equations(double_joint()).accelerations(t, q, qd, torque) == pytest.approx(expected.T, rel=1e-12)


def test_the_furuta_pendulum_agrees_with_published_equations() -> None:
    """B. S. Cazzolato, Z. Prime, On the dynamics of the Furuta pendulum, 2011, general form with all inertias."""
    equations, (t, q, qd), tau = Equations(load("furuta_pendulum")), states(2), 0.2
    p = equations.energies.parameters
    m2, L1, l2 = p["m2"], p["L1"], p["l2"]
    s, c, (v1, v2) = np.sin(q[:, 1]), np.cos(q[:, 1]), qd.T
    across, about = m2 * l2**2 + p["J2"], p["Ja"]
    m11 = p["J1"] + p["m1"] * p["l1"] ** 2 + m2 * L1**2 + across * s**2 + about * c**2
    m12, m22, twice = m2 * L1 * l2 * c, across, 2 * s * c
    f1 = tau + m2 * L1 * l2 * s * v2**2 - v1 * v2 * twice * (across - about) - p["b1"] * v1
    f2 = v1**2 * twice * (across - about) / 2 - p["b2"] * v2 - p["g"] * m2 * l2 * s
    expected = np.array([f1 * m22 - m12 * f2, m11 * f2 - m12 * f1]) / (m11 * m22 - m12**2)
    assert equations.accelerations(t, q, qd, {"Q_alpha": tau}) == pytest.approx(expected.T, rel=1e-12)


@pytest.mark.parametrize("n", [1, 3, 12])
def test_the_n_pendulum_on_frames_is_the_one_in_sums(n: int) -> None:
    t, q, qd = states(n)
    values = {f"m{i}": 1.0 + 0.1 * i for i in range(1, n + 1)} | {f"l{i}": 1.0 - 0.05 * i for i in range(1, n + 1)}
    framed = Equations(load("n_pendulum", {"n": n, "frames": True}), values)
    flat = Equations(load("n_pendulum", {"n": n, "relative": True}), values)
    assert framed.accelerations(t, q, qd) == pytest.approx(flat.accelerations(t, q, qd), rel=1e-9, abs=1e-9)
    assert framed.potential_energy(t, q, qd) == pytest.approx(flat.potential_energy(t, q, qd), rel=1e-13)
    tip = framed.energies.position(framed.energies.state(t, q, qd), f"bob{n}")
    expected = flat.outputs(t, q, qd)
    assert tip[0] == pytest.approx(expected["x_tip"], abs=1e-13)
    assert tip[1] == pytest.approx(expected["y_tip"], abs=1e-13)


def test_a_driven_carousel_on_frames_is_the_one_written_out() -> None:
    framed, written, (t, q, qd) = Equations(carousel(True)), Equations(carousel(False)), states(2)
    inputs = {"y": 0.4, "y_dot": -1.0, "y_ddot": 2.0, "F": 3.0}
    state = (t, q, qd, inputs)
    assert framed.accelerations(*state) == pytest.approx(written.accelerations(*state), rel=1e-11)
    assert framed.generalized_energy(*state) == pytest.approx(written.generalized_energy(*state), rel=1e-12)
    assert framed.kinetic_energy(*state) == pytest.approx(written.kinetic_energy(*state), rel=1e-12)
    expected = written.outputs(*state)
    for name, value in framed.outputs(*state).items():
        assert value == pytest.approx(expected[name], rel=1e-12, abs=1e-13)
    place = framed.energies.position(framed.energies.state(*state), "bead")
    assert place == pytest.approx(written.energies.position(written.energies.state(*state), "bead"), abs=1e-13)


# ------------------------------------------------------------------------------------------------------------ outputs


def matrix_of(e: Floats) -> Floats:
    e0, x, y, z = e
    star = np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]])
    return np.eye(3)[..., None] + 2 * e0 * star + 2 * np.einsum("ijk,jlk->ilk", star, star)


@pytest.mark.parametrize("frame", ["hand", "right"])
def test_outputs_of_a_frame_fit_together(frame: str) -> None:
    equations, (t, q, qd) = Equations(everything_spatial()), states(3)
    inputs, h = {"y": 0.3, "y_dot": 0.7}, 1e-6

    def at(step: float) -> dict[str, Floats]:
        return equations.outputs(t + step, q + step * qd, qd, {"y": 0.3 + step * 0.7, "y_dot": 0.7})

    def rotation(values: dict[str, Floats]) -> Floats:
        return np.array([values[f"rotation_{frame}_{i}{j}"] for i in "123" for j in "123"]).reshape(3, 3, -1)

    values = equations.outputs(t, q, qd, inputs)
    R, e = rotation(values), np.array([values[f"quaternion_{frame}_{i}"] for i in range(4)])
    assert (e**2).sum(axis=0) == pytest.approx(1, rel=1e-14)
    assert matrix_of(e) == pytest.approx(R, abs=1e-14)
    assert np.linalg.det(np.moveaxis(R, -1, 0)) == pytest.approx(1, rel=1e-13)
    slope = (rotation(at(h)) - rotation(at(-h))) / (2 * h)
    spin = np.einsum("ijk,ljk->ilk", slope, R)
    w = np.array([values[f"w_{frame}_{axis}"] for axis in "xyz"])
    assert np.array([spin[2, 1], spin[0, 2], spin[1, 0]]) == pytest.approx(w, abs=1e-8)
    for axis in "xyz":
        slope = (at(h)[f"tip_{axis}"] - at(-h)[f"tip_{axis}"]) / (2 * h)
        assert slope == pytest.approx(values[f"tip_v_{axis}"], abs=1e-8)


def test_cardan_angles_are_those_of_the_rotation() -> None:
    equations, (t, q, qd) = Equations(free_symmetric_body(0.4, 0.3)), states(3)
    values = equations.outputs(t, q, qd)
    a, b, c = (values[f"a_{axis}"] for axis in "xyz")
    R = [values[f"R_{i}{j}"] for i, j in ("11", "12", "13", "23", "33")]
    expected = [np.cos(b) * np.cos(c), -np.cos(b) * np.sin(c), np.sin(b), -np.sin(a) * np.cos(b), np.cos(a) * np.cos(b)]
    assert np.array(R) == pytest.approx(np.array(expected), abs=1e-14)


def test_a_torque_about_a_joint_is_a_force_on_its_coordinate() -> None:
    equations, (t, q, qd) = Equations(double_joint()), states(2)
    by_torque = equations.accelerations(t, q, qd, {"tau_y": 1.7})
    assert by_torque == pytest.approx(equations.accelerations(t, q, qd, {"Q_q2": 1.7}), rel=1e-12)


def test_a_six_axis_arm_sinks_until_it_hangs() -> None:
    mechanism = load("six_axis_arm")
    run = integrate(mechanism, np.linspace(0, 5, 51), rtol=1e-8).trajectory
    energy = column(run, "generalized_energy")
    assert np.all(np.diff(energy) < 1e-9)
    assert column(run, "flange_z")[-1] < -0.85
    e = run.columns([f"tool_{i}" for i in range(4)])
    assert (e**2).sum(axis=1) == pytest.approx(1, rel=1e-13)
