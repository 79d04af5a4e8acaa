r"""Vertically driven pendulum: the support of a mathematical pendulum moves by a law of time, y0 = A cos(Omega t).

::

        ^ y0 = A cos(Omega t)
        |
      --O--             A, Omega   amplitude and angular frequency of the support
        |\              l   length of the rod
        | \ l           m   mass of the bob
      theta\            theta   angle from the downward vertical
        |   o m         g   gravity, along -y

Explicit time makes the energy T + V change: the support does work. For A^2 Omega^2 > 2 g l the upright position is
stable.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 3c, and section 30, problem 1 (Kapitza's pendulum).
"""

from sympy import cos, sin

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def vertically_driven_pendulum() -> Mechanism:
    """The mechanism with theta as generalized coordinate and a support that moves along y as time tells."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    l = parameter("l", 1.0, "m", "length of the rod")  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    A = parameter("A", 0.05, "m", "amplitude of the support")
    Omega = parameter("Omega", 10.0, "rad/s", "angular frequency of the support")
    theta = coordinate("theta", "rad", start=0.5, doc="angle of the rod from the downward vertical")

    y0 = A * cos(Omega * t)
    x, y = l * sin(theta), y0 - l * cos(theta)

    return Mechanism(
        "vertically_driven_pendulum",
        title="Pendulum with a vertically driven support",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 3c",
        coordinates=[theta],
        parameters=[m, l, g, A, Omega],
        bodies=[Body("bob", m, (x, y))],
        gravity=g,
        outputs=[Output("y_support", y0, "m", "height of the support"), Output("y", y, "m", "bob, vertical")],
        strict_units=True,
    )
