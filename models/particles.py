r"""Interacting particles: n equal particles in the plane, with a force between each two that depends on their distance.

::

      y |    o 3                x1, y1 ... xn, yn   positions
        |  /   \                m                   mass of each
        | o --- o 1             U(r)                epsilon ((1 - exp(-(r - sigma)/a))^2 - 1) for each pair
        | 2   r                 epsilon, sigma      depth of the minimum of U, distance at which it lies
        +---------- x           a                   range of the force

L = sum m v^2/2 - sum U(r). The force fades as exp(-r/a): two groups of particles far from each other move as if each
were alone, and the Lagrangian is the sum of theirs. The start is a regular polygon that turns while its radius swings.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 5 and formula 2.7; potential of P. M. Morse; values
chosen.
"""

from math import cos, pi, sin

from sympy import exp, sqrt

from lag2fmu.mechanism import Body, Energy, Mechanism, coordinate, parameter

STRETCH, TURNING = 1.1, 0.5  # of the sides, in sigma; angular velocity of the polygon, clockwise, in rad/s


def particles(n: int = 3) -> Mechanism:
    """The mechanism with the Cartesian coordinates of ``n`` particles."""
    if not 2 <= n <= 60:
        raise ValueError(f"n = {n} particles; give 2 to 60")
    m = parameter("m", 1.0, "kg", "mass of each particle")
    epsilon = parameter("epsilon", 0.25, "J", "depth of the potential")
    sigma = parameter("sigma", 1.0, "m", "distance at which the force vanishes")
    a = parameter("a", 0.4, "m", "range of the force")
    radius, places = STRETCH / (2 * sin(pi / n)), []
    for i in range(1, n + 1):
        x, y = radius * cos(2 * pi * (i - 1) / n), radius * sin(2 * pi * (i - 1) / n)
        u, v = TURNING * y, -TURNING * x
        places.append(
            (
                coordinate(f"x{i}", "m", start=x, velocity=u, doc=f"particle {i}"),
                coordinate(f"y{i}", "m", start=y, velocity=v, doc=f"particle {i}"),
            )
        )

    potential = 0
    for i, (x, y) in enumerate(places):
        for u, v in places[:i]:
            r = sqrt((x - u) ** 2 + (y - v) ** 2)
            potential = potential + epsilon * ((1 - exp(-(r - sigma) / a)) ** 2 - 1)

    return Mechanism(
        "particles",
        title=f"{n} particles with forces between each two",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 5",
        coordinates=[q for place in places for q in place],
        parameters=[m, epsilon, sigma, a],
        bodies=[Body(f"particle{i}", m, place) for i, place in enumerate(places, start=1)],
        energy=Energy(potential=potential),
        strict_units=True,
    )
