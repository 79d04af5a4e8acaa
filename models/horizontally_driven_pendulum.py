r"""Horizontally driven pendulum: the support of a mathematical pendulum oscillates along a horizontal line.

::

      <--O--> x0 = a cos(gamma t)     a, gamma   amplitude and angular frequency of the support
         |\                           m, l       mass of the bob, length of the rod
         | \ l                        phi        angle of the rod from the downward vertical
      phi|  o m                       g          gravity, along -y

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 3b.
"""

from sympy import cos, sin

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def horizontally_driven_pendulum() -> Mechanism:
    """The mechanism with phi as generalized coordinate and a support that moves along x as time tells."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    l = parameter("l", 1.0, "m", "length of the rod")  # noqa: E741
    a = parameter("a", 0.1, "m", "amplitude of the support")
    gamma = parameter("gamma", 2.0, "rad/s", "angular frequency of the support")
    g = parameter("g", 9.81, "m/s2", "gravity")
    phi = coordinate("phi", "rad", start=0.3, doc="angle of the rod from the downward vertical")

    x0 = a * cos(gamma * t)

    return Mechanism(
        "horizontally_driven_pendulum",
        title="Pendulum with a horizontally driven support",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 3b",
        coordinates=[phi],
        parameters=[m, l, a, gamma, g],
        bodies=[Body("bob", m, (x0 + l * sin(phi), -l * cos(phi)))],
        gravity=g,
        outputs=[Output("x_support", x0, "m", "support")],
        strict_units=True,
    )
