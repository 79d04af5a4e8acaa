r"""Heavy symmetric top in a quaternion: the top of ``heavy_top`` without the gimbal lock of Euler's angles.

::

           z |    / z'       e0 ... e3  unit quaternion: cos(turn/2), and the axis times sin(turn/2)
             |   o C         m, l       mass, distance of the mass centre C from the fixed point O
             |  / l          A, C       moments of inertia about C, across the axis and about it
             | /             g          gravity, along -z
             |/
             O ------ y

Four coordinates and the norm 1 of the quaternion leave three degrees of freedom; it may go through the upright, where
Euler's angles are singular. The start is the one of ``heavy_top``: the axis leans by 0.5 rad, the spin is 80 rad/s.

Source: H. Goldstein, Classical Mechanics, 2nd edition, sections 4-5 and 5-7; values: a top of turned wood, chosen.
"""

from math import cos, sin

from lag2fmu.mechanism import Body, Experiment, Frame, Mechanism, Output, coordinate, parameter

LEAN, SPIN = 0.5, 80.0


def heavy_top_quaternion() -> Mechanism:
    """The mechanism with the quaternion as coordinates; one frame carries the top and brings the norm constraint."""
    m = parameter("m", 0.5, "kg", "mass of the top")
    l = parameter("l", 0.08, "m", "distance of the mass centre from the fixed point")  # noqa: E741
    A = parameter("A", 6e-4, "kg.m2", "moment of inertia about the mass centre, across the axis")
    C = parameter("C", 1e-3, "kg.m2", "moment of inertia about the axis")
    g = parameter("g", 9.81, "m/s2", "gravity")
    # a turn about x by the lean; e_dot = e times (0, 0, 0, spin)/2
    starts, rates = (cos(LEAN / 2), sin(LEAN / 2), 0.0, 0.0), (0.0, 0.0, -sin(LEAN / 2), cos(LEAN / 2))
    e = [
        coordinate(f"e{i}", "1", start=starts[i], velocity=rates[i] * SPIN / 2, doc=f"quaternion, part {part}")
        for i, part in enumerate(("0, scalar", "along x", "along y", "along z"))
    ]
    top = Frame("top", quaternion=e)

    return Mechanism(
        "heavy_top_quaternion",
        title="Heavy symmetric top in a quaternion",
        source="H. Goldstein, Classical Mechanics, 2nd edition, sections 4-5 and 5-7",
        coordinates=e,
        parameters=[m, l, A, C, g],
        frames=[top],
        bodies=[Body("rotor", m, frame=top, center=(0, 0, l), inertia=(A, A, C, 0, 0, 0))],
        gravity=g,
        outputs=[
            Output("centre", point="rotor", quantity="position", doc="mass centre"),
            Output("omega", frame=top, quantity="angular_velocity", axes="frame", doc="angular velocity, body axes"),
        ],
        experiment=Experiment(stop_time=2.0),
        strict_units=True,
    )
