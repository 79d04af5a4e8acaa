r"""Double pendulum: two point masses on massless rods, both angles from the downward vertical.

::

         O-------- x          l1, l2   lengths of the rods
         |\                   m1, m2   masses of the bobs
         | \ l1               theta1, theta2   angles from the vertical
      theta1 \               g        gravity, along -y
              o m1
              |\
              | \ l2
           theta2 o m2

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 1.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def double_pendulum() -> Mechanism:
    """The mechanism with theta1, theta2 as generalized coordinates."""
    m1, m2 = parameter("m1", 1.0, "kg", "mass of the upper bob"), parameter("m2", 1.0, "kg", "mass of the lower bob")
    l1, l2 = parameter("l1", 1.0, "m", "length of the upper rod"), parameter("l2", 1.0, "m", "length of the lower rod")
    g = parameter("g", 9.81, "m/s2", "gravity")
    theta1 = coordinate("theta1", "rad", start=0.5, doc="angle of the upper rod from the vertical")
    theta2 = coordinate("theta2", "rad", start=-0.3, doc="angle of the lower rod from the vertical")

    x1, y1 = l1 * sin(theta1), -l1 * cos(theta1)
    x2, y2 = x1 + l2 * sin(theta2), y1 - l2 * cos(theta2)

    return Mechanism(
        "double_pendulum",
        title="Double pendulum",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 5, problem 1",
        coordinates=[theta1, theta2],
        parameters=[m1, m2, l1, l2, g],
        bodies=[Body("upper", m1, (x1, y1)), Body("lower", m2, (x2, y2))],
        gravity=g,
        outputs=[Output("x2", x2, "m", "tip, horizontal"), Output("y2", y2, "m", "tip, vertical")],
        strict_units=True,
    )
