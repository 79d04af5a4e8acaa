r"""Spring-mass-damper: a block on a smooth floor, held to a wall by a linear spring and a viscous damper.

::

      |--/\/\/\/--+-----+
      |    k      |  m  |---> x       x   position of the block, 0 where the spring is relaxed
      |----[|-----+-----+             m   mass,  k   stiffness,  c   damping
      |    c        o o
    =========================

Source: S. S. Rao, Mechanical Vibrations, section 2.6 (free vibration with viscous damping).
"""

from lag2fmu.mechanism import Body, Damper, Mechanism, Spring, coordinate, parameter


def spring_mass_damper() -> Mechanism:
    """The mechanism with x as generalized coordinate: m x_ddot + c x_dot + k x = 0."""
    m = parameter("m", 1.0, "kg", "mass of the block")
    k = parameter("k", 40.0, "N/m", "stiffness of the spring")
    c = parameter("c", 0.5, "N.s/m", "damping constant of the damper")
    x = coordinate("x", "m", start=0.1, nominal=0.1, doc="position of the block, from the relaxed spring")

    return Mechanism(
        "spring_mass_damper",
        title="Spring-mass-damper",
        source="S. S. Rao, Mechanical Vibrations, section 2.6",
        coordinates=[x],
        parameters=[m, k, c],
        bodies=[Body("block", m, (x, 0))],
        springs=[Spring("wall", k, elongation=x)],
        dampers=[Damper("wall", c, rate=x.dot)],
        strict_units=True,
    )
