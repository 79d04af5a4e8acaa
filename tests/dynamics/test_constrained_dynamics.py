"""Constraints in the derived equations: against the independent path on random linkages, redundant ones, bad ones."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import kkt
import numpy as np
import pytest
from sympy import cos, sin

from lag2fmu.dynamics import EquationsOfMotion, derive, lower
from lag2fmu.dynamics.consistent_starts import ambiguous
from lag2fmu.dynamics.schur_complement import solve_constrained
from lag2fmu.dynamics.starts import start_values
from lag2fmu.dynamics.terms import canonical
from lag2fmu.errors import DerivationError, MechanismError
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.mechanism import Body, Constraint, Contact, Mechanism, coordinate, parameter
from lag2fmu.reference import Equations

SEEDS = range(8)


def random_linkage(seed: int) -> Mechanism:
    """A closed planar polygon of 4 to 7 bars, with a second chain across it for odd seeds, on a skate or not.

    Angles are absolute; one more bar than needed lies on the ground, and the loop closes for the angles of the start.
    """
    generator = random.Random(seed)
    count = generator.randint(3, 6)
    g = parameter("g", 9.81)
    starts = sorted(generator.uniform(0, 2 * np.pi) for _ in range(count))
    lengths = [generator.uniform(0.5, 2.0) for _ in range(count)]
    angles = [coordinate(f"q{i}", start=a) for i, a in enumerate(starts)]
    x, y, corners, bodies = 0, 0, [(0, 0)], []
    for i, (length, angle) in enumerate(zip(lengths, angles, strict=True)):
        m, along = generator.uniform(0.5, 3.0), generator.uniform(0.2, 0.8)
        place = x + along * length * cos(angle), y + along * length * sin(angle)
        bodies.append(Body(f"bar{i}", m, place, angle=angle, inertia=m * generator.uniform(0.05, 0.3)))
        x, y = x + length * cos(angle), y + length * sin(angle)
        corners.append((x, y))
    at_start = dict(zip(angles, starts, strict=True))
    end = [float(e.subs(at_start)) for e in (x, y)]
    constraints = [Constraint("loop_x", x - end[0]), Constraint("loop_y", y - end[1])]
    if count > 4 and seed % 2:
        (x1, y1), (x2, y2) = corners[1], corners[3]
        square = (x1 - x2) ** 2 + (y1 - y2) ** 2
        constraints.append(Constraint("strut", square - float(square.subs(at_start))))
    elif count > 3:
        skate = -angles[0].dot * sin(angles[1]) + (angles[2].dot - 0.3) * cos(angles[1])
        constraints.append(Constraint("skate", skate, kind="nonholonomic"))
    return Mechanism(
        f"linkage{seed}", coordinates=angles, parameters=[g], bodies=bodies, gravity=g, constraints=constraints
    )


def states(mechanism: Mechanism, count: int = 4) -> list[dict[str, float]]:
    """States around the start, by name, on the constraints and off them."""
    generator = random.Random(11)
    names = [c.name for c in mechanism.coordinates]
    moved = {n: generator.uniform(-0.3, 0.3) for c in names for n in (c, f"{c}_dot")}
    values = []
    for scale in np.linspace(0.0, 1.0, count):
        start = start_values(mechanism)
        values.append({k: v + scale * moved.get(k, 0.0) for k, v in start.items()})
    return values


def vectors(mechanism: Mechanism, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    names = [c.name for c in mechanism.coordinates]
    return np.array([values[n] for n in names]), np.array([values[f"{n}_dot"] for n in names])


@pytest.mark.parametrize("seed", SEEDS)
def test_random_linkages_agree_with_the_independent_path(seed: int) -> None:
    equations = derive(random_linkage(seed)).apart()
    mechanism, independent = equations.mechanism, Equations(equations.mechanism)
    for values in states(mechanism):
        q, qd = vectors(mechanism, values)
        qdd, multipliers = kkt.solve(equations, values)
        scale = np.abs(qdd).max()
        assert qdd == pytest.approx(independent.accelerations(0.0, q, qd), rel=1e-8, abs=1e-9 * scale)
        found = independent.multipliers(0.0, q, qd)
        assert multipliers == pytest.approx(found, rel=1e-8, abs=1e-9 * np.abs(found).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_the_residual_vanishes_at_the_solution(seed: int) -> None:
    """M qdd - forcing - G^T multiplier and G qdd + gamma, from other nodes than those that are solved with."""
    equations = derive(random_linkage(seed)).apart()
    mechanism = equations.mechanism
    for values in states(mechanism):
        qdd, multipliers = kkt.solve(equations, values)
        given = {f"{c.name}_ddot": a for c, a in zip(mechanism.coordinates, qdd, strict=True)}
        given |= {f"multiplier_{c.name}": x for c, x in zip(mechanism.constraints, multipliers, strict=True)}
        residual = equations.graph.evaluate(equations.residual, values | given)
        assert residual == pytest.approx(np.zeros(len(residual)), abs=1e-9 * max(1.0, np.abs(multipliers).max()))


@pytest.mark.parametrize("seed", SEEDS)
def test_redundant_constraints_change_nothing(seed: int) -> None:
    """Combinations of the constraints, written once more: the same accelerations, on the constraints."""
    plain = random_linkage(seed)
    x, y = (c.expression for c in plain.constraints[:2])
    more = [Constraint("sum", 2 * x + y), Constraint("turned", x * cos(0.3) - y * sin(0.3)), Constraint("again", 5 * x)]
    redundant = replace(plain, constraints=(*plain.constraints[:2], *more, *plain.constraints[2:]))
    equations, other = derive(plain).apart(), derive(redundant).apart()
    values = start_values(equations.mechanism)
    qdd, _ = kkt.solve(equations, values)
    assert kkt.solve(other, values)[0] == pytest.approx(qdd, rel=1e-9, abs=1e-9)
    q, qd = vectors(plain, values)
    independent = Equations(redundant)
    assert independent.accelerations(0.0, q, qd) == pytest.approx(qdd, rel=1e-8, abs=1e-8)
    assert ambiguous(other.mechanism, other.graph, other.constraints) >= {"loop_x", "sum", "turned", "again"}
    assert not ambiguous(equations.mechanism, equations.graph, equations.constraints)


# ------------------------------------------------------------------------------------------------------- the formula


def formula(equations: EquationsOfMotion, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray, bool]:
    """qdd (n,), multipliers (m,) and whether they hold, by the formula on the graph."""
    g, m = equations.graph, len(equations.constraints)
    found = solve_constrained(equations, [g.symbol(f"drift {k}") for k in range(m)])
    assert found is not None
    drift = {f"drift {k}": values.get(f"drift {k}", 0.0) for k in range(m)}
    numbers = np.array(g.evaluate([*found.unknowns, *found.pivots, *found.margins], values | drift))
    unknowns, signs = np.split(numbers, [len(found.unknowns)])
    return *np.split(unknowns, [len(equations.forcing)]), bool((signs > 0).all())


@pytest.mark.parametrize("seed", SEEDS)
def test_the_formula_is_the_solution(seed: int) -> None:
    equations = derive(random_linkage(seed)).apart()
    for values in states(equations.mechanism):
        qdd, multipliers, holds = formula(equations, values)
        expected, forces = kkt.solve(equations, values)
        assert holds
        assert qdd == pytest.approx(expected, rel=1e-8, abs=1e-10 * np.abs(expected).max())
        assert multipliers == pytest.approx(forces, rel=1e-8, abs=1e-10 * np.abs(forces).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_the_formula_brings_back_what_drifts(seed: int) -> None:
    """G qdd + gamma + drift = 0"""
    equations = derive(random_linkage(seed)).apart()
    drift = {f"drift {k}": 0.1 + k for k in range(len(equations.constraints))}
    values = start_values(equations.mechanism)
    qdd, _, _ = formula(equations, values | drift)
    c = equations.constraints
    nodes = [*(entry for row in c.jacobian for entry in row), *c.accelerations]
    G, gamma = np.split(np.array(equations.graph.evaluate(nodes, values)), [len(c) * len(qdd)])
    assert G.reshape(len(c), -1) @ qdd + gamma == pytest.approx([-x for x in drift.values()], rel=1e-8)


def test_a_formula_that_is_too_long_is_not_made(monkeypatch: pytest.MonkeyPatch) -> None:
    equations = derive(load("four_bar_linkage")).apart()
    drift = [equations.graph.zero] * 2
    assert solve_constrained(equations, drift) is not None
    monkeypatch.setattr("lag2fmu.dynamics.schur_complement.MOST_OPERATIONS", 100)
    assert solve_constrained(equations, drift) is None
    accelerations = next(f for f in lower(equations).functions if f.name == "mechanism_accelerations")
    assert {node for *_, node in accelerations.results} == {equations.graph.zero}, "the engine's loops take over"


THREE_BARS = """
[mechanism]
name = "three_bars"
[coordinates]
a = { start = 1.0, velocity = 1.0 }
b = { guess = 1.0 }
c = { guess = 0.0 }
[energy]
kinetic = "a_dot**2 + b_dot**2 + c_dot**2"
potential = "sin(a)"
[constraints.holonomic]
x = "cos(a) + 2*cos(c) - cos(b) - 2"
y = "sin(a) + 2*sin(c) - sin(b)"
third = "cos(a) + 1.2*cos(c) - cos(b) - 1.2"
"""


def test_the_formula_leaves_out_what_is_redundant_and_tells_where_it_is_not() -> None:
    """A parallelogram with a third bar."""
    equations = derive(read(THREE_BARS, "three_bars.toml")).apart()
    values = start_values(equations.mechanism)
    qdd, multipliers, holds = formula(equations, values)
    assert holds
    assert qdd == pytest.approx(kkt.solve(equations, values)[0], abs=1e-9)
    assert np.count_nonzero(multipliers) == 2
    assert not formula(equations, values | {"b": 1.5, "c": 0.5})[2], "away from the parallelogram they differ"
    assert not formula(equations, values | {"c": 0.0, "a": 0.0, "b": 0.0})[2], "folded, the rows are dependent"


# ---------------------------------------------------------------------------------------------------------- starts


def test_large_velocities_are_solved_for_in_one_step() -> None:
    """The equations are linear: a guess far away costs nothing, whatever the greatest velocity is."""
    R, x = parameter("R", 0.15), coordinate("x", guess=0.0)
    phi = coordinate("phi", start=0.0, velocity=500.0)
    disc = Body("disc", 1, (x, 0), angle=-phi, inertia=0.1)
    mechanism = Mechanism(
        "disc", coordinates=[x, phi], parameters=[R], bodies=[disc], constraints=[Constraint("rolling", x - R * phi)]
    )
    assert derive(mechanism).mechanism.coordinates[0].velocity == pytest.approx(75.0, rel=1e-12)


def test_rows_of_different_size_are_solved_for() -> None:
    """Steps are damped, and go down in the norm of the scaled rows, not in the greatest residual."""
    x, y, psi = (coordinate(n, nominal=s, guess_velocity=v) for n, s, v in SLIP)
    constraints = [
        Constraint("rolling_x", x.dot + 0.018829870 * psi.dot, kind="nonholonomic"),
        Constraint("rolling_y", y.dot - 0.050580900 * psi.dot, kind="nonholonomic"),
    ]
    body = Body("body", 1, (x, y), angle=psi, inertia=1)
    mechanism = Mechanism("slip", coordinates=[x, y, psi], bodies=[body], constraints=constraints)
    found = [c.velocity for c in derive(mechanism).mechanism.coordinates]
    assert found[0] + 0.018829870 * found[2] == pytest.approx(0.0, abs=1e-12)
    assert found[1] - 0.050580900 * found[2] == pytest.approx(0.0, abs=1e-12)
    _, qd = Equations(mechanism).energies.start()
    assert qd[1] - 0.050580900 * qd[2] == pytest.approx(0.0, abs=1e-12)


SLIP = (("x", 0.1, -0.541310804), ("y", 0.1, 0.576754917), ("psi", 10.0, 14.5921706))


# ------------------------------------------------------------------------------------------------------- bad input


HEAD = """
[mechanism]
name = "bead"
[coordinates]
x = {{ {x} }}
y = {{ {y} }}
[bodies.bead]
mass = 1
position = ["x", "y"]
"""


def bead(tables: str, x: str = "guess = 1", y: str = "start = 2") -> Mechanism:
    return read(HEAD.format(x=x, y=y) + tables, "bead.toml")


def holonomic(*expressions: str) -> str:
    return "[constraints.holonomic]\n" + "\n".join(f'c{i} = "{e}"' for i, e in enumerate(expressions, 1))


def nonholonomic(*expressions: str) -> str:
    return holonomic(*expressions).replace("holonomic", "nonholonomic")


GIVEN = "start = 1"
TOGETHER = '[points.o]\nposition = [1, 2]\n[{0}s.s]\n{1} = 5\nbetween = ["o", "bead"]\n'


@pytest.mark.parametrize(
    ("tables", "x", "expected"),
    [
        (holonomic("x - 1", "x - 2"), "guess = 1", "c1 = 0.5, c2 = -0.5. No start .*: c1, c2 contradict each other"),
        (holonomic("x**2 + y**2 - 1"), GIVEN, r"residuals: c1 = 4. Near it they are met by x = 0.44\d*, y = 0.89"),
        (holonomic("x**2 + 1"), "guess = 1", "the start cannot meet .* residuals: c1 = 1.* c1 cannot be met"),
        (holonomic("sqrt(x - 3) - y"), GIVEN, "at the start constraints have no value: c1; roots of negative"),
        (holonomic("x - y + 1"), "start = 1, velocity = 1", r"velocities x_dot = 1, y_dot = 0 \(SI\) .* x_dot = 0.5"),
        (holonomic("sin(x)**2 + cos(x)**2 - 1"), GIVEN, r"constraints\.holonomic\.c1: .* is 0 whatever"),
        (holonomic("sin(x)**2 + cos(x)**2 - 3"), GIVEN, r"constraints\.holonomic\.c1: .* is -2 whatever"),
        (nonholonomic("(sin(x)**2 + cos(x)**2 - 1)*x_dot + 1"), GIVEN, r"nonholonomic\.c1: .* is 1 whatever"),
        (nonholonomic("x_dot**2 + y_dot"), GIVEN, r"constraints\.nonholonomic\.c1: '.*' is not affine in the velocit"),
        (nonholonomic("sqrt(x_dot**2 + y_dot**2) - 1"), GIVEN, r"nonholonomic\.c1: '.*' is not affine in the"),
        (holonomic("x**2 + y**2 - 5", "x - y + 1"), GIVEN, r"2 of its 2 constraints \(c1, c2\) are independent"),
        (holonomic("x*y - 2", "x - y + 1", "x - 1"), GIVEN, r"nothing can move: 2 of its 3 constraints \(c1, c2, c3\)"),
        (nonholonomic("x_dot", "y_dot"), GIVEN, "nothing can move: 2 of its 2 constraints"),
        (TOGETHER.format("damper", "damping"), GIVEN, r"dampers\.s\.between: both ends .* \(x = 1, y = 2\), at a dist"),
        (TOGETHER.format("spring", "stiffness") + "length = 1", GIVEN, r"springs\.s\.between: both ends are at"),
        (TOGETHER.format("damper", "damping") + holonomic("x - 1"), "guess = 0", r"dampers\.s\.between: both ends"),
    ],
)  # fmt: skip
def test_a_bad_constraint_gets_one_sentence(tables: str, x: str, expected: str) -> None:
    y = "start = 2, velocity = 0" if "velocity" in x else "start = 2"
    mechanism = bead(tables, x, y)
    with pytest.raises(DerivationError, match=expected) as caught:
        derive(mechanism)
    assert "\n" not in str(caught.value)


CRANK = """
[mechanism]
name = "crank"
[coordinates]
a = {{ unit = "deg", start = {a!r}, velocity = {speed!r} }}
b = {{ unit = "rad", guess = 0.1 }}
s = {{ unit = "m", guess = 0.15{more} }}
[constraints.holonomic]
loop_x = "{r!r}*cos(a) + {l!r}*cos(b) - s"
loop_y = "{r!r}*sin(a) + {l!r}*sin(b)"
[energy]
kinetic = "a_dot**2/2 + s_dot**2/2 + b_dot**2/2"
"""


@pytest.mark.parametrize("seed", range(6))
def test_a_crank_slider_says_what_is_wrong_with_its_start(seed: int) -> None:
    """Two speeds that do not fit are named with their coordinates; so is a rod that is too short for the angle."""
    rng = random.Random(seed)
    r, speed, slide = rng.uniform(0.02, 0.2), rng.uniform(1, 20000), rng.uniform(10, 20)
    fits = {"r": r, "l": 3 * r, "a": rng.uniform(20, 70), "speed": speed}
    derive(read(CRANK.format(**fits, more=""), "crank.toml"))
    named = (
        rf"start velocities a_dot = {math.radians(speed):.6g}, s_dot = {slide:.6g} \(SI\) cannot meet .* by a_dot = "
    )
    with pytest.raises(DerivationError, match=named):
        derive(read(CRANK.format(**fits, more=f", velocity = {slide!r}"), "crank.toml"))
    short = fits | {"l": rng.uniform(0.3, 0.8) * r, "a": rng.uniform(75, 105)}
    with pytest.raises(DerivationError, match=r"met by a = .*; or is a part of the loop too short to close it\?"):
        derive(read(CRANK.format(**short, more=""), "crank.toml"))


@pytest.mark.parametrize(
    "expressions", [("x - 1 - t", "y - 2"), ("x - 1", "2*x - 2"), ("x - y + 1", "y - x - 1", "3*x - 3*y + 3")]
)
def test_what_is_driven_or_redundant_is_let_pass(expressions: Sequence[str]) -> None:
    equations = derive(bead(holonomic(*expressions)))
    assert [c.start for c in equations.mechanism.coordinates] == pytest.approx([1.0, 2.0])


# ---------------------------------------------------------------------------------------- for variational integrators


@pytest.mark.parametrize("model", ["heavy_top_quaternion", "four_bar_linkage"])
def test_momenta_and_forces_are_slopes_of_the_action(model: str) -> None:
    """Anywhere, by differences of L, which is T - V on the constraints; M is the slope of the momenta, and regular."""
    equations = derive(load(model)).apart()
    g, v, parts = equations.graph, equations.variables, equations.parts
    momenta, forces = canonical(g, v, parts)
    still = [g.multiply(weight, g.multiply(x, x)) for x, weight in parts.carried.items()]
    action = g.add(parts.lagrangian(g), g.multiply(g.constant(Fraction(1, 2)), g.total(still)))
    assert len(still) == (model == "heavy_top_quaternion")
    for values in states(equations.mechanism):

        def slopes(nodes: Sequence[int], along: Sequence[int], at: dict[str, float] = values) -> np.ndarray:
            """The derivatives of ``nodes`` (k,) along ``along`` (n,), (k, n)"""
            rows, step = [], 1e-4
            for name in (str(g.leaf[node]) for node in along):
                ends = [np.array(g.evaluate(nodes, at | {name: at[name] + s * step})) for s in (-2, -1, 1, 2)]
                rows.append(np.array([1, -8, 8, -1]) @ ends / (12 * step))
            return np.array(rows).T

        assert g.evaluate(momenta, values) == pytest.approx(slopes([action], v.qd)[0], rel=1e-8, abs=1e-10)
        assert g.evaluate(forces, values) == pytest.approx(slopes([action], v.q)[0], rel=1e-8, abs=1e-10)
        M = np.array([g.evaluate(row, values) for row in equations.mass_matrix])
        assert slopes(momenta, v.qd) == pytest.approx(M, rel=1e-8, abs=1e-10)
        assert np.linalg.cond(M) < 1e6


@pytest.mark.parametrize(("rod", "height"), [(False, "-0.9"), (True, "-0.993884")], ids=["guessed", "solved for"])
def test_a_start_below_the_floor_is_refused_once_it_is_known(rod: bool, height: str) -> None:
    """A guess that no constraint decides is the start; others are solved for first: the nearest point of the rod."""
    x, y = coordinate("x", "m", guess=0.1), coordinate("y", "m", guess=-0.9)
    length, floor = parameter("l", 1.0, "m"), Contact("floor", gap=y)
    constraints = [Constraint("rod", (x**2 + y**2) / length - length)] if rod else []
    ball = Body("ball", 1, (x, y))
    mechanism = Mechanism(
        "low", coordinates=[x, y], parameters=[length], bodies=[ball], constraints=constraints, contacts=[floor]
    )
    with pytest.raises(
        MechanismError, match=rf"contacts.floor: the gap is {height}.* at the start, where y = {height}"
    ):
        derive(mechanism)
