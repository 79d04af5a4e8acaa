"""Inverse dynamics: what the drives bear is what moves the mechanism so, pointwise, in time and in FMUs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import lag2fmu
from lag2fmu.analysis.evaluation import Unknowns, at, operating_inputs
from lag2fmu.analysis.inverse import inverse, needed
from lag2fmu.analysis.subspaces import null_space
from lag2fmu.cli import main
from lag2fmu.description import names
from lag2fmu.dynamics import derive
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.errors import DerivationError, ExportError, LoadError, MechanismError
from lag2fmu.graph.batches import matrix
from lag2fmu.mechanism import Mechanism, Ports, complete
from lag2fmu.mechanism.drives import carried
from lag2fmu.resources import bundled

Floats = NDArray[np.float64]

FEW = ("pendulum", "double_pendulum", "cart_pole", "four_bar_linkage", "rolling_disc")
"""A chain, a coordinate on a rail, a loop, rolling: the others are tried in 'make test-all'."""
MASSLESS = ("slides_problem_5_massless", "slides_problem_5_small")
"""A coordinate without mass follows the forces at once, so that no state can be chosen."""
HYBRID = {
    *("backlash_slider_crank", "block_on_belt", "bouncing_ball", "brake", "braked_wheel", "clutch_pair", "crane"),
    *("coulomb_oscillator", "falling_rod", "gripper", "hopper_leg", "impact_oscillator", "newtons_cradle"),
    *("pendulum_with_stop", "rocking_block", "sliding_sphere", "stack_of_blocks", "woodpecker"),
}
"""Written down, since all processes of the tests read this file: to load all models takes seconds."""
SMOOTH = [name for name in sorted(bundled()) if name not in (*MASSLESS, *HYBRID)]
REDUNDANT = ("bricard", "parallel_manipulator")
"""Multipliers of redundant constraints are those of least norm by the coordinates that there are."""


def moving(equations: EquationsOfMotion, generator: np.random.Generator) -> dict[str, float | Floats]:
    """A state near the start that meets the constraints; where there are some, at the start with other velocities."""
    m, values = equations.mechanism, operating_inputs(equations)
    q = np.array([c.start for c in m.coordinates])
    if not m.constraints:
        q = q + 0.1 * generator.uniform(-1, 1, q.size) * [c.nominal for c in m.coordinates]
    qd = generator.uniform(-1, 1, q.size) * [c.nominal for c in m.coordinates]
    state = at(equations, values, q, qd)
    if m.constraints:
        G = matrix(equations.graph, equations.constraints.jacobian, state, q.size)
        free = null_space(G / np.linalg.norm(G, axis=1, keepdims=True))
        state = at(equations, values, q, free @ (free.T @ qd))
    return state


def of_drives(equations: EquationsOfMotion) -> Callable[[dict[str, float | Floats]], tuple[Floats, Floats, Floats]]:
    """A function of a state: accelerations that are left, multipliers, and the forces of the drives."""
    solve = Unknowns(equations)
    labels = [str(equations.graph.leaf[node]) for node in equations.variables.unknowns]

    def found(values: dict[str, float | Floats]) -> tuple[Floats, Floats, Floats]:
        qdd, multipliers = solve(values)
        known = {**values, **dict(zip(labels, [*qdd, *multipliers], strict=True))}
        return qdd, multipliers, np.array(equations.graph.evaluate(equations.drives, known))

    return found


def pushed_and_driven(name: str, motions: str | list[str]) -> None:
    """Random forces push the mechanism; its inverse, moved so, bears these forces, and all else moves as before."""
    forward, driven = derive(lag2fmu.load(name)), derive(inverse(name, motions))
    generator, solve, carry = np.random.default_rng(3), Unknowns(forward), of_drives(driven)
    chosen, coordinates = [u.name for u in driven.mechanism.motions], [c.name for c in forward.mechanism.coordinates]
    chosen = [x for x in chosen if x in coordinates]
    for _ in range(3):
        values = moving(forward, generator)
        Q = {x: float(generator.uniform(-1, 1)) for x in chosen}
        values |= {names.generalized_force(x): force for x, force in Q.items()}
        qdd, multipliers = solve(values)
        accelerations = dict(zip(coordinates, qdd, strict=True))
        moved = values | {names.acceleration(x): accelerations[x] for x in chosen}
        rest, borne, forces = carry(moved)
        size = np.abs(qdd).max() + np.abs(list(Q.values())).max() + np.abs(multipliers).max(initial=0)
        assert rest == pytest.approx([accelerations[c.name] for c in driven.mechanism.coordinates], abs=1e-9 * size)
        kept = [c.name for c in driven.mechanism.constraints]
        of = dict(zip((c.name for c in forward.mechanism.constraints), multipliers, strict=True))
        if name not in REDUNDANT:
            assert borne == pytest.approx([of[x] for x in kept], abs=1e-9 * size)
        carried = dict(zip(driven.mechanism.driven, forces, strict=True))
        assert {x: carried[x] for x in chosen} == pytest.approx(Q, abs=1e-9 * size)


@pytest.mark.slow
def test_all_that_are_hybrid_are_named() -> None:
    assert {name for name in bundled() if lag2fmu.load(name).hybrid} == HYBRID


@pytest.mark.parametrize("name", FEW)
def test_the_drives_bear_what_pushes(name: str) -> None:
    pushed_and_driven(name, "all")


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SMOOTH if name not in FEW])
def test_the_drives_bear_what_pushes_bundled(name: str) -> None:
    pushed_and_driven(name, "all")


@pytest.mark.parametrize(
    ("name", "motions"),
    [("acrobot", ["q2"]), ("cart_pole", ["theta"]), ("n_four_bar", ["a2"]), ("chaplygin_sleigh", ["phi"])],
)
def test_what_is_not_driven_moves_by_itself(name: str, motions: list[str]) -> None:
    """Underactuated mechanisms: the passive coordinates have their own equations of motion."""
    pushed_and_driven(name, motions)


def test_a_motion_in_time_comes_back() -> None:
    """Feed-forward: the forces of the inverse, put on the mechanism, move it along the plan to 1e-9."""
    in_time("double_pendulum")


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in SMOOTH if name != "double_pendulum"])
def test_a_motion_in_time_comes_back_bundled(name: str) -> None:
    in_time(name)


def in_time(name: str) -> None:
    """Both sides integrated by DOP853; the plan begins at rest at the start, and moves every chosen coordinate."""
    forward, driven = derive(lag2fmu.load(name)), derive(inverse(name))
    solve, carry = Unknowns(forward), of_drives(driven)
    coordinates = [c.name for c in forward.mechanism.coordinates]
    start = operating_inputs(forward)
    chosen = [x for x in (u.name for u in driven.mechanism.motions) if x in coordinates]

    def plan(t: float, i: int) -> tuple[float, float, float]:
        w, a = 2.0 + i / 5, 0.05 * forward.mechanism.coordinates[coordinates.index(chosen[i])].nominal
        begin = float(start[chosen[i]])
        return begin + a * (1 - np.cos(w * t)), a * w * np.sin(w * t), a * w**2 * np.cos(w * t)

    def slope(t: float, x: Floats) -> Floats:
        n = len(coordinates)
        values = {**at(forward, start, x[:n], x[n : 2 * n], x[2 * n :]), "t": t}
        moved = dict(values)
        for i, q in enumerate(chosen):
            moved |= zip((q, names.velocity(q), names.acceleration(q)), plan(t, i), strict=True)
        forces = dict(zip(driven.mechanism.driven, carry(moved)[2], strict=True))
        values |= {names.generalized_force(q): float(forces[q]) for q in chosen}
        qdd, _ = solve(values)
        values |= dict(zip(map(names.acceleration, coordinates), qdd, strict=True))
        further = forward.graph.evaluate(forward.variables.further_rates, values)
        return np.concatenate([x[n : 2 * n], qdd, further])

    begin = np.array([float(start[q]) for q in coordinates])
    further = [float(start[z.name]) for z in forward.mechanism.states]
    x = np.concatenate([begin, np.zeros_like(begin), further])
    end = min(0.5, forward.mechanism.experiment.stop_time)
    found = solve_ivp(slope, (0, end), x, method="DOP853", rtol=1e-11, atol=1e-13)
    for i, q in enumerate(chosen):
        size = forward.mechanism.coordinates[coordinates.index(q)].nominal
        assert found.y[coordinates.index(q), -1] == pytest.approx(plan(end, i)[0], abs=1e-9 * size)


# ---------------------------------------------------------------------------------------------------------------- FMUs


@pytest.mark.parametrize(
    ("name", "motions"),
    [
        ("cart_pole", ["x_tip", "y_tip"]),
        ("cart_pole", "x_tip"),
        ("four_bar_linkage", "x_P"),
        ("six_axis_arm", "flange"),
        ("six_axis_arm", ["flange", "theta_4", "theta_5", "theta_6"]),
    ],
)
def test_a_guided_place_moves_as_planned(name: str, motions: str | list[str]) -> None:
    """The forces of the inverse on the coordinates of the mechanism itself move its places along the plan to 1e-9."""
    forward, driven = derive(lag2fmu.load(name)), derive(inverse(name, motions))
    m, solve, carry = driven.mechanism, Unknowns(forward), of_drives(driven)
    coordinates, follow = ([q.name for q in e.mechanism.coordinates] for e in (forward, driven))
    n, start = len(coordinates), operating_inputs(driven)
    assert set(coordinates) <= {*carried(m)}

    def state(t: float, x: Floats) -> tuple[dict[str, float | Floats], dict[str, float | Floats]]:
        plan = {key: float(value) for key, value in plan_of(m, t).items()}
        moved = at(driven, {**start, **plan, "t": t}, *np.split(x[2 * n :], 2))
        return at(forward, {**operating_inputs(forward), "t": t}, *np.split(x[: 2 * n], 2)), moved

    def slope(t: float, x: Floats) -> Floats:
        own, moved = state(t, x)
        qdd, _, forces = carry(moved)
        own |= {names.generalized_force(q): F for q, F in zip(carried(m), forces, strict=True) if q in coordinates}
        return np.concatenate([x[n : 2 * n], solve(own)[0], x[2 * n + len(follow) :], qdd])

    q = [float(start[x]) for x in coordinates]
    begin = np.array([*q, *np.zeros(n), *(float(start[x]) for x in follow), *np.zeros(len(follow))])
    end = solve_ivp(slope, (0, 0.5), begin, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    found, _ = state(0.5, end)
    plan = plan_of(m, 0.5)
    for u in m.motions:
        x = found[u.name] if u.name in coordinates else forward.graph.evaluate([forward.outputs[u.name]], found)[0]
        assert x == pytest.approx(plan[u.name], abs=1e-9)


def plan_of(m: Mechanism, t: Floats | float) -> dict[str, Floats]:
    """A plan of all motions of ``m`` at the times ``t``, at rest at the start, with both derivatives."""
    found = {}
    for u in m.motions:
        motion = (u.start + 0.1 * (1 - np.cos(3 * t)), 0.3 * np.sin(3 * t), 0.9 * np.cos(3 * t))
        found |= dict(zip((u.name, names.velocity(u.name), names.acceleration(u.name)), motion, strict=True))
    return found


@pytest.mark.fmu
def test_the_fmu_of_a_loop(tmp_path: Path) -> None:
    """It has the plan as inputs; force and power are outputs, and put onto the mechanism the force moves it so."""
    fmu = lag2fmu.export("four_bar_linkage", tmp_path / "inverse.fmu", inverse="all", page="static")
    m = fmu.mechanism
    causality = {v.name: v.causality for v in fmu.description.variables}
    assert {causality[x] for x in ("a", "a_dot", "a_ddot")} == {"input"}
    assert {causality[x] for x in ("F_a", "P_a", "b", "c", "multiplier_loop_x")} == {"output"}
    still = {names.velocity(q.name): 0.0 for q in lag2fmu.load("four_bar_linkage").coordinates}
    forward = lag2fmu.export("four_bar_linkage", tmp_path / "forward.fmu", page="static")
    errors = []
    for h in (1e-3, 5e-4):
        t = np.arange(round(1 / h) + 1) * h
        plan = {"time": t, **plan_of(m, t)}
        found = lag2fmu.simulate(fmu, inputs=plan, stop_time=1, step=h, tolerance=1e-11)
        assert found["P_a"] == pytest.approx(found["F_a"] * plan["a_dot"], rel=1e-12, abs=1e-12)
        push = {"time": t, "Q_a": found["F_a"]}
        back = lag2fmu.simulate(forward, inputs=push, values=still, stop_time=1, step=h, tolerance=1e-11)
        errors.append((back["a"] - plan["a"])[:: round(1e-3 / h)])
    assert np.abs(errors[0]).max() > 1e-6  # the force is held linear between its samples: an error of second order
    assert (4 * errors[1] - errors[0]) / 3 == pytest.approx(0, abs=1e-9)


@pytest.mark.fmu
def test_the_fmu_of_a_guided_place(tmp_path: Path) -> None:
    """The tip of the pole stays at its height: a closed form of the inverse of cart and pole."""
    fmu = lag2fmu.export("cart_pole", tmp_path / "tip.fmu", inverse=["x_tip", "y_tip"], page="static")
    causality = {v.name: v.causality for v in fmu.description.variables}
    assert {causality[x] for x in ("x_tip", "y_tip_ddot")} == {"input"}
    assert {causality[x] for x in ("x", "theta_dot", "F_x", "F_theta", "P_theta")} == {"output"}
    t = np.linspace(0, 0.5, 51)
    plan = {"time": t, **{key: value for key, value in plan_of(fmu.mechanism, t).items() if key.startswith("x_tip")}}
    v = {p.name: p.value for p in fmu.mechanism.parameters if p.value is not None}
    run = lag2fmu.simulate(fmu, inputs=plan, stop_time=0.5, step=0.01)
    assert run["theta"] == pytest.approx(np.full(51, 0.5), abs=1e-9)
    moved = (v["M"] + v["m"]) * plan["x_tip_ddot"] + v["c"] * plan["x_tip_dot"]
    turned = v["m"] * v["l"] / 2 * (np.cos(0.5) * plan["x_tip_ddot"] + v["g"] * np.sin(0.5))
    assert run["F_x"] == pytest.approx(moved, abs=1e-9)
    assert run["F_theta"] == pytest.approx(turned, abs=1e-9)


@pytest.mark.fmu
def test_positions_alone(tmp_path: Path) -> None:
    """With a filter the FMU takes positions; what it calculates belongs to the filtered motion."""
    fmu = lag2fmu.export("pendulum", tmp_path / "p.fmu", inverse="theta", time_constant=0.05, page="static")
    assert [v.name for v in fmu.description.variables if v.causality == "input"] == ["theta_target"]
    t = np.linspace(0, 1, 1001)
    start = fmu.mechanism.states[0].start
    asked = {"time": t, "theta_target": start + 0.1 * (1 - np.cos(3 * t))}
    found = lag2fmu.simulate(fmu, inputs=asked, stop_time=1, step=1e-3, tolerance=1e-10)
    values = {p.name: p.value for p in fmu.mechanism.parameters}
    target, T = asked["theta_target"][1:], 0.05
    y, y_dot = found["theta"][1:], found["theta_dot"][1:]
    slope = np.diff(asked["theta_target"]) / np.diff(t)  # what the importer gives until the time of the sample
    y_ddot = (target - y) / T**2 - 2 * (y_dot - slope) / T
    expected = values["m"] * values["l"] * (values["l"] * y_ddot + values["g"] * np.sin(y))
    assert found["F_theta"][1:] == pytest.approx(expected, abs=1e-9)


@pytest.mark.fmu
def test_both_backends_calculate_without_states(tmp_path: Path) -> None:
    found, t = [], np.linspace(0, 0.1, 11)
    for backend in ("c", "python"):
        fmu = lag2fmu.export("double_pendulum", tmp_path / f"{backend}.fmu", inverse="all", backend=backend)
        assert not any(v.state for v in fmu.description.variables)
        inputs = {"time": t, **plan_of(fmu.mechanism, t)}
        run = lag2fmu.simulate(fmu, inputs=inputs, hold=True, stop_time=0.1, step=0.01)
        found.append(run.columns(["F_theta1", "F_theta2", "P_theta1", "P_theta2"]))
    assert found[1] == pytest.approx(found[0], rel=1e-13, abs=1e-13)


@pytest.mark.slow
@pytest.mark.fmu
@pytest.mark.parametrize(
    ("name", "motions"), [("six_axis_arm", "all"), ("four_bar_linkage", "all"), ("cart_pole", ["x_tip", "y_tip"])]
)
def test_inverse_fmus_are_validated(name: str, motions: str | list[str]) -> None:
    m, t = inverse(name, motions), np.linspace(0, 1, 101)
    report = lag2fmu.validate(
        m, stop_time=1.0, inputs={"time": t, **{u.name: plan_of(m, t)[u.name] for u in m.motions}}
    )
    assert report.passed, str(report)


@pytest.mark.slow
@pytest.mark.fmu
def test_an_inverse_loop_at_rest_is_validated() -> None:
    """No motion is prescribed: what is compared is rounding, which has no relative precision."""
    assert lag2fmu.validate(inverse("four_bar_linkage", "a"), stop_time=0.5).passed


# -------------------------------------------------------------------------------------------------------------- parts


def test_parts_and_joints_are_inverted_too() -> None:
    """The coordinates of a mechanism of mechanisms, and of joints on a parent, are prescribed by their names."""
    m = inverse("two_armed_robot")
    assert not m.coordinates
    assert m.name == "two_armed_robot_inverse"
    assert needed(m) == tuple(f"P_{x.name}" for x in m.motions)


def test_a_choice_of_inputs_keeps_to_itself() -> None:
    cart = lag2fmu.load("cart_pole")
    chosen = complete(replace(cart.description, ports=Ports(inputs=["Q_x", "F"])))
    m = inverse(chosen, ["x"])
    assert m.hidden_inputs == {"Q_theta"}
    assert m.ports.drives == ("x",)


@pytest.mark.parametrize(
    ("name", "motions", "said"),
    [
        ("pendulum", "phi", "'phi' is no coordinate or place that can be prescribed; known are theta"),
        ("four_bar_linkage", ["a", "b"], "no choice of the motion of 'b' beside a; leave it out, it follows"),
        ("motion_driven_pendulum", "y0", "'y0' is no coordinate or place that can be prescribed"),
        ("cart_pole", ["x_tip", "x", "theta"], "no choice of the motion of 'theta' beside x; leave it out, it follows"),
        ("cart_pole", ["x_tip", "all"], "beside places 'all' does not tell which coordinates; name them; known are x"),
        ("bouncing_ball", "ball", "has contacts, stops, dry friction or switches, and its places cannot be guided"),
        ("spring_mass_damper", "block", "no coordinate moves block_y, so nothing can guide it there"),
        ("pendulum", ["x", "y"], "at the start x, y cannot move along all of x, y at will; name fewer places"),
    ],
)
def test_motions_that_cannot_be_given(name: str, motions: str, said: str) -> None:
    with pytest.raises(DerivationError, match=said):
        inverse(name, motions)


def test_friction_needs_a_motion_that_it_can_change() -> None:
    with pytest.raises(MechanismError, match=r"with x prescribed: frictions.floor.on.*leave out stops, friction"):
        inverse("coulomb_oscillator")


@pytest.mark.parametrize("constant", [-1.0, 0, "a"])
def test_a_time_constant_is_positive(constant: Any) -> None:
    with pytest.raises(MechanismError, match=f"time_constant: {constant!r} s; give a positive time"):
        inverse("pendulum", time_constant=constant)


def test_motions_are_names() -> None:
    with pytest.raises(LoadError, match="inverse: 5 is no list; give a list of names"):
        inverse("pendulum", 5)  # type: ignore[arg-type]
    with pytest.raises(DerivationError, match="'5' is no coordinate or place that can be prescribed"):
        inverse("pendulum", [5])  # type: ignore[list-item]


def test_a_filter_needs_motions(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="time_constant: it filters the motions of inverse dynamics"):
        lag2fmu.export("pendulum", tmp_path / "p.fmu", time_constant=0.1)


@pytest.mark.fmu
def test_the_option_of_export(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file has a name of its own, so that the FMU of the mechanism itself is not overwritten."""
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["export", "pendulum_with_stop", "--inverse", "theta", "--without", "stops"])
    assert done.exit_code == 0, done.output
    assert [path.name for path in tmp_path.iterdir()] == ["pendulum_with_stop_inverse.fmu"]
    alone = CliRunner().invoke(main, ["export", "pendulum", "--time-constant", "0.1"])
    assert alone.exit_code == 2
    assert "--time-constant goes with --inverse" in alone.stderr
