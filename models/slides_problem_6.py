r"""Slides, problem 6: a disc that rolls on the ground, held to a wall by a spring, with a rod hanging from its rim.

::

    |           , - ~ - .          R, m1   radius and mass of the disc (homogeneous)
    |         /           \        l, m2   length and mass of the rod (homogeneous)
    |--/\/\--|----- C ---- A       k       stiffness of the spring between the wall and the centre C
    |    k    \          / |\      phi     angle by which the disc has rolled to the right (clockwise)
    |           ` - _ -  ' |psi    psi     angle of the rod from the downward vertical (counter-clockwise)
    ==========================     g       gravity, along -y

Geometry chosen (the figure is missing): the spring is horizontal; A lies on the rim, as "the radius CA" says; CA points
away from the wall, horizontally, when the spring is relaxed (phi = 0). The rod swings in front of disc and ground.
Rolling without slipping moves C by R phi, and A relative to C is (R cos(phi), -R sin(phi)). At rest A has gone down a
little: the weight of the rod turns the disc until the spring holds it, k R phi = m2 g cos(phi).

Source: slides "Lagrangian Dynamics", section 4, problem 6.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, Spring, coordinate, parameter


def slides_problem_6() -> Mechanism:
    """The mechanism with phi (disc) and psi (rod) as generalized coordinates."""
    m1, m2 = parameter("m1", 2.0, "kg", "mass of the disc"), parameter("m2", 0.5, "kg", "mass of the rod")
    R, l = parameter("R", 0.2, "m", "radius of the disc"), parameter("l", 0.15, "m", "length of the rod")  # noqa: E741
    I1 = parameter("I1", m1 * R**2 / 2, "kg.m2", "inertia of the disc about its centre C")
    I2 = parameter("I2", m2 * l**2 / 12, "kg.m2", "inertia of the rod about its mass centre D")
    k = parameter("k", 200.0, "N/m", "stiffness of the spring")
    g = parameter("g", 9.81, "m/s2", "gravity")
    phi = coordinate("phi", "rad", start=0.3, doc="angle by which the disc has rolled, clockwise")
    psi = coordinate("psi", "rad", start=0.2, doc="angle of the rod from the downward vertical, counter-clockwise")

    x_C, y_C = R * phi, R
    x_A, y_A = x_C + R * cos(phi), y_C - R * sin(phi)
    x_D, y_D = x_A + l / 2 * sin(psi), y_A - l / 2 * cos(psi)

    return Mechanism(
        "slides_problem_6",
        title="Rolling disc on a spring with a hanging rod",
        source='slides "Lagrangian Dynamics", section 4, problem 6',
        coordinates=[phi, psi],
        parameters=[m1, m2, R, l, I1, I2, k, g],
        bodies=[
            Body("disc", m1, (x_C, y_C), angle=-phi, inertia=I1),
            Body("rod", m2, (x_D, y_D), angle=psi, inertia=I2),
        ],
        gravity=g,
        springs=[Spring("wall", k, elongation=x_C)],
        outputs=[Output("x_A", x_A, "m", "joint A, horizontal"), Output("y_A", y_A, "m", "joint A, vertical")],
        strict_units=True,
    )
