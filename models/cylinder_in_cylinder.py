r"""Cylinder in a cylinder: a homogeneous cylinder rolls without slipping on the inside of a fixed cylinder.

::

     |          |      phi    angle of the line of the axes from the downward vertical
     |   O      |      R, a   radii of the fixed and of the rolling cylinder
      \   \    /       m      mass of the rolling cylinder
       ' . (a) '       g      gravity, along -y

Rolling makes it turn by -phi (R - a)/a; its kinetic energy is (3/4) m (R - a)^2 phi_dot^2.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 32, problem 6.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, coordinate, parameter


def cylinder_in_cylinder() -> Mechanism:
    """The mechanism with phi as generalized coordinate."""
    m = parameter("m", 2.0, "kg", "mass of the rolling cylinder")
    R = parameter("R", 0.5, "m", "radius of the fixed cylinder")
    a = parameter("a", 0.1, "m", "radius of the rolling cylinder")
    I = parameter("I", m * a**2 / 2, "kg.m2", "inertia of the rolling cylinder about its axis")  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    phi = coordinate("phi", "rad", start=1.0, doc="angle of the line of the axes from the downward vertical")

    centre = ((R - a) * sin(phi), -(R - a) * cos(phi))

    return Mechanism(
        "cylinder_in_cylinder",
        title="Cylinder rolling in a cylinder",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 32, problem 6",
        coordinates=[phi],
        parameters=[m, R, a, I, g],
        bodies=[Body("cylinder", m, centre, angle=-phi * (R - a) / a, inertia=I)],
        gravity=g,
        strict_units=True,
    )
