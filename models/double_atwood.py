r"""Double Atwood machine: a mass on one side of a fixed pulley, on the other side a pulley with two masses.

::

          ( O )            x        how far m1 has gone down
          |   |            y        how far m2 has gone down from the lower pulley
        m1#  (o)           m1, m2, m3   masses; the pulleys and the rope have none
             | |           g        gravity
           m2# #m3

Source: D. Morin, Introduction to Classical Mechanics, chapter 3 (Atwood's machines).
"""

from lag2fmu.mechanism import Body, Experiment, Mechanism, coordinate, parameter


def double_atwood() -> Mechanism:
    """The mechanism with x and y as generalized coordinates."""
    m1 = parameter("m1", 4.0, "kg", "mass on the rope of the fixed pulley")
    m2 = parameter("m2", 3.0, "kg", "mass on the lower pulley")
    m3 = parameter("m3", 1.0, "kg", "mass on the lower pulley")
    g = parameter("g", 9.81, "m/s2", "gravity")
    x = coordinate("x", "m", doc="way of m1 downwards")
    y = coordinate("y", "m", doc="way of m2 downwards from the lower pulley")

    return Mechanism(
        "double_atwood",
        title="Double Atwood machine",
        source="D. Morin, Introduction to Classical Mechanics, chapter 3",
        coordinates=[x, y],
        parameters=[m1, m2, m3, g],
        bodies=[Body("first", m1, (0, -x)), Body("second", m2, (0, x - y)), Body("third", m3, (0, x + y))],
        gravity=g,
        experiment=Experiment(stop_time=2.0, step=0.01),
        strict_units=True,
    )
