r"""Parallel manipulator: a planar 3-RRR, a triangular platform on three legs; one loop is written too often.

::

               A3                     ai     angle of the upper link of leg i, from the x axis (driven)
              /  B3                   bi     angle of its lower link
               C3  '                  theta  angle of the platform
              /  \                    x, y   centre of the platform, from leg 1
            C1----C2                  r, R   radii of platform C1 C2 C3 and base A1 A2 A3 (both equilateral)
           /       '. B2              l1, l2 lengths of upper and lower links (homogeneous, of masses m1, m2)
         B1         / '               mp     mass of the platform
       A1           A2

Leg 1 carries the platform. The loops 1-2, 2-3 and 3-1 give six equations for seven angles, but each follows from the
other two: four are independent and leave three degrees of freedom. The plane is horizontal; the motors are Q_a1, Q_a2,
Q_a3. Motions are unique, the multipliers are those of least norm.

Source: C. Gosselin, J. Angeles, The optimum kinematic design of a planar three-degree-of-freedom parallel manipulator,
Journal of Mechanisms, Transmissions, and Automation in Design 110, 1988 (the mechanism); values chosen.
"""

from sympy import Rational, cos, pi, sin

from lag2fmu.mechanism import Body, Constraint, Experiment, Mechanism, Output, coordinate, parameter

DIRECTIONS = [-pi * Rational(5, 6), -pi / 6, pi / 2]
"""Where the legs stand, seen from the centre of the base."""

GUESSES = {"a1": 1.15, "b1": -0.3, "a2": 3.24, "b2": 1.8, "a3": 5.34, "b3": 3.9}


def parallel_manipulator() -> Mechanism:
    """The mechanism with the angles of the links and of the platform as coordinates, three loops closed."""
    R, r = parameter("R", 0.5, "m", "radius of the base"), parameter("r", 0.1, "m", "radius of the platform")
    l1, l2 = parameter("l1", 0.3, "m", "length of upper links"), parameter("l2", 0.3, "m", "length of lower links")
    m1, m2 = parameter("m1", 0.6, "kg", "mass of an upper link"), parameter("m2", 0.4, "kg", "mass of a lower link")
    mp = parameter("mp", 1.0, "kg", "mass of the platform")
    J = parameter("J", mp * r**2 / 4, "kg.m2", "moment of inertia of the platform about its centre")
    rates = {"a1": 2.0, "a2": 1.0, "a3": -0.5}
    angles = {
        name: coordinate(name, "rad", guess=value, velocity=rates.get(name), doc=f"angle of link {name}")
        for name, value in GUESSES.items()
    }
    theta = coordinate("theta", "rad", start=0.0, doc="angle of the platform")

    bodies, ends = [], []
    for i, direction in enumerate(DIRECTIONS, 1):
        a, b = angles[f"a{i}"], angles[f"b{i}"]
        x, y = R * cos(direction), R * sin(direction)
        x_B, y_B = x + l1 * cos(a), y + l1 * sin(a)
        bodies.append(Body(f"upper{i}", m1, ((x + x_B) / 2, (y + y_B) / 2), angle=a, inertia=m1 * l1**2 / 12))
        lower = (x_B + l2 / 2 * cos(b), y_B + l2 / 2 * sin(b))
        bodies.append(Body(f"lower{i}", m2, lower, angle=b, inertia=m2 * l2**2 / 12))
        # the centre of the platform as this leg has it
        ends.append((x_B + l2 * cos(b) - r * cos(theta + direction), y_B + l2 * sin(b) - r * sin(theta + direction)))

    loops = [(i, (i + 1) % 3) for i in range(3)]
    return Mechanism(
        "parallel_manipulator",
        title="Planar parallel manipulator 3-RRR",
        source="C. Gosselin, J. Angeles, J. Mechanisms, Transmissions, Automation in Design 110, 1988; values chosen",
        coordinates=[*angles.values(), theta],
        parameters=[R, r, l1, l2, m1, m2, mp, J],
        bodies=[*bodies, Body("platform", mp, ends[0], angle=theta, inertia=J)],
        constraints=[
            Constraint(f"loop{i + 1}{j + 1}_{axis}", ends[i][k] - ends[j][k])
            for i, j in loops
            for k, axis in enumerate("xy")
        ],
        outputs=[Output(s, ends[0][k], "m", f"centre of the platform, {s}") for k, s in enumerate("xy")],
        experiment=Experiment(stop_time=2.0),
        strict_units=True,
    )
