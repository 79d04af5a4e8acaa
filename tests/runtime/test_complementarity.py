"""The laws of contacts and dry friction: against all combinations of modes, the laws themselves, closed forms."""

from __future__ import annotations

import math

import modes
import numpy as np
import pytest
from laws import Laws, Row, bilateral, bounded, normal, sliding, tangential
from numpy.typing import NDArray

Array = NDArray[np.float64]
G = 9.81
COUNT = 1500


def random_problems(seed: int, rows: int, coordinates: int) -> tuple[Array, Array]:
    """delassus[COUNT, rows, rows] and free[COUNT, rows] of random mechanisms, masses over two orders of magnitude."""
    rng = np.random.default_rng(seed)
    jacobian = rng.normal(size=(COUNT, rows, coordinates))
    masses = 10 ** rng.uniform(-1, 1, size=(COUNT, coordinates))
    delassus = np.einsum("bik,bk,bjk->bij", jacobian, 1 / masses, jacobian)
    return delassus, np.einsum("bik,bk->bi", jacobian, rng.normal(size=(COUNT, coordinates)))


def compare(
    laws: Laws, rows: list[Row], elements: list[list[modes.Mode]], coordinates: int, seed: int
) -> NDArray[np.bool_]:
    """Each solution is one of those that the combinations give, and there is one just where they have any.

    Returns which problems are solved.
    """
    delassus, free = random_problems(seed, len(rows), coordinates)
    solved, forces, _ = laws.solve_all(delassus, free, rows)
    nearest, possible = np.full(COUNT, np.inf), np.zeros(COUNT, bool)
    for candidate, least in modes.solutions(elements, delassus, free):
        size = np.abs(candidate).max(axis=1) + 1
        difference = np.abs(candidate - forces).max(axis=1) / size
        nearest = np.where(least > -1e-9 * size, np.minimum(nearest, difference), nearest)
        possible |= least > 1e-9 * size
    assert nearest[solved].max() < 1e-10
    assert not (possible & ~solved).any()
    assert not (solved & np.isinf(nearest)).any()
    return solved


def test_contacts_at_rest_have_one_of_the_solutions(laws: Laws) -> None:
    rows = [bilateral(), normal(), tangential(1, 0.4), normal(), tangential(3, 1.5), bounded(0.3)]
    elements = [
        modes.bilateral(0),
        modes.planar(1, 2, 0.4, 0.4),
        modes.planar(3, 4, 1.5, 1.5),
        modes.bounded(5, 0.3, 0.3),
    ]
    assert compare(laws, rows, elements, 8, seed=1).all()


def test_friction_at_rest_may_be_greater(laws: Laws) -> None:
    rows = [normal(), tangential(0, 0.3, 0.6), bounded(0.3, 0.5), normal(), tangential(3, 0.2, 0.9)]
    elements = [modes.planar(0, 1, 0.3, 0.6), modes.bounded(2, 0.3, 0.5), modes.planar(3, 4, 0.2, 0.9)]
    assert compare(laws, rows, elements, 7, seed=2).all()


def test_contacts_that_slide_may_have_no_solution(laws: Laws) -> None:
    ways = [(0, 3.0, 1.0), (2, 2.0, -1.0), (4, 3.5, 1.0)]
    rows = [row for n, friction, way in ways for row in (normal(), sliding(n, friction, way))]
    elements = [modes.sliding(n, n + 1, friction, way) for n, friction, way in ways]
    rows, elements = [*rows, normal(), tangential(6, 1.0)], [*elements, modes.planar(6, 7, 1.0, 1.0)]
    solved = compare(laws, rows, elements, 8, seed=3)
    assert 0.5 * COUNT < solved.sum() < COUNT


def test_more_contacts_than_coordinates(laws: Laws) -> None:
    """Twelve contacts in the plane on six coordinates; the motion is unique where friction is light."""
    rows = [row for n in range(0, 24, 2) for row in (normal(), tangential(n, 0.3))]
    delassus, free = (part[:200] for part in random_problems(11, 24, 6))
    solved, forces, w = laws.solve_all(delassus, free, rows)
    assert solved.all()
    assert forces[:, 0::2].min() >= -1e-12
    assert w[:, 0::2].min() >= -1e-12
    assert np.abs(np.minimum(forces[:, 0::2], w[:, 0::2])).max() < 1e-11
    assert (np.abs(forces[:, 1::2]) <= 0.3 * forces[:, 0::2] + 1e-11).all()


@pytest.mark.parametrize(("slips", "contacts", "coordinates", "friction"), [(1, 6, 4, 0.6), (2, 3, 5, 1.5)])
def test_contacts_stick_if_there_is_any_way(
    laws: Laws, slips: int, contacts: int, coordinates: int, friction: float
) -> None:
    """A linear program tells where forces exist; for round cones by pyramids outside and inside of them.

    Contacts that part by themselves are left out: they need no forces.
    """
    size = contacts * (1 + slips)
    rows = [row for n in range(0, size, 1 + slips) for row in (normal(), *[tangential(n, friction)] * slips)]
    delassus, free = (part[:150] for part in random_problems(12, size, coordinates))
    solved, _, w = laws.solve_all(delassus, free, rows)
    rests = ~w.any(axis=1)
    assert solved.all()
    assert 20 < rests.sum() < 130
    for i in np.flatnonzero((free[:, :: 1 + slips] < 0).any(axis=1)):
        rest = rests[i]
        assert modes.ways_to_rest(delassus[i], free[i], friction, slips, outside=bool(rest)) == rest


def test_friction_that_wedges(laws: Laws) -> None:
    """A large coefficient: the normal direction hardly counts against the friction it makes."""
    delassus = np.array([[1.0, 0.41263753, 0.1189938], [0.41263753, 0.83746039, -0.65499177],
                         [0.1189938, -0.65499177, 1.16253961]])  # fmt: skip
    free = np.array([-0.84559378, -1.5390226, 0.54926609])
    for friction in np.geomspace(0.1, 200, 60):
        solved, forces, _ = laws.solve(delassus, free, [normal(), tangential(0, friction), tangential(0, friction)])
        assert solved
        assert cone_violation(delassus[None], free[None], forces[None], [(0, friction)])[0] < 1e-11


def cone_violation(delassus: Array, free: Array, forces: Array, contacts: list[tuple[int, float]]) -> Array:
    """How far lambda and w are from the laws of contacts (row of the normal, friction), the slips in the next rows."""
    w = free + np.einsum("bij,bj->bi", delassus, forces)
    size = np.abs(free).max(axis=1) + np.einsum("bij,bj->bi", np.abs(delassus), np.abs(forces)).max(axis=1)
    worst = np.zeros(len(free))
    for n, friction in contacts:
        load, slip, drag = forces[:, n], w[:, n + 1 : n + 3], forces[:, n + 1 : n + 3]
        speed = np.linalg.norm(slip, axis=1)
        excess = np.maximum(np.linalg.norm(drag, axis=1) - friction * load, 0.0)
        power = (drag * slip).sum(axis=1) + friction * load * speed
        parts = [np.maximum(-load, 0), np.maximum(-w[:, n], 0), load * w[:, n], excess, power]
        worst = np.maximum(worst, np.max(np.abs(parts), axis=0) / size)
    return worst


def test_round_cones_obey_the_laws(laws: Laws) -> None:
    """Coulomb's law is: the force is in the cone and takes all the power it can."""
    rows = [bilateral()]
    for n in (1, 4, 7):
        rows += [normal(), tangential(n, 0.2 * n), tangential(n, 0.2 * n)]
    delassus, free = random_problems(4, 10, 12)
    solved, forces, w = laws.solve_all(delassus, free, rows)
    assert solved.all()
    violation = cone_violation(delassus[solved], free[solved], forces[solved], [(n, 0.2 * n) for n in (1, 4, 7)])
    assert violation.max() < 1e-10
    assert np.abs(w[:, 0]).max() == 0.0


def test_round_cones_may_hold_more_than_they_slide(laws: Laws) -> None:
    """What slides does so with the sliding coefficient, what sticks needs no more than the holding one."""
    rows = [row for n in (0, 3) for row in (normal(), tangential(n, 0.3, 0.8), tangential(n, 0.3, 0.8))]
    delassus, free = random_problems(10, 6, 8)
    solved, forces, w = laws.solve_all(delassus, free, rows)
    assert solved.all()
    seen = 0
    for n in (0, 3):
        load, drag = forces[:, n], np.linalg.norm(forces[:, n + 1 : n + 3], axis=1)
        slides = np.linalg.norm(w[:, n + 1 : n + 3], axis=1) > 0.0
        assert (drag <= 0.8 * load + 1e-9).all()
        np.testing.assert_allclose(drag[slides], 0.3 * load[slides], atol=1e-9)
        seen += (~slides & (drag > 0.3 * load + 1e-9)).sum()
    assert seen > 100


def test_a_foot_lands_beside_one_that_slides(laws: Laws) -> None:
    """The impulse of a landing foot would pull one that slides 25000 times as fast: that one bears nothing."""
    delassus = np.zeros((6, 6))
    delassus[np.triu_indices(6)] = (
        *(9.82, 7.35, 0.34, 0.01, 0.01, 0.02),
        *(9.76, 0.16, 0.0, 0.03, 0.08),
        *(5.68, 0.01, 0.01, 0.09),
        *(7.72, 7.16, 0.23),
        *(12.22, 0.17),
        6.94,
    )
    delassus += np.triu(delassus, 1).T
    free = np.array([0.0, 4.5, -0.18, -0.00018, -1.7, -1.6])
    rows = [row for n in (0, 3) for row in (normal(), tangential(n, 0.8), tangential(n, 0.8))]
    solved, forces, motion = laws.solve(delassus, free, rows)
    slip = motion[4:6] / np.linalg.norm(motion[4:6])
    alone = 1.8e-4 / (delassus[3, 3] - 0.8 * delassus[3, 4:6] @ slip)
    assert solved
    assert forces == pytest.approx([0, 0, 0, alone, *(-0.8 * alone * slip)], rel=1e-9, abs=1e-20)
    assert motion[0] > 0.0


def test_round_cones_of_few_coordinates(laws: Laws) -> None:
    """Nine rows of contacts, five coordinates: forces are not unique, motions may wedge."""
    rows = [row for n in (0, 3, 6) for row in (normal(), tangential(n, 1.5), tangential(n, 1.5))]
    delassus, free = random_problems(9, 9, 5)
    solved, forces, _ = laws.solve_all(delassus, free, rows)
    assert solved.all()
    assert cone_violation(delassus, free, forces, [(n, 1.5) for n in (0, 3, 6)]).max() < 1e-9


def test_the_axes_of_a_cone_do_not_matter(laws: Laws) -> None:
    delassus, free = random_problems(5, 6, 8)
    rows = [normal(), tangential(0, 0.3), tangential(0, 0.3), normal(), tangential(3, 0.5), tangential(3, 0.5)]
    turn = np.eye(6)
    for first, angle in ((1, 0.7), (4, 2.1)):
        c, s = math.cos(angle), math.sin(angle)
        turn[first : first + 2, first : first + 2] = [[c, s], [-s, c]]
    solved, forces, _ = laws.solve_all(delassus, free, rows)
    turned_solved, turned, _ = laws.solve_all(turn @ delassus @ turn.T, free @ turn.T, rows)
    assert solved.all()
    assert turned_solved.all()
    assert np.abs(forces @ turn.T - turned).max() < 1e-10 * np.abs(forces).max()


def table(feet: Array) -> Array:
    """Jacobian[3 * feet, 6] of a body's feet (normal, two slips each) at height -0.5 below its centre."""
    rows = []
    for x, y in feet:
        arm = np.array([x, y, -0.5])
        rows += [np.concatenate([axis, np.cross(arm, axis)]) for axis in np.eye(3)[[2, 0, 1]]]
    return np.array(rows)


FEET = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])
FEET_ROWS = [row for n in (0, 3, 6, 9) for row in (normal(), tangential(n, 0.5), tangential(n, 0.5))]


def test_four_legs_share_the_weight(laws: Laws) -> None:
    jacobian = table(FEET)
    delassus = jacobian @ jacobian.T
    solved, forces, w = laws.solve(delassus, jacobian @ [0.0, 0, -G, 0, 0, 0], FEET_ROWS)
    assert solved
    np.testing.assert_allclose(forces, np.tile([G / 4, 0, 0], 4), atol=1e-13)
    assert not w.any()


@pytest.mark.parametrize("resting", [0, 1])
def test_feet_that_slide_share_the_load_as_feet_that_give_way_alike(laws: Laws, resting: int) -> None:
    """Friction makes another sharing another motion. The first foot may begin to slip from rest.

    What feet give way is proportional to their loads, and the places of four feet are in one plane.
    """
    directions = [(1.0, 0.0), (0.6, -0.8), (0.0, 1.0), (-0.28, 0.96)]
    jacobian = table(FEET)
    delassus, free = jacobian @ jacobian.T, jacobian @ [0.0, 0, -G, 0, 0, 0]
    rows = [normal(holds=True), *[tangential(0, 0.5, holds=True)] * 2] * resting
    for n in range(len(rows), 12, 3):
        rows += [normal(holds=True), *[sliding(n, 0.5, along) for along in directions[n // 3]]]
    solved, forces, w = laws.solve(delassus, free, rows)
    loads = forces[0::3]
    assert solved
    assert not w[0::3].any()
    assert loads.min() > 0.1 * G
    assert loads[0] + loads[2] == pytest.approx(loads[1] + loads[3], rel=1e-6)
    for n in range(resting, 4):
        assert forces[3 * n + 1 : 3 * n + 3] == pytest.approx(-0.5 * loads[n] * np.array(directions[n]), rel=1e-12)
    assert resting == 0 or cone_violation(delassus[None], free[None], forces[None], [(0, 0.5)])[0] < 1e-11


@pytest.mark.parametrize(("pull", "acceleration"), [(0.4 * G, 0.0), (0.6 * G, 0.1 * G)])
def test_four_legs_are_dragged(laws: Laws, pull: float, acceleration: float) -> None:
    """A body of mass 1, pulled at the height of its feet so that it does not tilt."""
    jacobian = table(FEET)
    free = jacobian @ (np.array([pull, 0, -G, 0, 0, 0]) + np.array([0, 0, 0, 0, -0.5 * pull, 0]))
    solved, forces, w = laws.solve(jacobian @ jacobian.T, free, FEET_ROWS)
    assert solved
    assert forces[0::3].sum() == pytest.approx(G, rel=1e-13)
    assert forces[1::3].sum() == pytest.approx(acceleration - pull, rel=1e-12)
    np.testing.assert_allclose(w[1::3], acceleration, atol=1e-12)


def test_bilateral_rows_may_be_redundant(laws: Laws) -> None:
    """Three times the same constraint beside a contact; they share the load."""
    jacobian = np.array([[1.0, 0], [1, 0], [1, 0], [1, 1]])
    rows = [bilateral(), bilateral(), bilateral(), normal()]
    solved, forces, w = laws.solve(jacobian @ jacobian.T, jacobian @ [-3.0, -2.0], rows)
    assert solved
    np.testing.assert_allclose(forces, [1 / 3, 1 / 3, 1 / 3, 2], rtol=1e-13)
    assert not w.any()


def test_a_contact_that_constraints_determine(laws: Laws) -> None:
    """The contact cannot move: it bears nothing, or is at rest by rounding errors alone."""
    jacobian = np.array([[0.3, 0.7], [0.1, -0.9], [0.4, -0.2], [0.2, 1.6]])
    rows = [bilateral(), bilateral(), normal(), tangential(2, 0.4)]
    for seed in range(20):
        motion = np.random.default_rng(seed).normal(size=2)
        solved, forces, w = laws.solve(jacobian @ jacobian.T, jacobian @ motion, rows)
        assert solved
        assert not w.any()
        np.testing.assert_allclose(jacobian.T @ forces, -motion, atol=1e-12)


def rod(angle: float, friction: float, free: float, holds: bool) -> tuple[Array, Array, list[Row]]:
    """A rod of mass 1 and length 2 that slides on its lower end, inclined by an angle to the floor.

    Its end is at x - cos(angle), y - sin(angle), and slides so that friction presses it to the floor.
    """
    jacobian = np.array([[0, 1, -math.cos(angle)], [1, 0, math.sin(angle)]])
    delassus = jacobian @ np.diag([1, 1, 3.0]) @ jacobian.T
    return delassus, np.array([free, 0.0]), [normal(0.0, holds), sliding(0, friction, -1.0)]


@pytest.mark.parametrize("angle", [0.5, math.atan(2), 1.3])
def test_painleve(laws: Laws, angle: float) -> None:
    """No solution or two just above the coefficient that the textbooks give, one below."""
    critical = (4 + math.tan(angle) ** 2) / (3 * math.tan(angle))
    assert critical >= 4 / 3 - 1e-15
    for friction, above in ((critical * (1 - 1e-9), False), (critical * (1 + 1e-9), True)):
        assert laws.solve(*rod(angle, friction, -1.0, False))[0] != above
        opened = laws.solve(*rod(angle, friction, 1.0, False))
        assert opened[0]
        assert not opened[1].any()
        closed = laws.solve(*rod(angle, friction, 1.0, True))
        assert (closed[1][0] > 0.0) == above
        assert closed[2][0] == (0.0 if above else 1.0)


@pytest.mark.parametrize("pull", [1e-15, 1e-12, 1e-9])
def test_a_contact_does_not_pull(laws: Laws, pull: float) -> None:
    """One that holds at present opens when its force would be negative, however little."""
    jacobian = np.array([[1.0, 0], [1, 1]])
    rows = [normal(0.0, True), normal(0.0, True)]
    solved, forces, w = laws.solve(jacobian @ jacobian.T, jacobian @ np.array([-G, pull * G]), rows)
    assert solved
    assert forces.min() >= 0.0
    assert w[1] == pytest.approx(pull * G, rel=1e-3, abs=1e-14)


@pytest.mark.parametrize("slips", [1, 2])
@pytest.mark.parametrize("excess", [1e-12, 1e-10])
def test_a_contact_does_not_stick_beyond_its_cone(laws: Laws, slips: int, excess: float) -> None:
    """One that sticks at present slides when it would need more friction, however little."""
    rows = [normal(0.0, True)] + [tangential(0, 0.5, holds=True)] * slips
    for factor, slides in ((1 - excess, False), (1 + excess, True)):
        solved, forces, w = laws.solve(np.eye(1 + slips), np.array([-G, 0.5 * G * factor, 0][: 1 + slips]), rows)
        assert solved
        assert (w[1] > 0.0) == slides
        assert forces[1] >= -0.5 * G * (1 + 1e-15)


def test_a_block_with_dry_friction(laws: Laws) -> None:
    """Mass 2 under a force: it is held up to the greatest holding force, then the sliding force acts."""
    for force, expected in ((4.9, 0.0), (5.1, (5.1 - 3) / 2), (-7.0, -2.0)):
        solved, forces, w = laws.solve(np.array([[0.5]]), np.array([force / 2]), [bounded(3.0, 5.0)])
        assert solved
        assert w[0] == pytest.approx(expected, abs=1e-15)
        assert forces[0] == pytest.approx(2 * expected - force, rel=1e-15)


def test_islands_are_solved_as_if_they_were_alone(laws: Laws) -> None:
    """Two mechanisms in one problem, a joint with dry friction between the rows of a foot, and a row that is free."""
    foot = [normal(), tangential(0, 0.4), tangential(0, 0.4)]
    joint = [bilateral(), bounded(0.3)]
    of_foot, of_joint, free_row = [0, 3, 4], [1, 5], 2
    one, free_one = random_problems(21, 3, 3)
    two, free_two = random_problems(22, 2, 3)
    delassus, free = np.zeros((len(one), 6, 6)), np.zeros((len(one), 6))
    for places, part, motion in ((of_foot, one, free_one), (of_joint, two, free_two)):
        delassus[np.ix_(range(len(one)), places, places)] = part
        free[:, places] = motion
    delassus[:, free_row, free_row], delassus[:, free_row, 0], delassus[:, 0, free_row] = 1.0, 0.1, 0.1
    delassus[:, free_row, 5], delassus[:, 5, free_row] = 0.2, 0.2
    rows = [foot[0], joint[0], Row(), *foot[1:], joint[1]]
    solved, forces, motions = laws.solve_all(delassus, free, rows)
    assert solved.all()
    for places, part, motion, alone in ((of_foot, one, free_one, foot), (of_joint, two, free_two, joint)):
        found, force, _ = laws.solve_all(part, motion, alone)
        assert found.all()
        np.testing.assert_array_equal(forces[:, places], force)
    seen = np.einsum("nij,nj->ni", delassus, forces)[:, free_row]
    np.testing.assert_allclose(motions[:, free_row], seen, rtol=1e-12, atol=1e-13)


def test_equal_problems_have_equal_bits(laws: Laws) -> None:
    delassus, free = random_problems(6, 9, 9)
    rows = [row for n in (0, 3, 6) for row in (normal(), tangential(n, 0.4), tangential(n, 0.4))]
    first, second = (laws.solve_all(delassus, free, rows) for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
