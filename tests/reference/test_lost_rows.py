"""Singular positions in the direct integration: loops whose links come to lie in one line, and go on as they were."""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from lag2fmu.mechanism import Body, Constraint, Mechanism, coordinate
from lag2fmu.reference import integrate
from lag2fmu.reference.equations import Equations

G = 9.81


def cranks(count: int, weight: float) -> Mechanism:
    """``count`` cranks of length 1 on one coupler that stays level; from three on one equation is redundant."""
    a, b, *others = (
        coordinate(name, "rad", guess=0.6 * (name != "b"), guess_velocity=0) for name in "abcd"[: count + 1]
    )
    a = coordinate("a", "rad", start=0.6, velocity=6)
    bodies = [Body("coupler", 1, (sp.cos(a) + sp.cos(b), sp.sin(a) + sp.sin(b)), b, 0.1)]
    loops = []
    for k, q in enumerate([a, *others]):
        bodies.append(Body(f"crank{k}", 1, (k + sp.cos(q) / 2, sp.sin(q) / 2), q, 0.1))
        if k:
            loops.append(Constraint(f"x{k}", sp.cos(a) + k * sp.cos(b) - k - sp.cos(q)))
            loops.append(Constraint(f"y{k}", sp.sin(a) + k * sp.sin(b) - sp.sin(q)))
    return Mechanism("cranks", coordinates=[a, b, *others], bodies=bodies, constraints=loops, gravity=sp.Float(weight))


@pytest.mark.parametrize(("count", "weight", "rtol"), [(2, 0.0, 1e-10), (2, G, 1e-9), (3, G, 1e-9)])
def test_parallel_cranks_go_on_where_all_are_in_line(count: int, weight: float, rtol: float) -> None:
    """Rounding there had led the coupler astray, off the motion that both directions of the links allow.

    What is left out in the line is put right by forces of the constraints, which keep the momentum.
    """

    def slope(_: float, z: np.ndarray) -> list[float]:
        return [z[1], -weight * (count / 2 + 1) * np.cos(z[0]) / (0.35 * count + 1)]

    times = np.linspace(0, 1.6, 33)
    exact = solve_ivp(slope, (0, 1.6), [0.6, 6], "DOP853", times, rtol=1e-12, atol=1e-12).y[0]
    assert exact[-1] > 2 * np.pi
    run = integrate(cranks(count, weight), times, rtol=rtol)
    assert run.trajectory["a"] == pytest.approx(exact, abs=1e-9)
    assert run.trajectory["b"] == pytest.approx(np.zeros(33), abs=1e-12)
    assert run.error.values.max() < 1e-5


def test_links_without_mass_fold_and_unfold() -> None:
    """A rhombus with masses at its corners, whose halves swing through each other: two of its links have no mass."""
    u, w = coordinate("u", "rad", start=0.8, velocity=-2), coordinate("w", "rad", guess=-0.8, guess_velocity=2)
    p, q = (coordinate(name, "rad", guess=at, guess_velocity=0) for name, at in (("p", -0.8), ("q", 0.8)))
    a, b = sp.Matrix([sp.cos(u), sp.sin(u)]), sp.Matrix([sp.cos(w), sp.sin(w)])
    end = a + sp.Matrix([sp.cos(p), sp.sin(p)])
    loop = b + sp.Matrix([sp.cos(q), sp.sin(q)]) - end
    rhombus = Mechanism(
        "rhombus",
        coordinates=[u, w, p, q],
        bodies=[Body("a", 1, tuple(a)), Body("b", 1, tuple(b)), Body("end", 1, (end[0], 0))],
        constraints=[Constraint("x", loop[0]), Constraint("y", loop[1]), Constraint("level", end[1])],
    )

    def slope(_: float, z: np.ndarray) -> list[float]:  # 2 T = (2 + 4 sin(u)^2) u_dot^2
        return [z[1], -4 * np.sin(z[0]) * np.cos(z[0]) * z[1] ** 2 / (2 + 4 * np.sin(z[0]) ** 2)]

    times = np.linspace(0, 1, 21)
    exact = solve_ivp(slope, (0, 1), [0.8, -2], "DOP853", times, rtol=1e-12, atol=1e-12).y[0]
    assert exact[-1] < -0.5
    run = integrate(rhombus, times, rtol=1e-10)
    assert run.trajectory["u"] == pytest.approx(exact, abs=1e-6)
    assert run.trajectory["w"] == pytest.approx(-exact, abs=1e-6)


def test_a_singular_state_does_not_tell_of_the_rank() -> None:
    """Multipliers of redundant constraints are those of least norm, wherever the equations were asked for before."""
    found = []
    for first in (1.0, 2 * np.pi + 1e-9):
        equations = Equations(cranks(3, G))
        for angle in (first, 1.0):
            state = equations.energies.state(0.0, np.array([angle, 0, angle, angle]), np.array([6.0, 0, 6.0, 6.0]))
            multipliers = equations.solved(state)[1]
        found.append(multipliers)
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_forces_of_constraints_measure_the_balance_of_energy() -> None:
    """Of cranks that turn by themselves they are the only forces: 36 N turn the coupler, at 6 m/s."""
    balance = Equations(cranks(2, 0.0)).balance(0.0, [1.0, 0.0, 1.0], [6.0, 0.0, 6.0], [0.0, 0.0, 0.0])
    assert abs(balance.residual) < 1e-12 * balance.scale
    assert balance.scale > 36
