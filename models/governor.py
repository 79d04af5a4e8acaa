r"""Rotating governor: two weights on a rhombus of rods about a vertical axis, and a sleeve that slides on the axis.

::

           A               theta    angle of the rods from the axis
          /|\              a        length of each of the four rods
       a / | \             m1       mass of each weight
     m1 o  |  o m1         m2       mass of the sleeve
         \ | /             Omega    angular velocity about the axis, constant
          \|/              g        gravity, along -z
           # m2

For Omega^2 > (m1 + m2) g/(m1 a) the weights stand off the axis, at cos(theta) = (m1 + m2) g/(m1 Omega^2 a).

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 4.
"""

from sympy import cos, sin

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def governor() -> Mechanism:
    """The mechanism with theta as generalized coordinate and a rotation that time prescribes."""
    m1 = parameter("m1", 1.0, "kg", "mass of each weight")
    m2 = parameter("m2", 2.0, "kg", "mass of the sleeve")
    a = parameter("a", 0.5, "m", "length of each rod")
    Omega = parameter("Omega", 10.0, "rad/s", "angular velocity about the axis")
    g = parameter("g", 9.81, "m/s2", "gravity")
    theta = coordinate("theta", "rad", start=0.7, doc="angle of the rods from the axis")

    r, z = a * sin(theta), -a * cos(theta)
    x, y = r * cos(Omega * t), r * sin(Omega * t)

    return Mechanism(
        "governor",
        title="Rotating governor",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 4",
        coordinates=[theta],
        parameters=[m1, m2, a, Omega, g],
        bodies=[Body("weight1", m1, (x, y, z)), Body("weight2", m1, (-x, -y, z)), Body("sleeve", m2, (0, 0, 2 * z))],
        gravity=g,
        outputs=[Output("z_sleeve", 2 * z, "m", "height of the sleeve")],
        strict_units=True,
    )
