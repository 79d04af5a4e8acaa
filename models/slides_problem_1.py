r"""Slides, problem 1: a homogeneous rod that turns about a pivot, with a horizontal spring at its short end.

::

         A o--/\/\/\--|      a = |OA| = l/3, b = |OB| = 2 l/3, l = a + b
          /     k             phi   angle of the rod from the vertical, end B hanging below the pivot
       O *-------- x          m, l  mass and length of the rod, its mass centre C at (b - a)/2 = l/6 below O
        /|                    k     stiffness of the spring, which stays horizontal
       / | phi                g     gravity, along -y
    B /

Geometry chosen (the figure is missing): the short arm OA points upwards, the spring at A is horizontal for every phi,
as the slides say, and relaxed at phi = 0. Turning the rod by phi (counter-clockwise) moves A by a sin(phi) to the left.

Source: slides "Lagrangian Dynamics", section 4, problem 1.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, Spring, coordinate, parameter


def slides_problem_1() -> Mechanism:
    """The mechanism with phi as generalized coordinate: m l^2/9 phi_ddot + k a^2 sin cos + m g l/6 sin = 0."""
    m = parameter("m", 2.0, "kg", "mass of the rod")
    l = parameter("l", 1.2, "m", "length of the rod AB")  # noqa: E741
    a = parameter("a", l / 3, "m", "distance of the end A from the pivot O")
    I_C = parameter("I_C", m * l**2 / 12, "kg.m2", "inertia of the rod about its mass centre")
    k = parameter("k", 50.0, "N/m", "stiffness of the spring")
    g = parameter("g", 9.81, "m/s2", "gravity")
    phi = coordinate("phi", "rad", start=0.4, doc="angle of the rod from the vertical")

    c = l / 2 - a  # distance of the mass centre below O
    x_C, y_C = c * sin(phi), -c * cos(phi)
    x_A = -a * sin(phi)

    return Mechanism(
        "slides_problem_1",
        title="Rod on a pivot with a horizontal spring",
        source='slides "Lagrangian Dynamics", section 4, problem 1',
        coordinates=[phi],
        parameters=[m, l, a, I_C, k, g],
        bodies=[Body("rod", m, (x_C, y_C), angle=phi, inertia=I_C)],
        gravity=g,
        springs=[Spring("spring", k, elongation=x_A)],
        outputs=[Output("x_A", x_A, "m", "end A, horizontal")],
        strict_units=True,
    )
