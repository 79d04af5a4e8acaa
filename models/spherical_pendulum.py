r"""Spherical pendulum: a point mass on a massless rod that swings about a fixed point in space.

::

          O-------- x         l       length of the rod
         /|\                  m       mass of the bob
      y / | \ l               theta   angle of the rod from the downward vertical
          |theta              phi     azimuth of the bob about the vertical
          |   o m             g       gravity, along -z

With phi_dot^2 = g/(l cos(theta)) the bob goes round in a circle: the conical pendulum.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 14, problem 1.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def spherical_pendulum() -> Mechanism:
    """The mechanism with theta and phi as generalized coordinates; phi is cyclic."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    l = parameter("l", 1.0, "m", "length of the rod")  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    theta = coordinate("theta", "rad", start=1.0, doc="angle of the rod from the downward vertical")
    phi = coordinate("phi", "rad", velocity=2.0, doc="azimuth of the bob")

    x, y, z = l * sin(theta) * cos(phi), l * sin(theta) * sin(phi), -l * cos(theta)

    return Mechanism(
        "spherical_pendulum",
        title="Spherical pendulum",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 14, problem 1",
        coordinates=[theta, phi],
        parameters=[m, l, g],
        bodies=[Body("bob", m, (x, y, z))],
        gravity=g,
        outputs=[Output("x", x, "m", "bob"), Output("y", y, "m", "bob"), Output("z", z, "m", "bob, height")],
        strict_units=True,
    )
