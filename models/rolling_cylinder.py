r"""Rolling cylinder: a loaded cylinder, its mass centre beside its axis, rolls to and fro on a horizontal plane.

::

            .---.          phi   angle of the line from the axis to the mass centre, from the downward vertical
           /     \         R     radius of the cylinder
          |   O   |        a     distance of the mass centre from the axis O
           \ / a /         m     mass
      ______o---'_____     I     moment of inertia about the mass centre
                           g     gravity, along -y

The contact is at rest, so that T = (I + m (R^2 + a^2 - 2 a R cos(phi))) phi_dot^2/2.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 32; values chosen.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def rolling_cylinder() -> Mechanism:
    """The mechanism with phi as generalized coordinate; the axis is at x = -R phi."""
    m = parameter("m", 2.0, "kg", "mass")
    R = parameter("R", 0.2, "m", "radius")
    a = parameter("a", 0.1, "m", "distance of the mass centre from the axis")
    I = parameter("I", 0.03, "kg.m2", "moment of inertia about the mass centre")  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    phi = coordinate("phi", "rad", start=1.5, doc="angle of the mass centre from the downward vertical")

    x, y = -R * phi + a * sin(phi), R - a * cos(phi)

    return Mechanism(
        "rolling_cylinder",
        title="Loaded cylinder rolling on a plane",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 32",
        coordinates=[phi],
        parameters=[m, R, a, I, g],
        bodies=[Body("cylinder", m, (x, y), angle=phi, inertia=I)],
        gravity=g,
        outputs=[Output("x_axis", -R * phi, "m", "axis of the cylinder"), Output("y", y, "m", "mass centre, height")],
        strict_units=True,
    )
