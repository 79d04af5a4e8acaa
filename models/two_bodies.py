r"""Two bodies: two particles in the plane that attract each other by -alpha/r.

::

      y |        o m2        x1, y1, x2, y2   positions of the particles
        |      /             m1, m2           masses
        |    / r             alpha            strength of the attraction
        |  o m1              r                distance
        +---------- x

The distance vector moves as one particle of the reduced mass m1 m2/(m1 + m2) in the field -alpha/r; the centre of mass
goes straight on.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 13.
"""

from sympy import sqrt

from lag2fmu.mechanism import Body, Energy, Mechanism, Output, coordinate, parameter


def two_bodies() -> Mechanism:
    """The mechanism with the Cartesian coordinates of both particles."""
    m1 = parameter("m1", 1.0, "kg", "mass of the first particle")
    m2 = parameter("m2", 2.0, "kg", "mass of the second particle")
    alpha = parameter("alpha", 4.0, "N.m2", "strength of the attraction")
    x1 = coordinate("x1", "m", start=-1.0, doc="first particle")
    y1 = coordinate("y1", "m", velocity=-1.5, doc="first particle")
    x2 = coordinate("x2", "m", start=0.5, doc="second particle")
    y2 = coordinate("y2", "m", velocity=1.0, doc="second particle")

    r = sqrt((x2 - x1) ** 2 + (y2 - y1) ** 2)

    return Mechanism(
        "two_bodies",
        title="Two bodies that attract each other",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 13",
        coordinates=[x1, y1, x2, y2],
        parameters=[m1, m2, alpha],
        bodies=[Body("first", m1, (x1, y1)), Body("second", m2, (x2, y2))],
        energy=Energy(potential=-alpha / r),
        outputs=[Output("r", r, "m", "distance")],
        strict_units=True,
    )
