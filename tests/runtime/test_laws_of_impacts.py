"""Impacts: closed forms, all combinations of modes, balances of energy."""

from __future__ import annotations

import math

import modes
import numpy as np
import pytest
from laws import SEQUENTIAL, SIMULTANEOUS, Contact, Impact, Laws
from numpy.typing import NDArray

Array = NDArray[np.float64]


def smooth(row: int, restitution: float, loaded: bool = False) -> Contact:
    return Contact(row, 0, 0, restitution, 0.0, loaded, 0.0)


def rough(row: int, restitution: float, friction: float, slips: int = 1, loaded: bool = False) -> Contact:
    return Contact(row, row + 1, slips, restitution, friction, loaded, 0.0)


def happens(laws: Laws, mass: Array, jacobian: object, velocities: object, *contacts: Contact, **how: object) -> Impact:
    """An impact that has a solution; its balance of energy holds whatever it is."""
    found = laws.impact(np.asarray(mass), np.array(jacobian, float), np.array(velocities, float), contacts, **how)  # type: ignore[arg-type]
    assert found is not None
    before = np.asarray(velocities) @ np.atleast_2d(mass) @ np.asarray(velocities) / 2
    known = 1e-12 + 1e-15 * np.linalg.cond(mass)  # the part of the energy to which velocities along rows determine it
    assert found.gained <= known * before
    assert found.lost == pytest.approx(-found.gained, abs=known * before)
    return found


def chain(count: int) -> Array:
    """The gaps between bodies in a row."""
    return np.eye(count, k=1)[:-1] - np.eye(count)[:-1]


@pytest.mark.parametrize("count", [3, 5])
def test_cradle_in_turn(laws: Laws, count: int) -> None:
    contacts = [smooth(k, 1.0) for k in range(count - 1)]
    impact = happens(laws, np.eye(count), chain(count), np.eye(count)[0], *contacts)
    np.testing.assert_allclose(impact.velocities, np.eye(count)[-1], atol=1e-15)
    assert impact.counts == (1,) * (count - 1)
    assert impact.rounds == count - 1
    two = happens(laws, np.eye(count), chain(count), np.eye(count)[0] + np.eye(count)[1], *contacts)
    np.testing.assert_allclose(two.velocities, np.eye(count)[-1] + np.eye(count)[-2], atol=1e-15)


def test_cradle_at_once(laws: Laws) -> None:
    impact = happens(laws, np.eye(3), chain(3), [1, 0, 0], smooth(0, 1.0), smooth(1, 1.0), order=SIMULTANEOUS)
    np.testing.assert_allclose(impact.velocities, [-1 / 3, 2 / 3, 2 / 3], atol=1e-15)
    assert impact.counts == (1, 0)


@pytest.mark.parametrize("drift", [0.0, 1e-18, -1e-18, 1e-13])
def test_what_slides_elsewhere_takes_no_part(laws: Laws, drift: float) -> None:
    """A ball strikes while a block slides that it does not touch, and whose normal velocity is 0 but for rounding."""
    contacts = smooth(0, 0.8), rough(1, 0.0, 0.2, loaded=True)
    impact = happens(laws, np.diag([0.5, 1.0, 1.0]), np.eye(3), [-0.3, drift, 5.0], *contacts)
    np.testing.assert_allclose(impact.velocities, [0.24, max(drift, 0.0), 5.0], rtol=1e-12, atol=1e-15)
    assert not impact.poisson


@pytest.mark.parametrize("speed", np.linspace(0.55, 0.65, 11))
def test_friction_of_rounding_errors_obeys_its_law(laws: Laws, speed: float) -> None:
    """A jaw strikes a block on a floor: along both faces nothing moves and nothing presses, but for rounding."""
    rows = [[1, 0, -1, 0], [0, 1, 0, -1], [0, 1, 0, 0], [1, 0, 0, 0]]  # block x, y, jaw x, y
    contacts = rough(0, 0.0, 0.4), rough(2, 0.2, 0.5, loaded=True)
    impact = happens(laws, np.diag([0.5, 0.5, 0.2, 0.4]), rows, [0, 0, speed, 0], *contacts)
    np.testing.assert_allclose(impact.velocities, [speed * 2 / 7, 0, speed * 2 / 7, 0], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("friction", [0.2, 0.5, 2.0])
@pytest.mark.parametrize("part", np.linspace(0.05, 1.35, 14))
def test_a_rod_that_turns_down_into_the_floor_jams(laws: Laws, part: float, friction: float) -> None:
    """One coordinate, at a ``part`` of the angle of friction from the vertical: it rebounds beyond that angle."""
    angle, e = part * math.atan(friction), 0.8
    lever = np.array([math.sin(angle), math.cos(angle)])  # gap and slip of the tip, of a rod of length 1
    impact = happens(laws, [[0.143]], lever[:, None], [-8.2], rough(0, e, friction))
    jams = part < 1
    np.testing.assert_allclose(impact.velocities, [0.0 if jams else 8.2 * e], atol=1e-14)
    assert impact.poisson == jams
    normal, tangential = impact.impulses
    assert abs(tangential) <= friction * normal * (1 + 1e-12)
    assert normal < 1e3  # a singular problem without a solution has impulses of 1e9 that nearly solve it


@pytest.mark.parametrize("order", [SEQUENTIAL, SIMULTANEOUS])
def test_plastic_impacts_go_on_together(laws: Laws, order: int) -> None:
    impact = happens(laws, np.eye(3), chain(3), [1, 0, 0], smooth(0, 0.0), smooth(1, 0.0), order=order)
    np.testing.assert_allclose(impact.velocities, [1 / 3, 1 / 3, 1 / 3], rtol=1e-15)


def test_two_balls_dropped(laws: Laws) -> None:
    impact = happens(laws, np.diag([9.0, 1.0]), [[1, 0], [-1, 1]], [-1, -1], smooth(0, 1.0), smooth(1, 1.0))
    np.testing.assert_allclose(impact.velocities, [0.6, 2.6], rtol=1e-15)


@pytest.mark.parametrize("order", [SEQUENTIAL, SIMULTANEOUS])
def test_a_groove_keeps_the_symmetry(laws: Laws, order: int) -> None:
    for slope in (0.3, 0.8, 1.2):
        sides = [[math.sin(slope), math.cos(slope)], [-math.sin(slope), math.cos(slope)]]
        impact = happens(laws, np.eye(2), sides, [0, -2], smooth(0, 0.6), smooth(1, 0.6), order=order)
        np.testing.assert_allclose(impact.velocities, [0, 1.2], atol=1e-15)


def feet(slips: bool, height: float) -> Array:
    """Rows of four feet below the centre: coordinates x, y, z and turns about the axes."""
    rows = []
    for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
        arm = np.array([x, y, -height])
        rows += [np.concatenate([axis, np.cross(arm, axis)]) for axis in np.eye(3)[[2, 0, 1] if slips else [2]]]
    return np.array(rows)


def test_four_feet_land_at_once(laws: Laws) -> None:
    mass = np.diag([1, 1, 1, 0.4, 0.5, 0.6])
    impact = happens(laws, mass, feet(False, 0.5), [0, 0, -2, 0, 0, 0], *(smooth(k, 0.5) for k in range(4)))
    np.testing.assert_allclose(impact.velocities, [0, 0, 1, 0, 0, 0], atol=1e-14)
    np.testing.assert_allclose(impact.impulses, 3 / 4, rtol=1e-14)
    assert impact.rounds == 1


def test_four_feet_land_and_slide(laws: Laws) -> None:
    """Centre at the height of the floor: nothing tilts, friction takes mu times the impulse from the velocity."""
    for inertia in (0.5, 1e9):
        mass = np.diag([1, 1, 1, inertia, inertia, inertia])
        contacts = [rough(3 * k, 0.0, 0.25, 2) for k in range(4)]
        impact = happens(laws, mass, feet(True, 0.0), [3, 4, -2, 0, 0, 0], *contacts)
        np.testing.assert_allclose(impact.velocities, [3 * 0.9, 4 * 0.9, 0, 0, 0, 0], atol=1e-13)


@pytest.mark.parametrize(("ratio", "count"), [(1, 3), (100, 31), (10**4, 314), (10**6, 3141)])
def test_blocks_and_a_wall_count_the_digits_of_pi(laws: Laws, ratio: int, count: int) -> None:
    """Galperin, Playing pool with pi, Regular and Chaotic Dynamics 2003."""
    impact = happens(laws, np.diag([1.0, ratio]), [[1, 0], [-1, 1]], [0, -1], smooth(0, 1.0), smooth(1, 1.0))
    assert sum(impact.counts) == impact.rounds == count
    assert not impact.closed


def test_too_many_rounds_are_closed(laws: Laws) -> None:
    impact = happens(laws, np.diag([1.0, 1e8]), [[1, 0], [-1, 1]], [0, -1], smooth(0, 1.0), smooth(1, 1.0))
    assert impact.closed
    np.testing.assert_allclose(impact.velocities, 0, atol=1e-7)


@pytest.mark.parametrize("order", [SEQUENTIAL, SIMULTANEOUS])
def test_what_touches_and_does_not_approach_rests(laws: Laws, order: int) -> None:
    impact = happens(laws, np.eye(2), np.eye(2), [0.0, 1.0], smooth(0, 1.0), smooth(1, 1.0), order=order)
    assert impact.rounds == 0
    np.testing.assert_array_equal(impact.velocities, [0, 1])


def test_under_load_nothing_rebounds(laws: Laws) -> None:
    """A ball on one that lies on the floor: as on the floor. Without load the lower one rebounds, too."""
    contacts = [smooth(0, 0.5, loaded=True), smooth(1, 0.5)]
    impact = happens(laws, np.eye(2), [[1, 0], [-1, 1]], [0, -1], *contacts)
    np.testing.assert_allclose(impact.velocities, [0, 0.5], atol=1e-15)


@pytest.mark.parametrize("mass", [1.0, 2.264])
def test_a_crate_that_lands_beside_a_wall_takes_nothing_from_it(laws: Laws, mass: float) -> None:
    """The wall, against which it is pushed, and friction on the floor might balance each other; nothing makes them."""
    jacobian = [[0, 1], [1, 0], [-1, 0]]  # the floor, its slip, the wall
    contacts = rough(0, 0.4, 0.3), smooth(2, 0.0, loaded=True)
    impact = happens(laws, mass * np.eye(2), jacobian, [0, -1.3], *contacts)
    np.testing.assert_allclose(impact.velocities, [0, 0.52], atol=1e-15)
    np.testing.assert_allclose(impact.impulses, [1.82 * mass, 0, 0], atol=1e-15)


def test_permanent_constraints_hold(laws: Laws) -> None:
    """A bead on a wire strikes a wall: the constraint turns the impulse along the wire."""
    jacobian = [[1, -1], [1, 0]]  # on the wire y = x to the wall
    impact = happens(laws, np.diag([2.0, 1.0]), jacobian, [-1, -1], smooth(1, 0.5), permanent=[0])
    np.testing.assert_allclose(impact.velocities, [0.5, 0.5], rtol=1e-14)
    assert impact.rows[0] == 0.0


@pytest.mark.parametrize(("order", "after"), [(SEQUENTIAL, [1 / 6, 1 / 6, 2 / 3]), (SIMULTANEOUS, [1 / 3] * 3)])
def test_what_begins_to_hold_stops(laws: Laws, order: int, after: list[float]) -> None:
    """A latch catches a body, and what it is latched to strikes another."""
    impact = happens(laws, np.eye(3), chain(3), [1, 0, 0], smooth(1, 1.0), permanent=[0], order=order)
    np.testing.assert_allclose(impact.velocities, after, rtol=1e-14)


def test_what_cannot_move_has_no_solution(laws: Laws) -> None:
    assert (
        laws.impact(np.eye(1), np.array([[1.0], [1.0]]), np.array([-1.0]), [smooth(0, 0.5)], permanent=[1]) is not None
    )
    fixed = laws.impact(np.eye(2), np.array([[1.0, 0], [0, 0]]), np.array([-1.0, 0]), [smooth(0, 0.5)], permanent=[1])
    assert fixed is not None


@pytest.mark.parametrize(("spin", "slides"), [(0.0, False), (9.0, True), (-30.0, True)])
def test_a_ball_bounces_with_spin(laws: Laws, spin: float, slides: bool) -> None:
    """Sphere of mass 1 and radius 1: the slip stops with 2/7 of it as impulse, unless friction is too small."""
    jacobian = [[0, 1, 0], [1, 0, 1]]
    impact = happens(laws, np.diag([1, 1, 0.4]), jacobian, [0.7, -2, spin], rough(0, 0.8, 0.5))
    slip = 0.7 + spin
    push = -math.copysign(0.5 * 2 * 1.8, slip) if slides else -2 / 7 * slip
    np.testing.assert_allclose(impact.velocities, [0.7 + push, 1.6, spin + 2.5 * push], rtol=1e-14)
    assert not impact.poisson


def two_rods() -> tuple[Array, Array]:
    """Kane, Levinson, Dynamics: Theory and Applications, 1985: the tip of two hinged rods strikes the floor."""
    q1, q2 = math.radians(20), math.radians(30)
    coupling = 0.5 * math.cos(q1 - q2)
    mass = np.array([[4 / 3, coupling], [coupling, 1 / 3]])
    return mass, np.array([[math.sin(q1), math.sin(q2)], [math.cos(q1), math.cos(q2)]])


def test_newton_s_law_may_make_energy(laws: Laws) -> None:
    """Kane's example: with Newton's law energy would come from nothing; Poisson's law is taken."""
    mass, jacobian = two_rods()
    delassus, before = jacobian @ np.linalg.solve(mass, jacobian.T), jacobian @ [-0.1, -0.2]
    gains = []
    free = before + np.array([0.7 * before[0], 0.0])
    for impulses, least in modes.solutions([modes.planar(0, 1, 0.5, 0.5)], delassus[None], free[None]):
        if least[0] > -1e-12:
            gains.append(impulses[0] @ (before + delassus @ impulses[0] / 2))
    assert len(gains) == 1
    assert gains[0] > 0.0
    impact = happens(laws, mass, jacobian, [-0.1, -0.2], rough(0, 0.7, 0.5))
    plastic = happens(laws, mass, jacobian, [-0.1, -0.2], rough(0, 0.0, 0.5))
    assert impact.poisson
    assert not impact.reduced
    assert not plastic.poisson
    assert impact.impulses[0] == pytest.approx(1.7 * plastic.impulses[0], rel=1e-13)


def test_kinetic_energy_never_grows(laws: Laws) -> None:
    """Two rough contacts of random mechanisms; Newton's solution where that has no more energy."""
    rng = np.random.default_rng(7)
    kinds = {"newton": 0, "poisson": 0, "reduced": 0}
    for _ in range(300):
        jacobian, velocities = rng.normal(size=(4, 5)), rng.normal(size=5)
        contacts = [rough(0, rng.uniform(), rng.uniform(0, 1.5)), rough(2, rng.uniform(), rng.uniform(0, 1.5))]
        impact = happens(laws, np.eye(5), jacobian, velocities, *contacts, order=SIMULTANEOUS)
        kinds["reduced" if impact.reduced else "poisson" if impact.poisson else "newton"] += 1
        again = happens(laws, np.eye(5), jacobian, velocities, *contacts)
        assert (again.rows[[0, 2]] >= -1e-11).all()
        assert not again.closed
    assert kinds["newton"] > 200
    assert kinds["poisson"] > 10


@pytest.mark.parametrize("friction", [1.5, 2.0, 5.0])
def test_impact_without_collision(laws: Laws, friction: float) -> None:
    """The end of a rod slides where its acceleration has no solution: it stops, M P = what both rows say."""
    angle, speed = math.atan(2), 0.3
    jacobian = np.array([[0, 1, -math.cos(angle)], [1, 0, math.sin(angle)]])
    mass = np.diag([1, 1, 1 / 3])
    contact = rough(0, 0.5, friction, loaded=True)
    velocities = np.array([-speed, 0.0, 0.0])
    impact = happens(laws, mass, jacobian, velocities, contact, order=None)
    normal, across, along = (
        1 + 3 * math.cos(angle) ** 2,
        -3 * math.cos(angle) * math.sin(angle),
        1 + 3 * math.sin(angle) ** 2,
    )
    determinant = normal * along - across**2
    np.testing.assert_allclose(
        impact.impulses, [-across * speed / determinant, normal * speed / determinant], rtol=1e-13
    )
    np.testing.assert_allclose(impact.rows, 0, atol=1e-15)
    assert impact.counts == (1,)
    small = laws.impact(mass, jacobian, velocities, [rough(0, 0.5, 1.3, loaded=True)], None)
    assert small is None  # below 4/3 friction cannot stop the slip at once
