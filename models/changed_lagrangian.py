r"""Changed Lagrangian: a mathematical pendulum to whose Lagrangian a total derivative with respect to time is added.

::

      ==O==            m       mass of the bob
        |\             l       length of the rod
        | \ l          theta   angle from the downward vertical
     theta o m         g       gravity, along -y
                       s       strength of the addition

L' = L + d/dt (s t sin(theta)) has the same equation of motion, for the action changes by its ends only. The momentum
and the generalized energy do change: p by s t cos(theta), h by -s sin(theta).

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 2, formula 2.8.
"""

from sympy import cos, sin

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter


def changed_lagrangian() -> Mechanism:
    """The mechanism with theta as generalized coordinate; s = 0 is the pendulum as usual."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    l = parameter("l", 1.0, "m", "length of the rod")  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    s = parameter("s", 5.0, "J", "strength of the addition")
    theta = coordinate("theta", "rad", start=1.0, doc="angle of the rod from the downward vertical")

    usual = m * l**2 * theta.dot**2 / 2 + m * g * l * cos(theta)
    addition = s * sin(theta) + s * t * cos(theta) * theta.dot

    return Mechanism(
        "changed_lagrangian",
        title="Pendulum with a total derivative added to its Lagrangian",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 2, formula 2.8",
        coordinates=[theta],
        parameters=[m, l, g, s],
        energy=Energy(lagrangian=usual + addition),
        strict_units=True,
    )
