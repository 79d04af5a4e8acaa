r"""Chaplygin's sleigh: a body on a plane, on two smooth feet and a blade that cannot move sideways.

::

      y |        / C           x, y   the blade's point of contact P
        |     a /              phi    direction of the blade from the x axis
        |      P) phi          a      distance of the mass centre C ahead of P, along the blade
        |                      m, J   mass, moment of inertia about C
        +--------- x

The energy stays, and yet the sleigh forgets how it turned: in the end it glides straight, mass centre ahead. With the
speed u along the blade and omega = phi_dot: u_dot = a omega^2, (J + m a^2) omega_dot = -m a u omega.

Source: J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972, chapter II; S. A. Chaplygin, 1911.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Constraint, Mechanism, Output, coordinate, parameter


def chaplygin_sleigh() -> Mechanism:
    """The mechanism with x, y and phi as coordinates and one nonholonomic constraint."""
    m = parameter("m", 1.0, "kg", "mass")
    J = parameter("J", 0.2, "kg.m2", "moment of inertia about the mass centre")
    a = parameter("a", 0.3, "m", "distance of the mass centre from the blade")
    x = coordinate("x", "m", start=0.0, velocity=-0.5, doc="blade, x")
    y = coordinate("y", "m", start=0.0, velocity=0.0, doc="blade, y")
    phi = coordinate("phi", "rad", start=0.0, velocity=0.5, doc="direction of the blade")

    centre = (x + a * cos(phi), y + a * sin(phi))

    return Mechanism(
        "chaplygin_sleigh",
        title="Chaplygin's sleigh",
        source="J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972, chapter II",
        coordinates=[x, y, phi],
        parameters=[m, J, a],
        bodies=[Body("sleigh", m, centre, angle=phi, inertia=J)],
        constraints=[Constraint("blade", y.dot * cos(phi) - x.dot * sin(phi), kind="nonholonomic")],
        outputs=[Output("u", x.dot * cos(phi) + y.dot * sin(phi), "m/s", "speed along the blade")],
        strict_units=True,
    )
