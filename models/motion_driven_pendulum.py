r"""Motion-driven pendulum: the support of a mathematical pendulum is moved vertically from outside, by the input y0.

::

        ^ y0(t), y0_dot, y0_ddot: inputs of the FMU
        |
      --O--             l   length of the rod
        |\              m   mass of the bob
        | \ l           theta   angle from the downward vertical
      theta\            g   gravity, along -y
        |   o m

With y0 = A cos(Omega t) it moves as ``vertically_driven_pendulum``.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 3c, with any motion of the support.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter, signal


def motion_driven_pendulum() -> Mechanism:
    """The mechanism with theta as generalized coordinate: l theta_ddot + (g + y0_ddot) sin(theta) = 0."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    l = parameter("l", 1.0, "m", "length of the rod")  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    y0 = signal("y0", "m", motion=True, doc="height of the support")
    theta = coordinate("theta", "rad", start=0.5, doc="angle of the rod from the downward vertical")

    x, y = l * sin(theta), y0 - l * cos(theta)

    return Mechanism(
        "motion_driven_pendulum",
        title="Pendulum with a support that is moved from outside",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 3c, with any motion of the support",
        coordinates=[theta],
        parameters=[m, l, g],
        inputs=[y0],
        bodies=[Body("bob", m, (x, y))],
        gravity=g,
        outputs=[Output("x", x, "m", "bob, horizontal"), Output("y", y, "m", "bob, vertical")],
        strict_units=True,
    )
