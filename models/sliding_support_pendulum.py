r"""Pendulum with a sliding support: the support is a mass of its own that moves freely along a horizontal line.

::

      =====[ m1 ]===== x     x       position of the support
             |\              phi     angle of the rod from the downward vertical
             | \ l           m1      mass of the support
          phi|  \            m2, l   mass of the bob, length of the rod
             |   o m2        g       gravity, along -y

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 2.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def sliding_support_pendulum() -> Mechanism:
    """The mechanism with x and phi as generalized coordinates; x is cyclic."""
    m1 = parameter("m1", 2.0, "kg", "mass of the support")
    m2 = parameter("m2", 1.0, "kg", "mass of the bob")
    l = parameter("l", 1.0, "m", "length of the rod")  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    x = coordinate("x", "m", doc="position of the support")
    phi = coordinate("phi", "rad", start=1.0, doc="angle of the rod from the downward vertical")

    bob = (x + l * sin(phi), -l * cos(phi))

    return Mechanism(
        "sliding_support_pendulum",
        title="Pendulum with a sliding support",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 2",
        coordinates=[x, phi],
        parameters=[m1, m2, l, g],
        bodies=[Body("support", m1, (x, 0)), Body("bob", m2, bob)],
        gravity=g,
        outputs=[Output("x_bob", bob[0], "m", "bob, horizontal"), Output("y_bob", bob[1], "m", "bob, vertical")],
        strict_units=True,
    )
