r"""Slides, problem 5: a small body on a massless rod that hangs from a slider between two springs, driven by a force.

::

     |--/\/\--[ A ]--/\/\--|      x       displacement of the slider A
          k     |\    k           phi     angle of the rod from the downward vertical
                | \ l             l       length of the rod
              phi  \              M, m    masses of the slider and of the small body
                    o m -->       k       stiffness of each spring
                       F(t)       F0, Omega   amplitude and frequency of the force F0 sin(Omega t)
                                  F       input, a force that adds to it
                                  g       gravity, along -y

The slider of the slides is light; here it has a small mass M.

Source: slides "Lagrangian Dynamics", section 4, problem 5.
"""

from sympy import cos, sin

from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Body, Experiment, Load, Mechanism, Output, Spring, coordinate, parameter, signal


def slides_problem_5() -> Mechanism:
    """The mechanism with x and phi as generalized coordinates."""
    M, m = parameter("M", 0.1, "kg", "mass of the slider"), parameter("m", 1.0, "kg", "mass of the small body")
    l = parameter("l", 0.5, "m", "length of the rod")  # noqa: E741
    k = parameter("k", 100.0, "N/m", "stiffness of each spring")
    F0, Omega = parameter("F0", 1.0, "N", "amplitude of the force"), parameter("Omega", 3.0, "rad/s", "its frequency")
    g = parameter("g", 9.81, "m/s2", "gravity")
    F = signal("F", "N", doc="force on the small body, horizontal, beside F0 sin(Omega t)")
    x = coordinate("x", "m", start=0.0, nominal=0.1, doc="displacement of the slider")
    phi = coordinate("phi", "rad", start=0.2, doc="angle of the rod from the downward vertical")

    x_m, y_m = x + l * sin(phi), -l * cos(phi)

    return Mechanism(
        "slides_problem_5",
        title="Pendulum on a slider between springs",
        source='slides "Lagrangian Dynamics", section 4, problem 5',
        coordinates=[x, phi],
        parameters=[M, m, l, k, F0, Omega, g],
        inputs=[F],
        bodies=[Body("slider", M, (x, 0)), Body("bob", m, (x_m, y_m))],
        gravity=g,
        springs=[Spring("left", k, elongation=x), Spring("right", k, elongation=-x)],
        loads=[Load("drive", point="bob", force=(F0 * sin(Omega * TIME) + F, 0))],
        outputs=[Output("x_m", x_m, "m", "small body, horizontal"), Output("y_m", y_m, "m", "small body, vertical")],
        experiment=Experiment(stop_time=5.0),
        strict_units=True,
    )
