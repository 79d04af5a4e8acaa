r"""Bricard's mechanism: six equal rods, joined to a ring by six revolute joints; by the count it could not move at all.

::

        P5--------P4            P1 ... P6  joints, at corners of a cube in the start; each has its axis across
          |          \                     both rods that it joins
        y |        P3 \|         q1 ... q5  angles of the joints P1 ... P5, about y, z, x, y, z; P6 closes the ring
         P6         |           l, m       length and mass of a rod, a square bar of width s (homogeneous)
        z  \  x     | y          g          gravity, along -y
            P1-----P2

The rods start along the edges x, y, z, -x, -y of the cube; the one along -z, from P6 to P1, is fixed. Five angles meet
five equations at P6 (its place, and the axis of the last joint), of which four are independent in all positions that
can be reached: one degree of freedom is left.

Source: IFToMM Technical Committee for Multibody Dynamics, Library of Computational Benchmark Problems, A04 (rods of
1 m, 1 kg, width 0.1 m; gravity along -y; there with another rod at rest).
"""

from lag2fmu.mechanism import (
    Body,
    Experiment,
    Frame,
    Gravity,
    Joint,
    Mechanism,
    Output,
    Point,
    coordinate,
    parameter,
)

EDGES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0)]
AXES = ["y", "z", "x", "y", "z"]


def bricard() -> Mechanism:
    """The mechanism with the angles of five joints as coordinates, the sixth joint closed by its constraints."""
    l, m = parameter("l", 1.0, "m", "length of a rod"), parameter("m", 1.0, "kg", "mass of a rod")  # noqa: E741
    s = parameter("s", 0.1, "m", "width of a rod")
    along = parameter("I1", m * s**2 / 6, "kg.m2", "moment of inertia of a rod about its axis")
    across = parameter("I2", m * (l**2 + s**2) / 12, "kg.m2", "moment of inertia of a rod across its axis")
    g = parameter("g", 9.81, "m/s2", "gravity")
    q = [coordinate("q1", "rad", start=0.0, velocity=0.0, doc="angle of joint 1")]
    q += [coordinate(f"q{i}", "rad", guess=0.0, doc=f"angle of joint {i}") for i in range(2, 6)]

    frames, bodies = [], []
    for i, (edge, axis) in enumerate(zip(EDGES, AXES, strict=True)):
        origin = (0, 0, 0) if i == 0 else tuple(l * x for x in EDGES[i - 1])
        parent = "world" if i == 0 else frames[-1]
        frames.append(Frame(f"rod{i + 1}", parent=parent, origin=origin, rotations=[(axis, q[i])]))
        inertia = tuple(along if x else across for x in edge)
        center = tuple(l * x / 2 for x in edge)
        bodies.append(Body(f"bar{i + 1}", m, frame=frames[-1], center=center, inertia=(*inertia, 0, 0, 0)))

    return Mechanism(
        "bricard",
        title="Bricard's mechanism",
        source="IFToMM Library of Computational Benchmark Problems, A04, with another rod at rest",
        coordinates=q,
        parameters=[l, m, s, along, across, g],
        frames=frames,
        bodies=bodies,
        points=[
            Point("P3", tuple(l * x for x in EDGES[2]), frame="rod3"),
            Point("end", tuple(l * x for x in EDGES[4]), frame="rod5"),
            Point("P6", (0, 0, l)),
        ],
        gravity=Gravity(g, (0, -1, 0)),
        joints=[Joint("closure", "revolute", between=("P6", "end"), axis="x")],
        outputs=[Output("P3", point="P3", quantity="position", doc="joint P3")],
        experiment=Experiment(stop_time=2.0),
        strict_units=True,
    )
