r"""Pendulum with a circling support: the support moves uniformly on a vertical circle.

::

        . - .              a, gamma   radius of the circle, angular velocity of the support
       '  O  o             m, l       mass of the bob, length of the rod
        ' - '|\            phi        angle of the rod from the downward vertical
          phi| \ l         g          gravity, along -y
             |  o m

The support starts at the right of its circle and moves upwards first.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 3a.
"""

from sympy import cos, sin

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def circling_support_pendulum() -> Mechanism:
    """The mechanism with phi as generalized coordinate and a support that moves as time tells."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    l = parameter("l", 1.0, "m", "length of the rod")  # noqa: E741
    a = parameter("a", 0.1, "m", "radius of the circle")
    gamma = parameter("gamma", 2.0, "rad/s", "angular velocity of the support")
    g = parameter("g", 9.81, "m/s2", "gravity")
    phi = coordinate("phi", "rad", start=0.5, doc="angle of the rod from the downward vertical")

    x0, y0 = a * cos(gamma * t), a * sin(gamma * t)

    return Mechanism(
        "circling_support_pendulum",
        title="Pendulum with a circling support",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 3a",
        coordinates=[phi],
        parameters=[m, l, a, gamma, g],
        bodies=[Body("bob", m, (x0 + l * sin(phi), y0 - l * cos(phi)))],
        gravity=g,
        outputs=[Output("x_support", x0, "m", "support"), Output("y_support", y0, "m", "support")],
        strict_units=True,
    )
