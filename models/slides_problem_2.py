r"""Slides, problem 2: a disc that rolls on the ground, held to a wall by a spring.

::

    |           , - ~ - .          R, m   radius and mass of the disc (homogeneous)
    |         /           \        k      stiffness of the spring between the wall and the centre C
    |--/\/\--|----- C ---- A       phi    angle by which the disc has rolled to the right (clockwise)
    |    k    \           /        x      displacement of C
    |           ` - _ - '
    ==========================

Rolling without slipping is x = R phi. It may be put in, which leaves phi as the only coordinate; or it is kept as a
constraint (``explicit=true``), whose multiplier then is the friction between disc and ground. The spring is unstretched
where the radius CA is horizontal, phi = 0; the disc swings with the frequency sqrt(2 k/(3 m)).

Source: slides "Lagrangian Dynamics", section 4, problem 2.
"""

from lag2fmu.mechanism import Body, Constraint, Mechanism, Output, Spring, coordinate, parameter


def slides_problem_2(explicit: bool = False) -> Mechanism:
    """The mechanism with phi as coordinate, or with x and phi and an ``explicit`` rolling constraint."""
    m, R = parameter("m", 2.0, "kg", "mass of the disc"), parameter("R", 0.2, "m", "radius of the disc")
    I = parameter("I", m * R**2 / 2, "kg.m2", "inertia of the disc about its centre C")  # noqa: E741
    k = parameter("k", 200.0, "N/m", "stiffness of the spring")
    phi = coordinate("phi", "rad", start=0.3, velocity=0.0, doc="angle by which the disc has rolled, clockwise")
    x = coordinate("x", "m", guess=0.06, doc="displacement of the centre")
    rolled = R * phi
    place = x if explicit else rolled

    return Mechanism(
        "slides_problem_2",
        title="Rolling disc on a spring",
        source='slides "Lagrangian Dynamics", section 4, problem 2',
        coordinates=[x, phi] if explicit else [phi],
        parameters=[m, R, I, k],
        bodies=[Body("disc", m, (place, R), angle=-phi, inertia=I)],
        springs=[Spring("wall", k, elongation=place)],
        constraints=[Constraint("rolling", x - rolled)] if explicit else [],
        outputs=[Output("x_C", place, "m", "displacement of the centre")],
        strict_units=True,
    )
