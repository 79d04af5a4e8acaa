r"""Elastic collision: a particle meets another one at rest; they repel each other by U = beta/r^2.

::

      y |                        o ->          x1, y1, x2, y2   positions of the particles
        | m1                    / theta1       m1, m2           masses
        |  o --> v . . . . . . .               beta             strength of the repulsion
        |              m2 o                    theta1, theta2   angles at which they fly off
        +---------- x       \ theta2
                             o ->

In the frame of the mass centre both turn by chi = pi (1 - b/sqrt(b^2 + beta/E)), where b is the impact parameter and E
the energy of the relative motion. In the laboratory tan(theta1) = m2 sin(chi)/(m1 + m2 cos(chi)) and
theta2 = (pi - chi)/2.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, sections 17 and 18; values chosen.
"""

from sympy import sqrt

from lag2fmu.mechanism import Body, Energy, Experiment, Mechanism, Output, coordinate, parameter


def elastic_collision() -> Mechanism:
    """The mechanism with the Cartesian coordinates of both particles."""
    m1 = parameter("m1", 1.0, "kg", "mass of the particle that arrives")
    m2 = parameter("m2", 2.0, "kg", "mass of the particle at rest")
    beta = parameter("beta", 0.5, "N.m3", "strength of the repulsion")
    x1 = coordinate("x1", "m", start=-4.0, velocity=2.0, doc="particle that arrives")
    y1 = coordinate("y1", "m", start=0.3, doc="particle that arrives")
    x2 = coordinate("x2", "m", doc="particle at rest")
    y2 = coordinate("y2", "m", doc="particle at rest")

    r = sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2)

    return Mechanism(
        "elastic_collision",
        title="Elastic collision of two particles",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 17",
        coordinates=[x1, y1, x2, y2],
        parameters=[m1, m2, beta],
        bodies=[Body("first", m1, (x1, y1)), Body("second", m2, (x2, y2))],
        energy=Energy(potential=beta / r**2),
        outputs=[Output("r", r, "m", "distance of the particles")],
        experiment=Experiment(stop_time=5.0),
        strict_units=True,
    )
