r"""Mathematical pendulum: a point mass on a massless rod in uniform gravity.

::

      O-------- x       l   length of the rod
      |\                m   mass of the bob
      | \ l             theta   angle from the downward vertical
     theta\             g   gravity, along -y
      |   o m

Its period is 4 sqrt(l/g) K(sin(theta_max/2)), K being the complete elliptic integral of the first kind.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 11, problem 1.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Mechanism, Output, coordinate, parameter


def pendulum() -> Mechanism:
    """The mechanism with theta as generalized coordinate: l theta_ddot + g sin(theta) = 0."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    l = parameter("l", 1.0, "m", "length of the rod")  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    theta = coordinate("theta", "rad", start=0.5, doc="angle of the rod from the downward vertical")

    x, y = l * sin(theta), -l * cos(theta)

    return Mechanism(
        "pendulum",
        title="Mathematical pendulum",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 11, problem 1",
        coordinates=[theta],
        parameters=[m, l, g],
        bodies=[Body("bob", m, (x, y))],
        gravity=g,
        outputs=[Output("x", x, "m", "bob, horizontal"), Output("y", y, "m", "bob, vertical")],
        strict_units=True,
    )
