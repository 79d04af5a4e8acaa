"""Linkages with closed loops: against published numbers, closed kinematics, and formulations in minimal coordinates."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from one_degree import OneDegree
from scipy.integrate import solve_ivp

import lag2fmu
from lag2fmu.formats.loading import load
from lag2fmu.mechanism import Body, Constraint, Energy, Mechanism, Output, coordinate
from lag2fmu.reference import Trajectory

pytestmark = pytest.mark.fmu

G = 9.81


def test_four_bar_linkage(motion) -> None:
    """The rocker's joint B is the intersection of two circles."""
    l1, l2, d, rho = 0.1, 0.25, 0.2, 2.0

    def kinematics(a):
        x_A, y_A = l1 * np.cos(a), l1 * np.sin(a)
        x, y = -d - x_A, -y_A  # from A to C
        height = np.sqrt(l2**2 / (x * x + y * y) - 0.25)
        x_B, y_B = x_A + x / 2 + height * y, y_A + y / 2 - height * x
        c, b = np.arctan((x_B + d) / -y_B), np.arctan((x_B - x_A) / (y_A - y_B))  # but for constants
        return np.array([x_A / 2, y_A / 2, a, x_B, y_B, b, (x_B - d) / 2, y_B / 2, c])

    def rod(length):
        return [rho * length, rho * length, rho * length**3 / 12]

    inertias = [*rod(l1), *rod(2 * l2), *rod(l2)]
    linkage = OneDegree(kinematics, inertias, [0, w := G * rho * l1, 0, 0, 5 * w, 0, 0, 2.5 * w, 0])
    run = motion("four_bar_linkage", 1.0, steps=50)
    assert run["a"] == pytest.approx(linkage.run(0.5, 10.0, run.time), abs=1e-7)
    along = (
        np.array([kinematics(a)[3:5] for a in run["a"]]) * 2
        - np.array(l1 * np.array([np.cos(run["a"]), np.sin(run["a"])])).T
    )
    assert run.columns(["x_P", "y_P"]) == pytest.approx(along, abs=1e-8)


def test_hoekens_linkage_draws_a_straight_line(motion) -> None:
    """While the crank turns through its half away from the rocker, P runs 0.4 m and leaves its line by 1 mm."""
    run = motion("four_bar_linkage", 1.0, steps=500)
    part = np.cos(run["a"]) > 0
    assert np.ptp(run["x_P"][part]) == pytest.approx(0.4, rel=0.02)
    assert np.ptp(run["y_P"][part]) < 1e-3


def test_slider_crank(motion) -> None:
    l1, l2, m2, m3, J1, J2 = 0.15, 0.3, 0.151104, 0.075552, 0.002727, 0.0045339259

    def kinematics(a):
        b = -np.arcsin(l1 * np.sin(a) / l2)
        x, y = l1 * np.cos(a) + l2 / 2 * np.cos(b), l1 * np.sin(a) + l2 / 2 * np.sin(b)
        return np.array([a, x, y, b, l1 * np.cos(a) + l2 * np.cos(b)])

    crank = OneDegree(kinematics, [J1, m2, m2, J2 - m2 * l2**2 / 4, m3], np.zeros(5))
    run = motion("slider_crank", 0.1, steps=50)
    assert run["a"] == pytest.approx(crank.run(0.0, 150.0, run.time), rel=1e-8)
    assert run["x"] == pytest.approx([kinematics(a)[-1] for a in run["a"]], rel=1e-10)


def test_andrews_squeezer(motion) -> None:
    """The reference solution of the Test Set at t = 0.03 s (PSIDE at tolerance 1e-14, Cray C90)."""
    published = {
        "beta": (0.1581077119629904e2, 0.1139920302151208e4),
        "Theta": (-0.1575637105984298e2, -0.1424379294994111e4),
        "gamma": (0.4082224013073101e-1, 0.1103291221937134e2),
        "Phi": (-0.5347301163226948, 0.1929337464421385e2),
        "delta": (0.5244099658805304, 0.5735699284790808),
        "Omega": (0.5347301163226948, -0.1929337464421385e2),
        "epsilon": (0.1048080741042263e1, 0.3231791658026955),
    }
    run = motion("andrews_squeezer", 0.03, tolerance=1e-12)
    for name, (angle, rate) in published.items():
        assert run[name][-1] == pytest.approx(angle, rel=1e-9), name
        assert run[f"{name}_dot"][-1] == pytest.approx(rate, rel=1e-7), name


def test_andrews_squeezer_starts_as_published(motion) -> None:
    start = motion("andrews_squeezer", 1e-4, steps=1)
    published = {
        "beta": -0.0617138900142764496358948458001,
        "gamma": 0.455279819163070380255912382449,
        "Phi": 0.222668390165885884674473185609,
        "delta": 0.487364979543842550225598953530,
        "Omega": -0.222668390165885884674473185609,
        "epsilon": 1.23054744454982119249735015568,
    }
    assert {name: start[name][0] for name in published} == pytest.approx(published, rel=1e-13)


def legs_from_the_platform() -> Mechanism:
    """The parallel manipulator in x, y, theta: the angles of the legs by the law of cosines."""
    given = {p.name: p.value for p in load("parallel_manipulator").parameters}
    R, r, l1, l2, m1, m2, mp = (given[name] for name in ("R", "r", "l1", "l2", "m1", "m2", "mp"))
    x, y, theta = coordinate("x"), coordinate("y"), coordinate("theta")
    bodies, outputs = [Body("platform", mp, (x, y), angle=theta, inertia=mp * r**2 / 4)], []
    for i, direction in enumerate((-5 * np.pi / 6, -np.pi / 6, np.pi / 2), 1):
        foot = R * np.cos(direction), R * np.sin(direction)
        u, v = x + r * sp.cos(theta + direction) - foot[0], y + r * sp.sin(theta + direction) - foot[1]
        reach = sp.sqrt(u**2 + v**2)
        a = sp.atan2(v, u) + sp.acos((reach**2 + l1**2 - l2**2) / (2 * l1 * reach))
        b = sp.atan2(v - l1 * sp.sin(a), u - l1 * sp.cos(a))
        A = foot[0] + l1 / 2 * sp.cos(a), foot[1] + l1 / 2 * sp.sin(a)
        B = foot[0] + l1 * sp.cos(a) + l2 / 2 * sp.cos(b), foot[1] + l1 * sp.sin(a) + l2 / 2 * sp.sin(b)
        bodies += [
            Body(f"upper{i}", m1, A, angle=a, inertia=m1 * l1**2 / 12),
            Body(f"lower{i}", m2, B, angle=b, inertia=m2 * l2**2 / 12),
        ]
        outputs += [Output(f"c{i}", sp.cos(a)), Output(f"s{i}", sp.sin(a))]
    return Mechanism("from_the_platform", coordinates=[x, y, theta], bodies=bodies, outputs=outputs)


@pytest.mark.slow
def test_parallel_manipulator(motion, exported) -> None:
    run = motion("parallel_manipulator", 0.3, steps=6)
    l1, l2, r, a, b = 0.3, 0.3, 0.1, run["a1"][0], run["b1"][0]
    a_dot, b_dot, theta_dot = (run[f"{name}_dot"][0] for name in ("a1", "b1", "theta"))
    direction = run["theta"][0] - 5 * np.pi / 6
    velocity = 1j * (l1 * a_dot * np.exp(1j * a) + l2 * b_dot * np.exp(1j * b) - r * theta_dot * np.exp(1j * direction))
    starts = {name: run[name][0] for name in ("x", "y", "theta")}
    starts |= {"x_dot": velocity.real, "y_dot": velocity.imag, "theta_dot": theta_dot}
    own = lag2fmu.simulate(exported(legs_from_the_platform()), stop_time=0.3, step=0.05, tolerance=1e-11, values=starts)
    for name in ("x", "y", "theta"):
        assert run[name] == pytest.approx(own[name], abs=1e-8)
    for i in (1, 2, 3):
        assert np.cos(run[f"a{i}"]) == pytest.approx(own[f"c{i}"], abs=1e-7)
        assert np.sin(run[f"a{i}"]) == pytest.approx(own[f"s{i}"], abs=1e-7)


@pytest.mark.parametrize(
    ("n", "tolerance", "bar"), [(2, 1e-4, 0.1), (2, 1e-6, 0.02), (5, 1e-6, 0.02), (2, 1e-8, 1e-4), (5, 1e-10, 1e-6)]
)
def test_n_four_bar_goes_on_through_its_singular_positions(n: int, tolerance: float, bar: float, exported) -> None:
    """20 s and 20 passages, as a pendulum; the bar of the benchmark's low precision for B0 is 0.1."""
    check_row_of_windows(
        lag2fmu.simulate(exported("n_four_bar", n=n), stop_time=20.0, step=0.05, tolerance=tolerance), n, bar
    )


@pytest.mark.parametrize("n", [2, 5])
def test_states_between_long_steps_meet_constraints_that_are_nearly_lost(n: int, exported) -> None:
    """Steps of high order are long: points between them lie near singular positions, where corrections are small."""
    fmu = exported("n_four_bar", n=n, solver="dop853")
    run = lag2fmu.simulate(fmu, stop_time=20.0, step=0.01, tolerance=1e-6)
    check_row_of_windows(run, n, 0.02, straight=1e-8)


@pytest.mark.parametrize(("n", "tolerance", "bar"), [(2, 1e-8, 1e-3), (5, 1e-10, 1e-4)])
def test_the_importers_integrator_goes_on_through_them(n: int, tolerance: float, bar: float, exported) -> None:
    """Its constraints drift, and fmpy tells of the end of a communication step only."""
    fmu = exported("n_four_bar", n=n)
    run = lag2fmu.simulate(fmu, stop_time=20.0, step=0.05, tolerance=tolerance, kind="model-exchange")
    check_row_of_windows(run, n, bar, straight=bar)


def check_row_of_windows(run: Trajectory, n: int, bar: float, straight: float = 1e-10) -> None:
    """The benchmark's error, couplers that stay ``straight``, energy."""
    J, weight = (n + 1) / 3 + n, ((n + 1) / 2 + n) * G
    rates = lambda t, z: [z[1], -weight / J * np.cos(z[0])]  # noqa: E731
    exact = solve_ivp(rates, (0, 20), [np.pi / 2, -1.0], "DOP853", run.time, rtol=1e-12, atol=1e-12).y[0]
    assert (np.diff(np.sign(np.sin(exact))) != 0).sum() > 15
    assert run["x_B0"] == pytest.approx(np.cos(exact), abs=bar)
    assert run["y_B0"] == pytest.approx(np.sin(exact), abs=bar)
    assert max(np.abs(run[f"b{i}"]).max() for i in range(1, n + 1)) < straight
    energy = J * run["a0_dot"] ** 2 / 2 + weight * np.sin(run["a0"])
    assert np.ptp(energy) < 0.05 * bar * weight


def isosceles_slider_crank() -> Mechanism:
    """Crank and rod of one length: folded, with the slider at the pivot, the one constraint has no slope left."""
    a, b = coordinate("a", "rad", start=0.3, velocity=8.0), coordinate("b", "rad", guess=-0.3, guess_velocity=-8.0)
    x, y = 0.3 * sp.cos(a), 0.3 * sp.sin(a)
    I = 0.3**2 / 12  # noqa: E741
    return Mechanism(
        "isosceles",
        coordinates=[a, b],
        gravity=G,
        bodies=[
            Body("crank", 1, (x / 2, y / 2), angle=a, inertia=I),
            Body("rod", 1, (x + 0.15 * sp.cos(b), y + 0.15 * sp.sin(b)), angle=b, inertia=I),
            Body("slider", 2, (x + 0.3 * sp.cos(b), 0)),
        ],
        constraints=[Constraint("guide", y + 0.3 * sp.sin(b))],
    )


@pytest.mark.parametrize(
    ("kind", "tolerance", "bar"),
    [
        ("co-simulation", 1e-4, 0.1),
        ("co-simulation", 1e-7, 1e-4),
        ("co-simulation", 1e-10, 1e-7),
        ("model-exchange", 1e-8, 1e-3),
        ("model-exchange", 1e-10, 1e-5),
    ],
)
def test_a_slider_crank_goes_on_where_it_is_folded(kind: str, tolerance: float, bar: float, exported) -> None:
    """Beyond it the rod either keeps its velocity, b = -a, or turns with the crank from then on; 4 passages."""

    def kinematics(a):
        half_x, half_y = 0.15 * np.cos(a), 0.15 * np.sin(a)
        return np.array([half_x, half_y, a, 3 * half_x, half_y, -a, 4 * half_x])

    crank = OneDegree(kinematics, [1, 1, 0.0075, 1, 1, 0.0075, 2], [0, G, 0, 0, G, 0, 0])
    run = lag2fmu.simulate(exported(FOLDING), stop_time=3.0, step=0.05, tolerance=tolerance, kind=kind)
    exact = crank.run(0.3, 8.0, run.time)
    assert np.count_nonzero(np.diff(np.floor(exact / np.pi - 0.5))) >= 4
    assert run["a"] == pytest.approx(exact, abs=bar)
    assert run["b"] == pytest.approx(-run["a"], abs=1e-9 if kind == "co-simulation" else bar)


FOLDING = isosceles_slider_crank()


def parallelogram(start: float, weight: float) -> Mechanism:
    """Two cranks of length 1 and a coupler of length 2, all in one line where sin(a) is 0."""
    a, c = (coordinate(name, "rad", start=start, velocity=1.0) for name in "ac")
    b = coordinate("b", "rad", guess=0.0, guess_velocity=0.0)
    kinetic = a.dot**2 + 2 * b.dot**2 / 3 + a.dot * b.dot * sp.cos(a - b) + c.dot**2 / 2
    return Mechanism(
        "parallelogram",
        coordinates=[a, b, c],
        energy=Energy(kinetic, weight * (5 * sp.sin(a) + 3 * sp.sin(b) + 2 * sp.sin(c))),
        constraints=[
            Constraint("x", sp.cos(a) + 2 * sp.cos(b) - sp.cos(c) - 2),
            Constraint("y", sp.sin(a) + 2 * sp.sin(b) - sp.sin(c)),
        ],
    )


@pytest.mark.parametrize("start", [0.0, np.pi, 2 * np.pi])
@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_a_parallelogram_starts_where_it_is_folded(start: float, kind: str, exported) -> None:
    """One equation has no slope there but for rounding; the cranks go on with the velocity that both have."""
    run = lag2fmu.simulate(exported(parallelogram(start, 0.0)), stop_time=3.0, step=0.01, tolerance=1e-7, kind=kind)
    assert run["a"] == pytest.approx(start + run.time, abs=1e-12 if kind == "co-simulation" else 1e-4)
    assert run["c"] == pytest.approx(run["a"], abs=1e-5)


@pytest.mark.parametrize("start", [0.0, 0.05, 1.0])
def test_a_parallelogram_goes_on_as_one_in_model_exchange(start: float, exported) -> None:
    """Errors of CVode decided in one of five runs that it went on as an antiparallelogram."""
    fmu = exported(parallelogram(start, 0.1))
    rates = lambda _, z: [z[1], -0.7 * np.cos(z[0]) / 3]  # noqa: E731
    exact = solve_ivp(rates, (0, 20), [start, 1], "DOP853", rtol=1e-12, atol=1e-12).y[0, -1]
    for tolerance, bar in ((1e-6, 0.02), (1e-7, 2e-3), (1e-8, 2e-4)):
        for step in (0.005, 0.02, 0.1):
            run = lag2fmu.simulate(fmu, stop_time=20.0, step=step, tolerance=tolerance, kind="model-exchange")
            assert [run["a"][-1], run["c"][-1]] == pytest.approx([exact, exact], abs=bar)


def turn(axis: int, angle: complex) -> np.ndarray:
    matrix, j, k = np.eye(3, dtype=complex), (axis + 1) % 3, (axis + 2) % 3
    matrix[j, j] = matrix[k, k] = np.cos(angle)
    matrix[j, k], matrix[k, j] = -np.sin(angle), np.sin(angle)
    return matrix


def bricard(s: complex) -> np.ndarray:
    """Centres and axes (times the square roots of second moments) of the five rods over s = q2, 60 entries.

    By the symmetry of the ring q1 = -q3 = -q5 and q2 = -q4, and with these sin(q1) = sin(q2)/(1 - sin(q2)).
    """
    r = np.arcsin(np.sin(s) / (1 - np.sin(s)))
    edges, axes = [0, 1, 2, 0, 1], [1, 2, 0, 1, 2]
    moments = np.array([[1 / 12 if k == edge else 0.01 / 12 for k in range(3)] for edge in edges])
    R, joint, entries = np.eye(3, dtype=complex), np.zeros(3, dtype=complex), []
    for i, angle in enumerate((r, s, -r, -s, -r)):
        R = R @ turn(axes[i], angle)
        rod = R[:, edges[i]] * (1 if i < 3 else -1)
        entries += [joint + rod / 2, *(R * np.sqrt(moments[i])).T]
        joint = joint + rod
    assert joint == pytest.approx([0, 0, 1], abs=1e-12)
    return np.concatenate(entries)


def test_bricard(motion) -> None:
    weights = np.zeros(60)
    weights[1::12] = G  # the heights of the centres
    run = motion("bricard", 1.2, steps=24)
    exact = OneDegree(bricard, np.ones(60), weights).run(0.0, 0.0, run.time)
    assert exact[-1] < -3
    assert run["q2"] == pytest.approx(exact, abs=1e-7)
    assert run["q3"] == pytest.approx(-run["q1"], abs=1e-9)
    assert np.sin(run["q1"]) == pytest.approx(np.sin(exact) / (1 - np.sin(exact)), abs=1e-7)
