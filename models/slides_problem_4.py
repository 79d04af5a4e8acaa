r"""Slides, problem 4: a drum on a spring, turned by a moment, with a particle that hangs from its rim on a bar.

::

                        |
                  .---. \ k     phi         angle of the drum
                 /     \/       theta       angle of the bar from the downward vertical
        M(t) (  |   O---B       m1, R       mass and radius of the drum (homogeneous)
                 \  |  /        m2, l       mass of the particle, length of the bar
                  `-A-'         k           stiffness of the spring, which stays vertical
                     \ l        M0, Omega   amplitude and frequency of the moment M0 sin(Omega t)
                theta o m2      g           gravity, along -y

Geometry chosen (the figure is missing): A and B lie on the rim; at phi = 0 the radius OB is horizontal, the spring is
relaxed and A is below O. The far end of the spring is guided, so that it stays vertical in large motions too. The bar
has no mass. The input Q_phi adds to the moment.

Source: slides "Lagrangian Dynamics", section 4, problem 4; values chosen.
"""

from sympy import cos, sin

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Experiment, Mechanism, Output, Point, Spring, coordinate, parameter


def slides_problem_4() -> Mechanism:
    """The mechanism with phi and theta as generalized coordinates."""
    m1, R = parameter("m1", 4.0, "kg", "mass of the drum"), parameter("R", 0.2, "m", "radius of the drum")
    m2, l = parameter("m2", 1.0, "kg", "mass of the particle"), parameter("l", 0.5, "m", "length of the bar")  # noqa: E741
    k = parameter("k", 100.0, "N/m", "stiffness of the spring")
    M0 = parameter("M0", 0.5, "N.m", "amplitude of the moment")
    Omega = parameter("Omega", 3.0, "rad/s", "its angular frequency")
    g = parameter("g", 9.81, "m/s2", "gravity")
    phi = coordinate("phi", "rad", doc="angle of the drum")
    theta = coordinate("theta", "rad", start=0.3, doc="angle of the bar from the downward vertical")

    A, B = Point("A", (R * sin(phi), -R * cos(phi))), Point("B", (R * cos(phi), R * sin(phi)))
    x_m, y_m = R * sin(phi) + l * sin(theta), -R * cos(phi) - l * cos(theta)

    return Mechanism(
        "slides_problem_4",
        title="Drum on a spring with a hanging particle",
        source='slides "Lagrangian Dynamics", section 4, problem 4',
        coordinates=[phi, theta],
        parameters=[m1, R, m2, l, k, M0, Omega, g],
        bodies=[Body("drum", m1, (0, 0), angle=phi, inertia=m1 * R**2 / 2), Body("particle", m2, (x_m, y_m))],
        points=[A, B],
        gravity=g,
        springs=[Spring("spring", k, elongation=R * sin(phi))],
        forces={phi: M0 * sin(Omega * t)},
        outputs=[Output("x_m", x_m, "m", "particle, horizontal"), Output("y_m", y_m, "m", "particle, vertical")],
        experiment=Experiment(stop_time=5.0),
        strict_units=True,
    )
