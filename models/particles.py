r"""Interacting particles: n equal particles in the plane, with a force between each two that depends on their distance.

::

      y |    o 3                x1, y1 ... xn, yn   positions
        |  /   \                m                   mass of each
        | o --- o 1             U(r)                epsilon ((sigma/r)^12 - 2 (sigma/r)^6) for each pair
        | 2   r                 epsilon, sigma      depth of the minimum of U, distance at which it lies
        +---------- x

L = sum m v^2/2 - sum U(r). The force fades with the seventh power of the distance: two groups of particles far from
each other move as if each were alone, and the Lagrangian is the sum of theirs. The start is a regular polygon that
turns while its radius swings.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 5 and formula 2.7; potential of J. E. Lennard-Jones.
"""

from math import cos, pi, sin

from sympy import sqrt

from lag2fmu.mechanism import Body, Energy, Mechanism, coordinate, parameter

STRETCH, TURNING = 1.05, 0.5  # of the sides, in sigma; angular velocity of the polygon in rad/s


def particles(n: int = 3) -> Mechanism:
    """The mechanism with the Cartesian coordinates of ``n`` particles."""
    if not 2 <= n <= 60:
        raise ValueError(f"n = {n} particles; give 2 to 60")
    m = parameter("m", 1.0, "kg", "mass of each particle")
    epsilon = parameter("epsilon", 0.25, "J", "depth of the potential")
    sigma = parameter("sigma", 1.0, "m", "distance at which the force vanishes")
    radius, places = STRETCH / (2 * sin(pi / n)), []
    for i in range(1, n + 1):
        x, y = radius * cos(2 * pi * (i - 1) / n), radius * sin(2 * pi * (i - 1) / n)
        u, v = -TURNING * y, TURNING * x
        places.append(
            (
                coordinate(f"x{i}", "m", start=x, velocity=u, doc=f"particle {i}"),
                coordinate(f"y{i}", "m", start=y, velocity=v, doc=f"particle {i}"),
            )
        )

    potential = 0
    for i, a in enumerate(places):
        for b in places[:i]:
            s = (sigma / sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2)) ** 6
            potential = potential + epsilon * (s**2 - 2 * s)

    return Mechanism(
        "particles",
        title=f"{n} particles with forces between each two",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 5",
        coordinates=[q for place in places for q in place],
        parameters=[m, epsilon, sigma],
        bodies=[Body(f"particle{i}", m, place) for i, place in enumerate(places, start=1)],
        energy=Energy(potential=potential),
        strict_units=True,
    )
