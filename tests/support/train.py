"""A cart and a wagon with a spring between them, in two FMUs or in one mechanism."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.linalg import expm

from lag2fmu import derive
from lag2fmu.analysis import linearize
from lag2fmu.mechanism import Body, Mechanism, Output, Spring, coordinate, parameter, signal

M, W, K, X, Y = 1.0, 2.0, 100.0, 0.3, -0.1
"""Masses of cart and wagon in kg, stiffness in N/m, where they start in m from where the spring has no force."""


def car() -> Mechanism:
    """A mass on which the force ``F`` acts, and a spring to ``y``, which pulls there with the force ``f``."""
    x, y, F = coordinate("x", "m", start=X), signal("y", "m", start=Y), signal("F", "N")
    m, k = parameter("m", M, "kg"), parameter("k", K, "N/m")
    return Mechanism(
        "car",
        coordinates=[x],
        inputs=[y, F],
        parameters=[m, k],
        bodies=[Body("car", m, (x, 0))],
        forces={x: F + k * (y - x)},
        outputs=[Output("f", k * (x - y), "N")],
    )


def in_one_piece() -> Mechanism:
    x, y = coordinate("x", "m", start=X), coordinate("y", "m", start=Y)
    m, w, k = parameter("m", M, "kg"), parameter("w", W, "kg"), parameter("k", K, "N/m")
    return Mechanism(
        "train",
        coordinates=[x, y],
        parameters=[m, w, k],
        bodies=[Body("cart", m, (x, 0)), Body("wagon", w, (y, 0))],
        springs=[Spring("coupling", k, elongation=x - y)],
    )


CAR = car()

WAGON_ALONE = {"m": W, "k": 0.0, "x": Y}
"""What makes the wagon of ``CAR``: its mass, no spring, and where it is."""


@cache
def wagon_in_one_piece() -> np.ndarray:
    """The position of the wagon every millisecond of a second: the equations of cart, spring and wagon are linear."""
    about = linearize(derive(in_one_piece()), q=np.zeros(2))
    step, z = expm(about.A * 1e-3), np.array([{"x": X, "y": Y}.get(name, 0.0) for name in about.states])
    found = [z]
    for _ in range(1000):
        found.append(step @ found[-1])
    return np.array(found)[:, about.states.index("y")]
