r"""Slides, problem 5, exactly: a pendulum on a massless slider, until shortly before its rod hangs straight.

::

     |--/\/\--[ A ]--/\/\--|      x       displacement of the slider A, which has no mass
          k     |\    k           phi     angle of the rod from the downward vertical
                | \ l             l       length of the rod
              phi  \              m       mass of the small body
                    o m -->       k       stiffness of each spring
                       F          g       gravity, along -y

The mass matrix m [[1, l cos phi], [l cos phi, l^2]] has the determinant (m l sin phi)^2. Where the rod hangs straight
it is singular: there the rod cannot tell the slider how to move on, and a longer run stops with a sentence that says
so.

Source: slides "Lagrangian Dynamics", section 4, problem 5.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Experiment, Load, Mechanism, Output, Spring, coordinate, parameter, signal


def slides_problem_5_massless() -> Mechanism:
    """The mechanism with x and phi as generalized coordinates, started at rest."""
    m, l = parameter("m", 1.0, "kg", "mass of the small body"), parameter("l", 0.5, "m", "length of the rod")  # noqa: E741
    k, g = parameter("k", 100.0, "N/m", "stiffness of each spring"), parameter("g", 9.81, "m/s2", "gravity")
    F = signal("F", "N", doc="force on the small body, horizontal")
    x = coordinate("x", "m", start=0.02, nominal=0.1, doc="displacement of the slider")
    phi = coordinate("phi", "rad", start=1.0, doc="angle of the rod from the downward vertical")
    x_m, y_m = x + l * sin(phi), -l * cos(phi)
    return Mechanism(
        "slides_problem_5_massless",
        title="Pendulum on a massless slider between springs",
        source='slides "Lagrangian Dynamics", section 4, problem 5',
        coordinates=[x, phi],
        parameters=[m, l, k, g],
        inputs=[F],
        bodies=[Body("bob", m, (x_m, y_m))],
        gravity=g,
        springs=[Spring("left", k, elongation=x), Spring("right", k, elongation=-x)],
        loads=[Load("push", point="bob", force=(F, 0))],
        outputs=[Output("x_m", x_m, "m", "small body, horizontal"), Output("y_m", y_m, "m", "small body, vertical")],
        experiment=Experiment(stop_time=0.2, step=0.001),
        strict_units=True,
    )
