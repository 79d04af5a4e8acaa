r"""Slowly shortened pendulum: the string is drawn up through the support at a constant rate.

::

        ^ c              l = l0 - c t   length of the string
      ==O==              c              rate of the shortening
        |\               m              mass of the bob
        | \ l            theta          angle from the downward vertical
     theta o m           g              gravity, along -y

While l changes slowly, energy/frequency stays about constant: the amplitude grows as l^(-3/4).

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 49 (adiabatic invariants).
"""

from sympy import cos, sin

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def shortened_pendulum() -> Mechanism:
    """The mechanism with theta as generalized coordinate and a length that time prescribes."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    l0 = parameter("l0", 2.0, "m", "length of the string at time 0")
    c = parameter("c", 0.1, "m/s", "rate of the shortening")
    g = parameter("g", 9.81, "m/s2", "gravity")
    theta = coordinate("theta", "rad", start=0.1, nominal=0.1, doc="angle from the downward vertical")

    length = l0 - c * t

    return Mechanism(
        "shortened_pendulum",
        title="Slowly shortened pendulum",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 49",
        coordinates=[theta],
        parameters=[m, l0, c, g],
        bodies=[Body("bob", m, (length * sin(theta), -length * cos(theta)))],
        gravity=g,
        outputs=[Output("l", length, "m", "length of the string")],
        strict_units=True,
    )
