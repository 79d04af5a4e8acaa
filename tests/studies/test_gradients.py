"""Gradients by adjoints: closed forms, differences of costs, forward sensitivities, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import lag2fmu
from lag2fmu.errors import ExpressionError, Lag2FmuError, LoadError, SimulationError
from lag2fmu.mechanism import (
    Body,
    Constraint,
    Contact,
    Energy,
    Friction,
    Input,
    Mechanism,
    Spring,
    coordinate,
    parameter,
)
from lag2fmu.studies.library import INPUT, PARAMETERS, STATES, compiled
from lag2fmu.studies.requests import scale_of
from lag2fmu.studies.sensitivities import directed_run
from lag2fmu.studies.tape import Tape

pytestmark = pytest.mark.fmu


def block() -> Mechanism:
    """M x'' + k x = Q from x(0) = 1, x'(0) = 0.5."""
    m, k = parameter("m", 2.0, "kg"), parameter("k", 8.0, "N/m")
    x = coordinate("x", "m", start=1.0, velocity=0.5)
    spring = Spring("spring", stiffness=k, elongation=x)
    return Mechanism("block", coordinates=[x], parameters=[m, k], bodies=[Body("body", m, (x, 0))], springs=[spring])


def test_a_cost_at_the_end_has_its_closed_form() -> None:
    """x = cos wt + 0.5/w sin wt + Q/k (1 - cos wt), w = sqrt(k/m); the cost is k x**2."""
    found = lag2fmu.gradient(
        block(), "k*x**2", over=["x", "x_dot", "k", "Q_x", "m"], stop_time=3.0, tolerance=1e-11
    )  # fmt: skip
    w, m, k, t = 2.0, 2.0, 8.0, 3.0
    c, s = np.cos(w * t), np.sin(w * t)
    x = c + 0.5 / w * s
    by_w = -t * s + 0.5 * (t * c / w - s / w**2)
    by_k = by_w / (2 * w * m)
    expected = [c, s / w, by_k + x / (2 * k), (1 - c) / k, -by_w * w / (2 * m)]
    assert found.value == pytest.approx(k * x**2, abs=1e-9)
    np.testing.assert_allclose(found.derivatives, 2 * k * x * np.array(expected), atol=1e-8)
    assert found["m"] == found.derivatives[4]
    with pytest.raises(LoadError, match="no derivative by 'mm'; did you mean 'm'"):
        found["mm"]


def test_integrals_and_sums_have_their_closed_forms() -> None:
    """From x' = 0: the integral of x**2 is t/2 + sin(2 w t)/(4 w); the sum is over samples less data."""
    times = np.linspace(0.0, 2.0, 5)
    data = {"seen": np.array([1.0, 0.0, 0.5, -0.5, 0.25])}
    found = lag2fmu.gradient(
        block(), {"integral": "x**2", "sum": "(x - seen)**2*t"}, over=["x"], data=data, times=times,
        values={"x_dot": 0.0}, tolerance=1e-11,
    )  # fmt: skip
    w, x = 2.0, np.cos(2.0 * times)
    integral = 1.0 + np.sin(4.0 * w) / (4 * w)
    assert found.value == pytest.approx(integral + ((x - data["seen"]) ** 2 * times).sum(), abs=1e-9)
    assert found["x"] == pytest.approx(2 * integral + (2 * (x - data["seen"]) * x * times).sum(), abs=1e-8)


@pytest.mark.parametrize("solver", ["dopri5", "radau5"])
def test_every_solver_under_error_control_gives_both(solver: str) -> None:
    """The end of a block between two stiff dampers, by starts, a parameter and an input: slow motion alone is left."""
    x, y, c = coordinate("x", "m"), coordinate("y", "m", start=1.0), parameter("c", 2000.0, "N*s/m")
    stiff = Mechanism(
        "stiff",
        coordinates=[x, y],
        parameters=[c],
        bodies=[Body("a", 1, (x, 0)), Body("b", 1, (y, 0))],
        springs=[Spring("s", stiffness=2e5, elongation=x - y + 1), Spring("t", stiffness=3, elongation=y)],
        forces={x: c * (y.dot - x.dot), y: c * (x.dot - y.dot)},
    )
    over, times = ["x", "y", "c", "Q_x"], [0.5, 2.0]
    forward = lag2fmu.sensitivities(stiff, over=over, outputs=["y"], times=times, tolerance=1e-9, solver=solver)
    found = lag2fmu.gradient(stiff, {"sum": "y"}, over=over, times=times, tolerance=1e-9, solver=solver)
    np.testing.assert_allclose(found.derivatives, forward.derivatives.sum(axis=(0, 1)), rtol=1e-6, atol=1e-9)
    expected = lag2fmu.sensitivities(stiff, over=over, outputs=["y"], times=times, tolerance=1e-11)
    np.testing.assert_allclose(forward.derivatives, expected.derivatives, atol=1e-7)
    if solver == "radau5":
        np.testing.assert_allclose(found.derivatives, forward.derivatives.sum(axis=(0, 1)), rtol=1e-8, atol=1e-11)


def test_an_output_in_an_integral_is_its_expression() -> None:
    found, expected = (
        lag2fmu.gradient("cart_pole", {"integral": text}, over=["l", "theta"], stop_time=0.5)
        for text in ("x_tip*y_tip", "-(x + l*sin(theta))*l*cos(theta)")
    )
    assert found.value == pytest.approx(expected.value, rel=1e-12)
    np.testing.assert_allclose(found.derivatives, expected.derivatives, rtol=1e-11)


def test_inputs_over_time_go_back_through_their_stretches() -> None:
    """The derivative of x by a constant added to a ramp, whatever the knots: (1 - cos wt)/k."""
    ramp = {"time": [0.0, 0.7, 1.3, 3.0], "Q_x": [0.0, 0.7, 1.3, 3.0]}
    found = lag2fmu.gradient(block(), "x", over=["Q_x"], inputs=ramp, stop_time=3.0, tolerance=1e-11)
    assert found["Q_x"] == pytest.approx((1 - np.cos(6.0)) / 8.0, abs=1e-9)


@pytest.mark.parametrize(
    ("cost", "options", "error", "what"),
    [
        ("y", {}, LoadError, "no variable 'y'"),
        ("3", {}, LoadError, "contains no variable"),
        ("x +", {}, ExpressionError, "cost, end"),
        ({"ende": "x"}, {}, LoadError, "'ende' is no place"),
        ({}, {}, LoadError, "the cost is empty"),
        (3, {}, LoadError, "the cost at 'end' is 3; give an expression as text"),
        ({"sum": None}, {}, LoadError, "the cost at 'sum' is None; give an expression as text"),
        ("m", {"over": ["k"]}, LoadError, "does not depend on k"),
        ("log(-1 - x**2)", {}, SimulationError, "no finite value"),
        ({"integral": "x_ddot"}, {}, Lag2FmuError, "x_ddot"),
        ({"sum": "x - y"}, {"data": {"y": [1.0]}}, LoadError, r"shape \(1,\); give one value for each of the 101"),
        ({"sum": "x - y"}, {"data": {"y": [0.0, np.nan]}, "times": [0.5, 1.0]}, LoadError, "is nan at index 1"),
        ({"sum": "x"}, {"data": {"x": [0.0]}, "times": [1.0]}, LoadError, "has the name of a variable"),
        ("x", {"over": ["nothing"]}, LoadError, "no variable 'nothing'"),
        ("x", {"times": [1.0, 0.5]}, LoadError, "ascend"),
        ("x", {"times": [0.5, "end"]}, LoadError, "the times of a study: no array of numbers"),
        ("x", {"stop_time": "long"}, LoadError, "stop time 'long' s is not positive and finite"),
        ("x", {"step": "short"}, LoadError, "step 'short' s is not positive and finite"),
        ("x", {"values": {"k": "stiff"}}, LoadError, "'k' cannot be set to 'stiff'; give a finite number"),
        ("x", {"values": ["k"]}, LoadError, r"values: \['k'\] is no mapping"),
        ("x", {"data": [0.0]}, LoadError, r"data: \[0.0\] is no mapping"),
        ("x", {"over": [5]}, LoadError, "no variable '5'"),
        ("x", {"tolerance": "small"}, LoadError, "the tolerance 'small' is no relative tolerance"),
        ({"sum": "x - y"}, {"data": {"y": ["a"]}, "times": [1.0]}, LoadError, "data 'y': no array of numbers"),
    ],
)
def test_what_is_no_cost_is_refused(cost: Any, options: dict[str, Any], error: type[Exception], what: str) -> None:
    with pytest.raises(error, match=what):
        lag2fmu.gradient(block(), cost, **{"over": ["k"], "stop_time": 1.0, **options})


def test_a_gradient_at_an_optimum_is_zero() -> None:
    """A block at rest costs nothing, whatever the spring."""
    still = {"x": 0.0, "x_dot": 0.0}
    found = lag2fmu.gradient(block(), "x**2", over=["k", "x"], values=still, stop_time=1.0)
    assert (found.value, [*found.derivatives]) == (0.0, [0.0, 0.0])


def test_a_tape_records_again() -> None:
    """What was seeded for the last run does not stay."""
    library = compiled(block(), adjoints=True)
    tape, outputs, times = Tape(library, 1), library.readable(["x"]), np.array([0.5, 1.0])
    seeds = [(library.settable("k"), 8.0)]
    found = []
    for _ in range(2):
        _, reason = tape.record({}, times, outputs, tolerance=1e-9, seeds=seeds)
        assert not reason
        found += [tape.gradient(np.ones((2, 1)))[0], tape.gradient(np.ones((2, 1)))[0]]
    assert len({float(x[0]) for x in found}) == 1


@pytest.mark.slow
def test_memory_is_given_back() -> None:
    """That of a tape, and behind it that of its study."""
    tape = Tape(compiled(block(), adjoints=True), 1)
    study, freed = tape._study, []
    tape._free, study._free = freed.append, freed.append
    wanted = [tape._handle, study.handle]
    del study, tape
    assert freed == wanted


def test_a_ball_that_comes_to_rest_is_followed_back() -> None:
    """Through impacts that accumulate: at rest nothing varies, and before that it is a ball's closed form."""
    library, t = compiled("bouncing_ball", adjoints=True), 0.7
    tape = Tape(library, 1)
    seeds, times = [(library.settable("e"), 1.0)], np.array([t, 5.0])
    _, reason = tape.record({}, times, library.readable(["y"]), tolerance=1e-9, seeds=seeds)
    assert not reason
    h, g = (float(library.variables[name].start or 0.0) for name in ("y", "g"))
    first = np.sqrt(2 * h / g)
    found, _ = tape.gradient(np.ones((2, 1)))
    assert found[0] == pytest.approx(g * first * (t - first), rel=1e-8)


def test_a_thrown_ball_rubs_until_it_slides() -> None:
    """The floor's impulses carry the weight from flight to rest, and friction has its part of each: whatever the
    restitution, x = u t - mu (g t**2/2 - v t - h) at rest."""
    mu, g, h, u, v, t = 0.2, 9.81, 0.05, 2.0, 0.1, 0.3
    coefficient, e, gravity = parameter("mu", mu), parameter("e", 0.3), parameter("g", g, "m/s2")
    x, y = coordinate("x", "m", velocity=u), coordinate("y", "m", start=h, velocity=v)
    floor = Contact("floor", gap=y, slip=(x.dot,), friction=coefficient, restitution=e)
    ball = Mechanism(
        "thrown_ball", coordinates=[x, y], parameters=[coefficient, e, gravity], bodies=[Body("ball", 1, (x, y))],
        gravity=gravity, contacts=[floor],
    )  # fmt: skip
    found = lag2fmu.gradient(ball, "x", over=["x_dot", "y_dot", "y", "g", "mu", "e"], stop_time=t, tolerance=1e-10)
    pressed = g * t**2 / 2 - v * t - h
    assert found.value == pytest.approx(u * t - mu * pressed, abs=1e-10)
    np.testing.assert_allclose(found.derivatives, [t, mu * t, mu, -mu * t**2 / 2, -pressed, 0.0], atol=1e-8)


def test_a_latch_that_holds_at_the_start_stops_by_its_impact() -> None:
    """Masses m and M that are coupled while they move apart go on with (m u + M v)/(m + M)."""
    m, M, t = 1.0, 3.0, 0.4
    x, y = coordinate("x", "m", velocity=2.0), coordinate("y", "m", velocity=-1.0)
    hold = parameter("hold", 1.0)
    hook = Constraint("hook", y - x, while_=hold)
    pair = Mechanism(
        "pair",
        coordinates=[x, y],
        parameters=[hold],
        bodies=[Body("left", m, (x, 0)), Body("right", M, (y, 1))],
        constraints=[hook],
    )
    found = lag2fmu.gradient(pair, "x", over=["x_dot", "y_dot", "x"], stop_time=t)
    np.testing.assert_allclose(found.derivatives, [t / 4, 3 * t / 4, 1.0], atol=1e-9)


def test_what_touches_at_the_start_comes_back_by_impacts() -> None:
    """A bead at X = x + y on a floor, u to the right, goes X = u t - mu (g t**2/2 - v t - h), as from height h."""
    mu, u, t = 0.2, 2.0, 0.4
    x, y = coordinate("x", "m", velocity=u), coordinate("y", "m")
    floor = Contact("floor", gap=y, slip=(x.dot + y.dot,), friction=mu, restitution=0.3)
    bead = Mechanism("bead", coordinates=[x, y], bodies=[Body("bead", 1, (x + y, y))], gravity=9.81, contacts=[floor])
    found = lag2fmu.gradient(bead, "x", over=["x", "x_dot", "y_dot", "y"], stop_time=t)
    np.testing.assert_allclose(found.derivatives, [1.0, t, (1 + mu) * t, 1 + mu], atol=1e-9)


@pytest.mark.parametrize("tolerance", [1e-8, 1e-11])
def test_a_ball_that_begins_to_roll_is_followed_through_the_end_of_its_slip(tolerance: float) -> None:
    """Its slip w keeps its direction and ends after tau = 2 |w|/(7 mu g): the velocity is v - 2 w/7 from there on."""
    mu, g, r, t = 0.1, 9.81, 0.1, 0.25
    v, spin = np.array([-0.6, 1.0]), np.array([-8.0, 0.0])
    friction = parameter("mu", mu)
    x, y, z = coordinate("x", "m", velocity=v[0]), coordinate("y", "m", velocity=v[1]), coordinate("z", "m")
    a, b = coordinate("a", "rad", velocity=spin[0]), coordinate("b", "rad", velocity=spin[1])
    floor = Contact("floor", gap=z, slip=(x.dot - r * b.dot, y.dot + r * a.dot), friction=friction)
    ball = Mechanism(
        "ball", coordinates=[x, y, z, a, b], parameters=[friction], gravity=g, contacts=[floor],
        bodies=[Body("ball", 1, (x, y, z))], energy=Energy(kinetic=0.2 * r**2 * (a.dot**2 + b.dot**2)),
    )  # fmt: skip
    w = v + r * np.array([-spin[1], spin[0]])
    speed, along = np.hypot(*w), w / np.hypot(*w)
    slides = 2 * speed / (7 * mu * g)
    # x = v t - 2/7 w (t - slides/2), differentiated by v, by w, and by what w contains
    by_w = -2 / 7 * ((t - slides / 2) * np.eye(2) - slides / 2 * np.outer(along, along))
    expected = np.column_stack([t * np.eye(2) + by_w, r * by_w[:, 1], -2 / 7 * w * slides / (2 * mu)])
    found = lag2fmu.sensitivities(
        ball, over=["x_dot", "y_dot", "a_dot", "mu"], outputs=["x", "y"], stop_time=t, step=t, tolerance=tolerance
    )
    np.testing.assert_allclose(found.derivatives[-1], expected, atol=1e-9)


def test_a_latch_keeps_its_place_where_a_friction_comes_to_rest() -> None:
    """Masses move at 1 m/s, are hooked as they are at 0.1 s, and a dry friction stops both: their distance stays."""
    x, y, clock = coordinate("x", "m", velocity=1.0), coordinate("y", "m", start=0.5, velocity=1.0), sp.Symbol("t")
    pair = Mechanism(
        "stopped", coordinates=[x, y], bodies=[Body("left", 1, (x, 0)), Body("right", 3, (y, 1))],
        constraints=[Constraint("hook", y - x, while_=clock - 0.1)], frictions=[Friction("brake", x.dot, 8.0)],
    )  # fmt: skip
    for over, expected in (("x", [1.0, 0.0]), ("y", [0.0, 1.0])):
        run = lag2fmu.sensitivities(pair, over=[over], outputs=["x", "y", "x_dot"], stop_time=1.0, step=1.0)
        assert run["x_dot"][-1] == 0
        np.testing.assert_allclose(run.derivatives[-1, :2, 0], expected, atol=1e-9)
    back = lag2fmu.gradient(pair, "x + 2*y", over=["x", "y"], stop_time=1.0)
    np.testing.assert_allclose(back.derivatives, [1.0, 2.0], atol=1e-9)


@pytest.mark.parametrize("hold", ["hold", "t"])
def test_a_latch_catches_where_an_input_jumps(hold: str) -> None:
    """A force F pulls 1 kg from rest, and 2 kg pass at 1 m/s; at 1 s both are hooked as they are.

    By F the places are 1/2 and 0 there, and the velocities 1 and 0, of which both keep 1/3; the force goes on.
    """
    force, x, y = parameter("F", 0.5, "N"), coordinate("x", "m"), coordinate("y", "m", velocity=1.0)
    condition = sp.Symbol("hold") - 0.5 if hold == "hold" else sp.Symbol("t") - 1.0
    pair = Mechanism(
        "caught", coordinates=[x, y], bodies=[Body("left", 1, (x, 0)), Body("right", 2, (y, 1))], parameters=[force],
        inputs=[Input("hold")], forces={x: force}, constraints=[Constraint("hook", y - x, while_=condition)],
    )  # fmt: skip
    signals = {"time": [0.0, 1.0, 2.0], "hold": [0.0, 1.0, 1.0]}
    asked: dict[str, Any] = {"over": ["F"], "stop_time": 2.0, "inputs": signals, "hold": True}
    run = lag2fmu.sensitivities(pair, outputs=["x", "y", "x_dot"], step=1.0, **asked)
    np.testing.assert_allclose(run.derivatives[-1, :, 0], [1.0, 0.5, 2.0 / 3.0], atol=1e-9)
    np.testing.assert_allclose(lag2fmu.gradient(pair, "x + 4*y", **asked).derivatives, [3.0], atol=1e-9)


def test_what_is_held_at_the_start_shares_momentum() -> None:
    """A dry friction that holds masses m and M together, and a latch that catches them as they are."""
    m, M, t = 1.0, 3.0, 0.4
    x, y = coordinate("x", "m", velocity=2.0), coordinate("y", "m", start=0.5, velocity=2.0)
    bodies = [Body("left", m, (x, 0)), Body("right", M, (y, 1))]
    rubs = Mechanism("rubs", coordinates=[x, y], bodies=bodies, frictions=[Friction("clutch", y.dot - x.dot, 0.5)])
    hook = Constraint("hook", y - x, while_=parameter("hold", 1.0))
    hooked = Mechanism(
        "hooked", coordinates=[x, y], bodies=bodies, constraints=[hook], parameters=[parameter("hold", 1.0)]
    )
    for pair in (rubs, hooked):
        found = lag2fmu.gradient(pair, "x", over=["x_dot", "y_dot", "x", "y"], stop_time=t)
        np.testing.assert_allclose(found.derivatives, [t / 4, 3 * t / 4, 1.0, 0.0], atol=1e-9)


def test_friction_in_space_that_does_not_act_leaves_derivatives_finite() -> None:
    """An open contact has no direction of its friction; a dry friction slides beside it, F = 0.5 along y."""
    x, y, z = coordinate("x", "m", velocity=1.0), coordinate("y", "m", velocity=0.5), coordinate("z", "m", start=0.5)
    flying = Mechanism(
        "flying", coordinates=[x, y, z], bodies=[Body("body", 1, (x, y, z))],
        contacts=[Contact("floor", gap=z, slip=(x.dot, y.dot), friction=0.2)],
        frictions=[Friction("guide", y.dot, 0.5)],
    )  # fmt: skip
    found = lag2fmu.gradient(flying, "x + 2*y", over=["x_dot", "y_dot", "z"], stop_time=0.2)
    np.testing.assert_allclose(found.derivatives, [0.2, 0.4, 0.0], atol=1e-9)


def test_a_plate_that_falls_flat_is_followed_back() -> None:
    """Its two edges, without restitution, lift each other in turn ever less. Then it slides, and friction has had its
    part of all impulses: x = u t - mu (g t**2/2 - h)."""
    mu, g, h, half, u, tilt, t = 0.1, 9.81, 0.02, 0.1, 2.0, 0.05, 0.5
    x, y, turn = coordinate("x", "m", velocity=u), coordinate("y", "m", start=h), coordinate("turn", "rad", start=tilt)
    coefficient = parameter("mu", mu)
    edges = [
        Contact(name, gap=y + side * half * turn, slip=(x.dot,), friction=coefficient, restitution=0)
        for name, side in (("left", -1), ("right", 1))
    ]
    plate = Mechanism(
        "plate", coordinates=[x, y, turn], parameters=[coefficient], gravity=g, contacts=edges,
        bodies=[Body("plate", 1, (x, y), angle=turn, inertia=0.03)],
    )  # fmt: skip
    found = lag2fmu.gradient(plate, "x", over=["x_dot", "y", "turn", "mu"], stop_time=t, tolerance=1e-9)
    np.testing.assert_allclose(found.derivatives, [t, mu, 0.0, h - g * t**2 / 2], atol=1e-7)


def test_what_varies_alone_is_tried_where_no_run_can_be_recorded() -> None:
    """Balls that touch part beside the motion, but not by their mass, which the energy is proportional to."""
    energy = "kinetic_energy + potential_energy"
    found = lag2fmu.gradient("newtons_cradle", energy, over=["m"], stop_time=2.0)
    assert found["m"] == pytest.approx(found.value / 0.1, rel=1e-9)
    with pytest.raises(SimulationError, match=r"newtons_cradle.*has no gradient.*has no derivative"):
        lag2fmu.gradient("newtons_cradle", "a", over=["e"], stop_time=2.0)


def test_a_slip_that_turns_round_is_followed_back() -> None:
    """A particle on a rough plane is pushed against its slip, and swerves: v' = F/m ex - mu g v/|v|. SciPy integrates
    that together with its derivatives by the start of v."""
    x, y = coordinate("x", "m", velocity=-1.0), coordinate("y", "m", velocity=0.3)
    z, mu, g, push = coordinate("z", "m"), 0.2, 9.81, 4.0
    thrown = Mechanism(
        "thrown", coordinates=[x, y, z], bodies=[Body("body", 1, (x, y, z))], gravity=g, forces={x: push},
        contacts=[Contact("table", gap=z, slip=(x.dot, y.dot), friction=mu)],
    )  # fmt: skip

    def slope(_: float, at: np.ndarray) -> np.ndarray:
        v, moved = at[2:4], at[4:].reshape(4, 2)
        speed = np.hypot(*v)
        turning = -mu * g * (np.eye(2) - np.outer(v, v) / speed**2) / speed
        return np.hstack(
            [v, np.array([push, 0.0]) - mu * g * v / speed, moved[2:].ravel(), (turning @ moved[2:]).ravel()]
        )

    start = np.hstack([0.0, 0.0, -1.0, 0.3, np.vstack([np.zeros((2, 2)), np.eye(2)]).ravel()])
    end = solve_ivp(slope, (0.0, 0.5), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    found = lag2fmu.gradient(thrown, "x + 2*y", over=["x_dot", "y_dot"], stop_time=0.5, tolerance=1e-10)
    assert found.value == pytest.approx(end[0] + 2 * end[1], rel=1e-8)
    np.testing.assert_allclose(found.derivatives, np.array([1.0, 2.0]) @ end[4:8].reshape(2, 2), rtol=1e-7)


SMOOTH = (
    "acrobot", "andrews_squeezer", "bead_on_hoop", "bricard", "cart_pole", "chaplygin_sleigh", "double_pendulum",
    "four_bar_linkage", "free_body", "furuta_pendulum", "heavy_top_quaternion", "humanoid_planar",
    "motion_driven_pendulum", "n_pendulum", "parallel_manipulator", "rattleback", "rolling_disc", "six_axis_arm",
    "slides_problem_5_massless", "spherical_pendulum", "whipple_bicycle", "wilberforce_pendulum",
)  # fmt: skip
HYBRID = (
    "block_on_belt", "bouncing_ball", "brake", "braked_wheel", "clutch_pair", "coulomb_oscillator", "crane", "dc_motor",
    "disintegration", "falling_rod", "hopper_leg", "impact_oscillator", "pendulum_with_stop", "rocking_block",
    "stack_of_blocks", "woodpecker",
)  # fmt: skip
NOISY = {"gripper": 1e-8, "sliding_sphere": 1e-6}
"""Models whose derivatives are that far from each other: at events both are differences, and round."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "accuracy"), [*((name, 1e-9) for name in (*SMOOTH, *HYBRID)), *NOISY.items()]
)  # fmt: skip
def test_gradients_are_those_of_forward_sensitivities(model: str, accuracy: float) -> None:
    compared(model, accuracy, "dop853", 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "model",
    ["andrews_squeezer", "cart_pole", "chaplygin_sleigh", "crane", "four_bar_linkage", "hopper_leg",
     "impact_oscillator", "n_pendulum", "six_axis_arm", "slides_problem_5_massless", "whipple_bicycle"],
)  # fmt: skip
def test_implicit_steps_go_back_too(model: str) -> None:
    compared(model, 1e-9, "radau5", 1e-11)


def compared(model: str, accuracy: float, solver: str, tolerance: float) -> None:
    """A random weighted sum of all variables at seven times, by all that can vary."""
    library = compiled(model, solver=solver, adjoints=True)
    kinds = (*STATES, "VARIABLE_LOCAL", "VARIABLE_ACCELERATION", "VARIABLE_MULTIPLIER", "VARIABLE_DEPENDENT")
    names = [name for name, kind in library.kinds.items() if kind in kinds]
    over = [
        name for name, kind in library.kinds.items()
        if kind in (*PARAMETERS, INPUT) or (kind == STATES[0] and library.variables[name].initial == "exact")
    ]  # fmt: skip
    times = np.linspace(0.0, library.experiment.stop_time, 7)
    forward = directed_run(library, over, names, values={}, times=times, tolerance=tolerance)
    tape = Tape(library, len(over))
    seeds = [(library.settable(name), scale_of(library, name, {})) for name in over]
    _, reason = tape.record({}, times, library.readable(names), tolerance=tolerance, seeds=seeds)
    weights = np.random.default_rng(0).standard_normal((len(times), len(names)))
    found, why = tape.gradient(weights)
    assert [forward.reason, reason, why] == ["", "", ""]
    terms = weights[:, :, None] * forward.result.derivatives
    size = abs(terms).sum(axis=(0, 1))
    np.testing.assert_array_less(abs(found - terms.sum(axis=(0, 1))), accuracy * (size + 1e-3 * size.max()) + 1e-30)
