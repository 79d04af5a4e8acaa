r"""Slides, problem 5, as small vibrations: the slider has no mass, and M has rank 1.

::

     |--/\/\--[ A ]--/\/\--|      x       displacement of the slider A, which has no mass
          k     |\    k           phi     angle of the rod from the downward vertical, small
                | \ l             l       length of the rod
              phi  \              m       mass of the small body
                    o m -->       k       stiffness of each spring
                       F          g       gravity, along -y

T = m (x_dot + l phi_dot)^2 / 2 does not see the motion (l, -1): the forces along it are in equilibrium at every
instant, 2 k x = m g phi. The rod vibrates with omega^2 = g / (l + m g / (2 k)).

Source: slides "Lagrangian Dynamics", section 4, problem 5, small vibrations.
"""

from lag2fmu.mechanism import Energy, Mechanism, Output, coordinate, parameter, signal


def slides_problem_5_small() -> Mechanism:
    """The mechanism with x and phi as generalized coordinates; x follows from phi."""
    m, l = parameter("m", 1.0, "kg", "mass of the small body"), parameter("l", 0.5, "m", "length of the rod")  # noqa: E741
    k, g = parameter("k", 100.0, "N/m", "stiffness of each spring"), parameter("g", 9.81, "m/s2", "gravity")
    F = signal("F", "N", doc="force on the small body, horizontal")
    x = coordinate("x", "m", nominal=0.1, doc="displacement of the slider")
    phi = coordinate("phi", "rad", start=0.1, doc="angle of the rod from the downward vertical")
    return Mechanism(
        "slides_problem_5_small",
        title="Small vibrations of a pendulum on a massless slider between springs",
        source='slides "Lagrangian Dynamics", section 4, problem 5',
        coordinates=[x, phi],
        parameters=[m, l, k, g],
        inputs=[F],
        energy=Energy(kinetic=m * (x.dot + l * phi.dot) ** 2 / 2, potential=k * x**2 + m * g * l * phi**2 / 2),
        forces={x: F, phi: F * l},
        outputs=[Output("x_m", x + l * phi, "m", "small body, horizontal")],
        strict_units=True,
    )
