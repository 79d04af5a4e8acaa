r"""Acrobot: two rods, the first on a fixed joint, with a motor at the joint between them only.

::

      O-------- x          q1        angle of the first rod from the downward vertical
      |\                   q2        angle of the second rod from the first one
      | \ l1, lc1          l1        length of the first rod
    q1|  *                 lc1, lc2  distances of the mass centres from the joints
          \ q2             m1, m2    masses;  I1, I2  inertias about the mass centres
           \ lc2           b1, b2    damping of the joints;  g  gravity, along -y

The torque of the motor is the input Q_q2.

Source: M. W. Spong, IEEE Control Systems Magazine 15 (1995) 49-55; values: those that Drake takes
from there for its example, with the damping it adds.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Damper, Mechanism, Output, coordinate, parameter


def acrobot() -> Mechanism:
    """The mechanism with q1 and q2 as generalized coordinates."""
    m1, m2 = parameter("m1", 1.0, "kg", "mass of rod 1"), parameter("m2", 1.0, "kg", "mass of rod 2")
    l1, l2 = parameter("l1", 1.0, "m", "length of rod 1"), parameter("l2", 2.0, "m", "length of rod 2")
    lc1 = parameter("lc1", 0.5, "m", "distance of the mass centre of rod 1 from its joint")
    lc2 = parameter("lc2", 1.0, "m", "distance of the mass centre of rod 2 from its joint")
    I1 = parameter("I1", 0.083, "kg.m2", "inertia of rod 1 about its mass centre")
    I2 = parameter("I2", 0.33, "kg.m2", "inertia of rod 2 about its mass centre")
    b1, b2 = parameter("b1", 0.1, "N.m.s/rad", "damping of joint 1"), parameter("b2", 0.1, "N.m.s/rad", "of joint 2")
    g = parameter("g", 9.81, "m/s2", "gravity")
    q1 = coordinate("q1", "rad", start=0.5, doc="angle of rod 1 from the downward vertical")
    q2 = coordinate("q2", "rad", start=-0.3, doc="angle of rod 2 from rod 1")

    elbow = (l1 * sin(q1), -l1 * cos(q1))
    tip = (elbow[0] + l2 * sin(q1 + q2), elbow[1] - l2 * cos(q1 + q2))
    centre1 = (lc1 * sin(q1), -lc1 * cos(q1))
    centre2 = (elbow[0] + lc2 * sin(q1 + q2), elbow[1] - lc2 * cos(q1 + q2))

    return Mechanism(
        "acrobot",
        title="Acrobot",
        source="M. W. Spong, IEEE Control Systems Magazine 15 (1995) 49-55",
        coordinates=[q1, q2],
        parameters=[m1, m2, l1, l2, lc1, lc2, I1, I2, b1, b2, g],
        bodies=[
            Body("rod1", m1, centre1, angle=q1, inertia=I1),
            Body("rod2", m2, centre2, angle=q1 + q2, inertia=I2),
        ],
        dampers=[Damper("joint1", b1, rate=q1.dot), Damper("joint2", b2, rate=q2.dot)],
        gravity=g,
        outputs=[Output("x_tip", tip[0], "m", "tip, horizontal"), Output("y_tip", tip[1], "m", "tip, vertical")],
        strict_units=True,
    )
