r"""Disintegration: a moving particle breaks up into two, driven apart by a compressed spring between them.

::

      y |        m1 o                x1, y1, x2, y2   positions of the parts
        |          /  --> V          m1, m2           their masses
        |    k, l0 \                 k                stiffness of the spring
        |          / theta0          l0               its free length; beyond that it does not pull
        |      m2 o . . .
        +---------- x

Before, both parts move with V along x. The spring releases the energy epsilon = k (l0 - r)^2/2 of its start: seen from
the mass centre both parts leave with the momentum p0 = sqrt(2 epsilon m1 m2/(m1 + m2)), and in the laboratory the first
one flies off at theta with tan(theta) = v0 sin(theta0)/(v0 cos(theta0) + V), v0 = p0/m1.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 16; values chosen.
"""

from math import cos, pi, sin

from sympy import Max, sqrt

from lag2fmu.mechanism import Body, Energy, Experiment, Mechanism, Output, coordinate, parameter

DIRECTION, DISTANCE, SPEED = pi / 3, 0.3, 3.0  # theta0, r and V at the start


def disintegration() -> Mechanism:
    """The mechanism with the Cartesian coordinates of both parts; at the start the mass centre is in the origin."""
    m1 = parameter("m1", 1.0, "kg", "mass of the first part")
    m2 = parameter("m2", 2.0, "kg", "mass of the second part")
    k = parameter("k", 400.0, "N/m", "stiffness of the spring")
    l0 = parameter("l0", 0.5, "m", "free length of the spring")
    along, across = DISTANCE * cos(DIRECTION), DISTANCE * sin(DIRECTION)
    x1 = coordinate("x1", "m", start=2 / 3 * along, velocity=SPEED, doc="first part")
    y1 = coordinate("y1", "m", start=2 / 3 * across, doc="first part")
    x2 = coordinate("x2", "m", start=-along / 3, velocity=SPEED, doc="second part")
    y2 = coordinate("y2", "m", start=-across / 3, doc="second part")

    r = sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2)

    return Mechanism(
        "disintegration",
        title="Disintegration of a particle",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 16",
        coordinates=[x1, y1, x2, y2],
        parameters=[m1, m2, k, l0],
        bodies=[Body("first", m1, (x1, y1)), Body("second", m2, (x2, y2))],
        energy=Energy(potential=k * Max(l0 - r, 0) ** 2 / 2),
        outputs=[Output("r", r, "m", "distance of the parts")],
        experiment=Experiment(stop_time=1.0, step=0.005),
        strict_units=True,
    )
