r"""Elastic pendulum: a point mass on a massless linear spring that swings in the vertical plane.

::

      O-------- x       l0   natural length of the spring
      |\                k    stiffness of the spring
      | \ l0 + s        m    mass of the bob
     theta\/\           s    elongation of the spring
      |     o m         theta   angle from the downward vertical,  g   gravity, along -y

At rest the spring is longer by m g/k. The default start is far from the resonance sqrt(k/m) = 2 sqrt(g/l).

Source: A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, chapter 6 (the spring pendulum).
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, Point, Spring, coordinate, parameter


def elastic_pendulum() -> Mechanism:
    """The mechanism with s (elongation) and theta (angle) as generalized coordinates."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    k = parameter("k", 100.0, "N/m", "stiffness of the spring")
    l0 = parameter("l0", 1.0, "m", "natural length of the spring", minimum=1e-6)
    g = parameter("g", 9.81, "m/s2", "gravity")
    s = coordinate("s", "m", start=0.15, nominal=0.1, doc="elongation of the spring")
    theta = coordinate("theta", "rad", start=0.3, doc="angle of the spring from the downward vertical")

    pivot = Point("pivot", (0, 0))
    x, y = (l0 + s) * sin(theta), -(l0 + s) * cos(theta)
    bob = Body("bob", m, (x, y))

    return Mechanism(
        "elastic_pendulum",
        title="Elastic pendulum",
        source="A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, chapter 6",
        coordinates=[s, theta],
        parameters=[m, k, l0, g],
        bodies=[bob],
        points=[pivot],
        gravity=g,
        springs=[Spring("rod", k, between=(pivot, bob), length=l0)],
        outputs=[Output("x", x, "m", "bob, horizontal"), Output("y", y, "m", "bob, vertical")],
        strict_units=True,
    )
