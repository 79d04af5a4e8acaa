r"""Slides, problem 4, as small vibrations: a drum on a spring, turned by a moment, with a hanging particle.

::

                        |
                  .---. \ k     phi         angle of the drum, small
                 /     \/       theta       angle of the bar from the downward vertical, small
        M(t) (  |   O---B       m1, R       mass and radius of the drum (homogeneous)
                 \  |  /        m2, l       mass of the particle, length of the bar
                  `-A-'         k           stiffness of the spring
                     \ l        M0, Omega   amplitude and frequency of the moment M0 sin(Omega t)
                theta o m2      g           gravity, along -y

The energies to second order in the angles give linear equations; geometry as in slides_problem_4.

Source: slides "Lagrangian Dynamics", section 4, problem 4; values chosen.
"""

from sympy import sin

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Energy, Experiment, Mechanism, Output, coordinate, parameter


def slides_problem_4_small() -> Mechanism:
    """The mechanism with phi and theta as generalized coordinates and constant M."""
    m1, R = parameter("m1", 4.0, "kg", "mass of the drum"), parameter("R", 0.2, "m", "radius of the drum")
    m2, l = parameter("m2", 1.0, "kg", "mass of the particle"), parameter("l", 0.5, "m", "length of the bar")  # noqa: E741
    k = parameter("k", 100.0, "N/m", "stiffness of the spring")
    M0 = parameter("M0", 0.5, "N.m", "amplitude of the moment")
    Omega = parameter("Omega", 3.0, "rad/s", "its angular frequency")
    g = parameter("g", 9.81, "m/s2", "gravity")
    phi = coordinate("phi", "rad", nominal=0.1, doc="angle of the drum")
    theta = coordinate("theta", "rad", start=0.1, nominal=0.1, doc="angle of the bar from the downward vertical")

    kinetic = m1 * R**2 * phi.dot**2 / 4 + m2 * (R * phi.dot + l * theta.dot) ** 2 / 2
    potential = k * R**2 * phi**2 / 2 + m2 * g * (R * phi**2 + l * theta**2) / 2

    return Mechanism(
        "slides_problem_4_small",
        title="Small vibrations of a drum on a spring with a hanging particle",
        source='slides "Lagrangian Dynamics", section 4, problem 4',
        coordinates=[phi, theta],
        parameters=[m1, R, m2, l, k, M0, Omega, g],
        energy=Energy(kinetic=kinetic, potential=potential),
        forces={phi: M0 * sin(Omega * t)},
        outputs=[Output("x_m", R * phi + l * theta, "m", "particle, horizontal")],
        experiment=Experiment(stop_time=5.0),
        strict_units=True,
    )
