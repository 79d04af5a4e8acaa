r"""Rolling disc: a thin disc, a coin, rolls on a horizontal plane without slipping.

::

         z |   .-.                x, y    point of contact
           |  /   \ theta         phi     heading: angle of the track from the x axis
           |  |  C |              theta   lean, from the vertical
           |  \   /               psi     rotation about the axis of the disc
           |___'-'_____ track     R, m    radius and mass (homogeneous)
          /                       g       gravity, along -z
         y

The contact moves along the track as much as the rim unrolls: x_dot = R psi_dot cos(phi), y_dot = R psi_dot sin(phi),
which cannot be integrated. Upright rolling is stable for psi_dot^2 > g/(3 R).

Source: J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972, chapter I; a coin, values chosen.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Constraint, Experiment, Frame, Mechanism, Output, coordinate, parameter


def rolling_disc() -> Mechanism:
    """The mechanism with x, y, phi, theta and psi as coordinates and two rolling constraints."""
    m, R = parameter("m", 0.1, "kg", "mass"), parameter("R", 0.05, "m", "radius")
    A = parameter("A", m * R**2 / 4, "kg.m2", "moment of inertia about a diameter")
    C = parameter("C", m * R**2 / 2, "kg.m2", "moment of inertia about the axis")
    g = parameter("g", 9.81, "m/s2", "gravity")
    x = coordinate("x", "m", start=0.0, nominal=0.1, doc="point of contact, x")
    y = coordinate("y", "m", start=0.0, nominal=0.1, doc="point of contact, y")
    phi = coordinate("phi", "rad", start=0.0, velocity=0.5, doc="heading")
    theta = coordinate("theta", "rad", start=0.2, velocity=0.0, doc="lean, to the right of the track")
    psi = coordinate("psi", "rad", start=0.0, velocity=15.0, doc="rotation about the axis")

    centre = (x + R * sin(phi) * sin(theta), y - R * cos(phi) * sin(theta), R * cos(theta))
    disc = Frame("disc", origin=centre, rotations=[("z", phi), ("x", theta), ("y", psi)])

    return Mechanism(
        "rolling_disc",
        title="Thin disc rolling on a plane",
        source="J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972, chapter I",
        coordinates=[x, y, phi, theta, psi],
        parameters=[m, R, A, C, g],
        frames=[disc],
        bodies=[Body("coin", m, frame=disc, inertia=(A, C, A, 0, 0, 0))],
        gravity=g,
        constraints=[
            Constraint("rolling_x", x.dot - R * psi.dot * cos(phi), kind="nonholonomic"),
            Constraint("rolling_y", y.dot - R * psi.dot * sin(phi), kind="nonholonomic"),
        ],
        outputs=[Output("centre", point="coin", quantity="position", doc="centre of the disc")],
        experiment=Experiment(stop_time=5.0),
        strict_units=True,
    )
