r"""Furuta pendulum: a pendulum at the end of an arm that turns in the horizontal plane.

::

            z |                          alpha     angle of the arm about the vertical
              |     arm, L1    y'        beta      angle of the pendulum about the arm, 0 hanging down
              O===============o          L1        length of the arm
             /  alpha         |\         l1, l2    distances of the mass centres from O and from the joint
          x /                 | \ l2     m1, m2    masses;  J1  inertia of the arm about its mass centre, vertical
                          beta   o C     J2, Ja    inertias of the pendulum about C, across its axis and about it
                                  \      b1, b2    damping of the joints;  g  gravity, along -z

The equations, with tensors of inertia for both parts, are derived in the source; a torque on the arm is Q_alpha. Of the
arm only the inertia about the vertical matters.

Source: B. S. Cazzolato, Z. Prime, On the dynamics of the Furuta pendulum, Journal of Control Science and Engineering,
2011, 528341; values: of table-top size, chosen.
"""

from lag2fmu.mechanism import Body, Damper, Frame, Mechanism, Output, Point, coordinate, parameter


def furuta_pendulum() -> Mechanism:
    """The mechanism with alpha (arm) and beta (pendulum) as generalized coordinates."""
    m1, m2 = parameter("m1", 0.3, "kg", "mass of the arm"), parameter("m2", 0.08, "kg", "mass of the pendulum")
    L1 = parameter("L1", 0.28, "m", "length of the arm")
    l1 = parameter("l1", 0.14, "m", "distance of the arm's mass centre from the vertical axis")
    l2 = parameter("l2", 0.15, "m", "distance of the pendulum's mass centre from its joint")
    J1 = parameter("J1", 2e-3, "kg.m2", "inertia of the arm about its mass centre")
    J2 = parameter("J2", 6e-4, "kg.m2", "inertia of the pendulum about its mass centre, across its axis")
    Ja = parameter("Ja", 1e-6, "kg.m2", "inertia of the pendulum about its axis")
    b1 = parameter("b1", 1e-4, "N.m.s/rad", "damping of the arm")
    b2 = parameter("b2", 3e-4, "N.m.s/rad", "damping of the pendulum")
    g = parameter("g", 9.81, "m/s2", "gravity")
    alpha = coordinate("alpha", "rad", velocity=2.0, doc="angle of the arm")
    beta = coordinate("beta", "rad", start=1.0, doc="angle of the pendulum from the downward vertical")

    arm = Frame("arm", rotations=[("z", alpha)])
    pendulum = Frame("pendulum", arm, (L1, 0, 0), [("x", beta)])

    return Mechanism(
        "furuta_pendulum",
        title="Furuta pendulum",
        source="B. S. Cazzolato, Z. Prime, On the dynamics of the Furuta pendulum, J. Control Sci. Eng. 2011, 528341",
        coordinates=[alpha, beta],
        parameters=[m1, m2, L1, l1, l2, J1, J2, Ja, b1, b2, g],
        frames=[arm, pendulum],
        bodies=[
            Body("beam", m1, frame=arm, center=(l1, 0, 0), inertia=(J1, J1, J1, 0, 0, 0)),
            Body("rod", m2, frame=pendulum, center=(0, 0, -l2), inertia=(J2, J2, Ja, 0, 0, 0)),
        ],
        points=[Point("tip", (0, 0, -2 * l2), pendulum)],
        dampers=[Damper("arm", b1, rate=alpha.dot), Damper("pendulum", b2, rate=beta.dot)],
        gravity=g,
        outputs=[Output("tip", point="tip", quantity="position", doc="end of the pendulum")],
        strict_units=True,
    )
