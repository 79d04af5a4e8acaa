r"""Slides, problem 3: a truck held to a wall by a spring, with a bar that swings from its mass centre.

::

    |            +--------+
    |--/\/\/\/---|   C    |---> x      m1   mass of the truck,  m2, l   mass and length of the bar
    |     k      +---*----+            k    stiffness of the spring
    |              o  \   o            x    position of the truck, 0 where the spring is relaxed
    ===================\======         phi  angle of the bar from the downward vertical
                     phi\              g    gravity, along -y

Geometry chosen (the figure is missing): the spring is horizontal and relaxed at x = 0; the bar is hinged with one end
at C and hangs down; it swings in front of the truck and of the ground. The wheels are massless, nothing rubs.

Source: slides "Lagrangian Dynamics", section 4, problem 3.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, Spring, coordinate, parameter


def slides_problem_3() -> Mechanism:
    """The mechanism with x (truck) and phi (bar) as generalized coordinates."""
    m1, m2 = parameter("m1", 4.0, "kg", "mass of the truck"), parameter("m2", 1.0, "kg", "mass of the bar")
    l = parameter("l", 0.8, "m", "length of the bar")  # noqa: E741
    I2 = parameter("I2", m2 * l**2 / 12, "kg.m2", "inertia of the bar about its mass centre")
    k = parameter("k", 100.0, "N/m", "stiffness of the spring")
    g = parameter("g", 9.81, "m/s2", "gravity")
    x = coordinate("x", "m", start=0.05, nominal=0.1, doc="position of the truck, from the relaxed spring")
    phi = coordinate("phi", "rad", start=0.4, doc="angle of the bar from the downward vertical")

    x2, y2 = x + l / 2 * sin(phi), -l / 2 * cos(phi)

    return Mechanism(
        "slides_problem_3",
        title="Truck on a spring with a hanging bar",
        source='slides "Lagrangian Dynamics", section 4, problem 3',
        coordinates=[x, phi],
        parameters=[m1, m2, l, I2, k, g],
        bodies=[Body("truck", m1, (x, 0)), Body("bar", m2, (x2, y2), angle=phi, inertia=I2)],
        gravity=g,
        springs=[Spring("wall", k, elongation=x)],
        outputs=[Output("x2", x2, "m", "centre of the bar, horizontal"), Output("y2", y2, "m", "and vertical")],
        strict_units=True,
    )
