r"""Free body: an asymmetric body tumbles about its mass centre, in a quaternion.

::

         x3 |   . x2        e0 ... e3      unit quaternion of the body's axes x1, x2, x3
            | .             I1 < I2 < I3   principal moments of inertia
            C---- x1

A turn about the middle axis is unstable: the body turns over again and again. Its angular velocities are Jacobi's
elliptic functions of time (cn, sn, dn).

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 37; values: a box of 1 x 2 x 3 and of mass 12, without units.
"""

from lag2fmu.mechanism import Body, Frame, Mechanism, Output, coordinate, parameter

OMEGA = (0.01, 1.5, 0.0)


def free_body() -> Mechanism:
    """The mechanism with the quaternion as coordinates, turning about its middle axis, not quite."""
    m = parameter("m", 12.0, "kg", "mass")
    I1 = parameter("I1", 5.0, "kg.m2", "least principal moment of inertia")
    I2 = parameter("I2", 10.0, "kg.m2", "middle principal moment of inertia")
    I3 = parameter("I3", 13.0, "kg.m2", "greatest principal moment of inertia")
    # at e = (1, 0, 0, 0) its rate is (0, omega)/2
    e0 = coordinate("e0", "1", start=1.0, velocity=0.0, doc="quaternion, scalar part")
    e1, e2, e3 = (
        coordinate(f"e{i + 1}", "1", start=0.0, velocity=OMEGA[i] / 2, doc=f"quaternion, part along {axis}")
        for i, axis in enumerate("xyz")
    )
    body = Frame("body", quaternion=(e0, e1, e2, e3))

    return Mechanism(
        "free_body",
        title="Asymmetric body, tumbling freely",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 37",
        coordinates=[e0, e1, e2, e3],
        parameters=[m, I1, I2, I3],
        frames=[body],
        bodies=[Body("box", m, frame=body, inertia=(I1, I2, I3, 0, 0, 0))],
        outputs=[
            Output("omega", frame=body, quantity="angular_velocity", axes="frame", doc="angular velocity, body axes"),
        ],
        strict_units=True,
    )
