r"""Particle on a cone: a point mass that slides without friction on the inside of a cone with a vertical axis.

::

      \    |    o m         s       distance of the particle from the apex
       \   |   /            alpha   angle between the axis and the generators
        \  |  / s           phi     azimuth of the particle about the axis
         \ | /              m       mass,  g   gravity, along -z
          \|/ alpha

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 14, problem 2.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def particle_on_cone() -> Mechanism:
    """The mechanism with s and phi as generalized coordinates; phi is cyclic."""
    m = parameter("m", 1.0, "kg", "mass of the particle")
    alpha = parameter("alpha", 30.0, "deg", "angle between axis and generators")
    g = parameter("g", 9.81, "m/s2", "gravity")
    s = coordinate("s", "m", start=1.0, doc="distance from the apex")
    phi = coordinate("phi", "rad", velocity=7.0, doc="azimuth")

    r, z = s * sin(alpha), s * cos(alpha)
    x, y = r * cos(phi), r * sin(phi)

    return Mechanism(
        "particle_on_cone",
        title="Particle on a cone",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 14, problem 2",
        coordinates=[s, phi],
        parameters=[m, alpha, g],
        bodies=[Body("particle", m, (x, y, z))],
        gravity=g,
        outputs=[Output("x", x, "m", "particle"), Output("y", y, "m", "particle"), Output("z", z, "m", "height")],
        strict_units=True,
    )
