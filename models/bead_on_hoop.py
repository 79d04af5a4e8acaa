r"""Bead on a rotating hoop: a bead slides without friction on a circle that turns about its vertical diameter.

::

          | Omega        theta   angle of the bead from the lowest point
        . - .            R       radius of the hoop
      /   |   \          Omega   angular velocity of the hoop, constant
     |    O    |         m       mass of the bead
      \   |\  /          g       gravity, along -z
        ' - o m

For Omega^2 > g/R the lowest point is unstable and the bead rests at cos(theta) = g/(R Omega^2).

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, chapter 2, exercise 18.
"""

from sympy import cos, sin

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def bead_on_hoop() -> Mechanism:
    """The mechanism with theta as generalized coordinate and a rotation that time prescribes."""
    m = parameter("m", 0.1, "kg", "mass of the bead")
    R = parameter("R", 0.2, "m", "radius of the hoop")
    Omega = parameter("Omega", 9.0, "rad/s", "angular velocity of the hoop")
    g = parameter("g", 9.81, "m/s2", "gravity")
    theta = coordinate("theta", "rad", start=0.5, doc="angle of the bead from the lowest point")

    r, z = R * sin(theta), -R * cos(theta)

    return Mechanism(
        "bead_on_hoop",
        title="Bead on a rotating hoop",
        source="H. Goldstein, C. Poole, J. Safko, Classical Mechanics, chapter 2, exercise 18",
        coordinates=[theta],
        parameters=[m, R, Omega, g],
        bodies=[Body("bead", m, (r * cos(Omega * t), r * sin(Omega * t), z))],
        gravity=g,
        outputs=[Output("z", z, "m", "height of the bead")],
        strict_units=True,
    )
