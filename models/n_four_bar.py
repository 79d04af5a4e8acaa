r"""N-four-bar mechanism: n parallelograms in a row; where all links lie in a line it could fold in many ways.

::

      B0----b1----B1----b2----B2 ...     a0 ... an  angles of the cranks A0 B0 ... from the x axis
      |           |           |          b1 ... bn  angles of the couplers
    a0|         a1|         a2|          l, m       length and mass of each link (homogeneous)
      A0- - - - - A1- - - - - A2 ...     g          gravity, along -y

It has one degree of freedom, but n + 1 of them at the instant when the cranks are horizontal: there the 2n constraints
have rank n only. A motion that goes on with the velocities it has keeps the couplers horizontal.

Source: IFToMM Technical Committee for Multibody Dynamics, Library of Computational Benchmark Problems, A02 (n = 40,
20 s; the error of B0 shall be less than 1e-3); there after J. Garcia de Jalon, E. Bayo, Kinematic and Dynamic
Simulation of Multibody Systems, Springer 1994. The run of the default experiment ends before the singular position.
"""

from sympy import cos, pi, sin

from lag2fmu.mechanism import Body, Constraint, Experiment, Mechanism, Output, coordinate, parameter


def n_four_bar(n: int = 2) -> Mechanism:
    """The mechanism with ``n`` windows; the cranks start upright, B0 with 1 m/s to the right."""
    if not 1 <= n <= 100:
        raise ValueError(f"n = {n} windows; give 1 to 100")
    l, m = parameter("l", 1.0, "m", "length of a link"), parameter("m", 1.0, "kg", "mass of a link")  # noqa: E741
    I = parameter("I", m * l**2 / 12, "kg.m2", "moment of inertia of a link about its mass centre")  # noqa: E741
    g = parameter("g", 9.81, "m/s2", "gravity")
    up = float(pi / 2)
    a = [coordinate("a0", "rad", start=up, velocity=-1.0, doc="angle of crank 0")]
    a += [coordinate(f"a{i}", "rad", guess=up, guess_velocity=-1.0, doc=f"angle of crank {i}") for i in range(1, n + 1)]
    b = [coordinate(f"b{i}", "rad", guess=0.0, doc=f"angle of coupler {i}") for i in range(1, n + 1)]

    bodies = [
        Body(f"crank{i}", m, (i * l + l / 2 * cos(a[i]), l / 2 * sin(a[i])), angle=a[i], inertia=I)
        for i in range(n + 1)
    ]
    constraints = []
    for i in range(n):
        x, y = i * l + l * cos(a[i]), l * sin(a[i])
        centre = x + l / 2 * cos(b[i]), y + l / 2 * sin(b[i])
        bodies.append(Body(f"coupler{i + 1}", m, centre, angle=b[i], inertia=I))
        constraints.append(Constraint(f"window{i + 1}_x", cos(a[i]) + cos(b[i]) - cos(a[i + 1]) - 1))
        constraints.append(Constraint(f"window{i + 1}_y", sin(a[i]) + sin(b[i]) - sin(a[i + 1])))

    return Mechanism(
        "n_four_bar",
        title=f"{n}-four-bar mechanism",
        source="IFToMM Library of Computational Benchmark Problems, A02",
        coordinates=[*a, *b],
        parameters=[l, m, I, g],
        bodies=bodies,
        gravity=g,
        constraints=constraints,
        outputs=[
            Output("x_B0", l * cos(a[0]), "m", "B0, horizontal"),
            Output("y_B0", l * sin(a[0]), "m", "B0, vertical"),
        ],
        experiment=Experiment(stop_time=0.6, step=0.005),
        strict_units=True,
    )
