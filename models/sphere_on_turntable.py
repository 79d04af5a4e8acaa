r"""Sphere on a turntable: a ball rolls without slipping on a plane that turns about a vertical axis.

::

            ( )           x, y      centre of the ball, over the axis of the table
      ______( )______     e0 ... e3 quaternion of its orientation
      ------------------  R, m, I   radius, mass and moment of inertia (homogeneous: I = 2/5 m R^2)
             | ) Omega    Omega     angular velocity of the table

The table does not carry the ball away: it runs on a circle, anywhere, with the angular velocity I/(I + m R^2) Omega,
which is 2/7 Omega for a homogeneous ball; radius and centre of the circle follow from the start.

Source: J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972, chapter II; J. A. Burns, Ball rolling
on a turntable, American Journal of Physics 49, 1981; values chosen.
"""

from lag2fmu.mechanism import Body, Constraint, Experiment, Frame, Mechanism, Output, coordinate, parameter


def sphere_on_turntable() -> Mechanism:
    """The mechanism with x, y and a unit quaternion as coordinates and two rolling constraints."""
    m, R = parameter("m", 0.2, "kg", "mass of the ball"), parameter("R", 0.03, "m", "radius of the ball")
    I = parameter("I", 2 * m * R**2 / 5, "kg.m2", "moment of inertia of the ball")  # noqa: E741
    Omega = parameter("Omega", 5.0, "rad/s", "angular velocity of the table")
    x = coordinate("x", "m", start=0.2, velocity=0.0, nominal=0.1, doc="centre of the ball, x")
    y = coordinate("y", "m", start=0.0, velocity=0.1, nominal=0.1, doc="centre of the ball, y")
    e0 = coordinate("e0", "1", start=1.0, doc="quaternion, scalar part")
    e1, e2, e3 = (
        coordinate(f"e{i}", "1", start=0.0, doc=f"quaternion, part along {k}") for i, k in enumerate("xyz", 1)
    )

    # angular velocity in the fixed axes: twice the vector part of e_dot times the conjugate of e
    omega_x = 2 * (e0 * e1.dot - e1 * e0.dot + e2 * e3.dot - e3 * e2.dot)
    omega_y = 2 * (e0 * e2.dot - e2 * e0.dot + e3 * e1.dot - e1 * e3.dot)
    ball = Frame("ball", origin=(x, y, R), quaternion=(e0, e1, e2, e3))

    return Mechanism(
        "sphere_on_turntable",
        title="Ball rolling on a turntable",
        source="J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972, chapter II",
        coordinates=[x, y, e0, e1, e2, e3],
        parameters=[m, R, I, Omega],
        frames=[ball],
        bodies=[Body("sphere", m, frame=ball, inertia=(I, I, I, 0, 0, 0))],
        constraints=[
            Constraint("rolling_x", x.dot - R * omega_y + Omega * y, kind="nonholonomic"),
            Constraint("rolling_y", y.dot + R * omega_x - Omega * x, kind="nonholonomic"),
        ],
        outputs=[Output("omega", frame=ball, quantity="angular_velocity", doc="angular velocity, fixed axes")],
        experiment=Experiment(stop_time=2.0),
        strict_units=True,
    )
