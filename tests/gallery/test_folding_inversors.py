"""Peaucellier's inversor, whose rhombus folds to a line: two equations of its loops are lost there at once."""

import numpy as np
import pytest
import sympy as sp
from one_degree import OneDegree

import lag2fmu
from lag2fmu.mechanism import Body, Constraint, Mechanism, Output, coordinate

pytestmark = pytest.mark.fmu

G, LONG, SIDE, CRANK = 9.81, 0.5, 0.2, 0.2
REACH = 2 * CRANK - (LONG - SIDE)
"""By how much the pivot's distance from the crank's tip exceeds that of the folded rhombus at most."""


def inversor() -> Mechanism:
    """Bars O-A, O-D, a rhombus A-B-P-D, and a crank to B, whose pivot is as far from O as B is from it."""
    p = coordinate("p", "rad", start=0.4)
    names = {"u1": 0.9, "u2": -0.5, "v1": -0.7, "v2": 1.2, "w1": -0.7, "w2": 1.2}
    u1, u2, v1, v2, w1, w2 = (coordinate(name, "rad", guess=at, guess_velocity=0) for name, at in names.items())

    def along(length: float, angle: sp.Expr) -> sp.Matrix:
        return length * sp.Matrix([sp.cos(angle), sp.sin(angle)])

    tip, a, d = sp.Matrix([CRANK, 0]) + along(CRANK, p), along(LONG, u1), along(LONG, u2)
    end = a + along(SIDE, w1)
    loops = (a + along(SIDE, v1) - tip, d + along(SIDE, v2) - tip, d + along(SIDE, w2) - end)
    places = {"tip": (1, tip), "a": (0.3, a), "d": (0.3, d), "end": (0.5, end)}
    return Mechanism(
        "inversor",
        coordinates=[p, u1, u2, v1, v2, w1, w2],
        bodies=[Body(name, mass, tuple(at)) for name, (mass, at) in places.items()],
        constraints=[
            Constraint(f"{axis}{i}", row) for i, loop in enumerate(loops) for axis, row in zip("xy", loop, strict=True)
        ],
        outputs=[Output("along", end[0])],
        gravity=sp.Float(G),
    )


def kinematics(w: complex) -> np.ndarray:
    """The places of tip, a, d, end, and the angles p and u1 over w; sin(w) is 0 where the rhombus is folded."""
    distance = LONG - SIDE + REACH * np.sin(w) ** 2  # of the tip from O
    half = np.arcsin(np.sqrt(REACH / (4 * CRANK)) * np.cos(w))
    angle, wide = 2 * half, np.sin(w) * np.sqrt(REACH * (SIDE + LONG - distance) / (4 * LONG * distance))
    opening = 2 * np.arcsin(wide)
    lengths = (distance, LONG, LONG, (LONG**2 - SIDE**2) / distance)
    turned = (angle, angle + opening, angle - opening, angle)
    places = [part for r, q in zip(lengths, turned, strict=True) for part in (r * np.cos(q), r * np.sin(q))]
    return np.array([*places, 2 * angle, angle + opening])


@pytest.mark.parametrize(("tolerance", "bar"), [(1e-6, 1e-3), (1e-9, 1e-4)])
def test_an_inversor_goes_on_where_its_rhombus_is_folded(tolerance: float, bar: float, exported) -> None:
    """Bars A and D change sides there. What is left of rows that are about to be lost was taken for a kink at 1e-9."""
    masses = np.repeat([1, 0.3, 0.3, 0.5], 2)
    weights = [*(G * masses * np.tile([0, 1], 4)), 0, 0]
    start = np.arccos(np.sin(0.1) / np.sqrt(REACH / (4 * CRANK)))
    crank = OneDegree(kinematics, [*masses, 0, 0], weights)
    run = lag2fmu.simulate(exported(inversor()), stop_time=2.0, step=0.02, tolerance=tolerance)
    exact = crank.run(start, 0.0, run.time)
    assert np.count_nonzero(np.diff(np.floor(exact / np.pi))) >= 3
    p, u1 = kinematics(exact)[-2:]
    assert run["p"] == pytest.approx(p, abs=bar)
    assert run["u1"] == pytest.approx(u1, abs=bar)
    assert run["along"] == pytest.approx((LONG**2 - SIDE**2) / (2 * CRANK), abs=1e-9)
