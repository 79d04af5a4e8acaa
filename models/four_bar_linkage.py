r"""Four-bar linkage: Hoeken's straight-line mechanism, a crank-rocker whose coupler ends in a point P.

::

        P .                      a, b, c  angles of crank, coupler and rocker from the x axis
            ' .  b               l1       length of the crank, O A
                B '- .           l2       coupler: A B and B P, its mass centre is B
               /       'A        l3       length of the rocker, C B
           l3 /        / l1      d        distance of the pivots, O C
             /c      a/          rho      mass of the links by length (homogeneous)
        ----C---------O---- x    g        gravity, along -y
                 d

The loop closes where A B = C B - C A: two equations leave one degree of freedom. With l2 = l3 = 5/2 l1 and d = 2 l1
P runs on an almost straight line through half of the crank's turn.

Source: R. L. Norton, Design of Machinery, McGraw-Hill, chapter 3, straight-line mechanisms: Hoeken; masses chosen.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Constraint, Experiment, Mechanism, Output, coordinate, parameter


def four_bar_linkage() -> Mechanism:
    """The mechanism with the angles a, b, c as coordinates; two constraints close the loop."""
    l1 = parameter("l1", 0.1, "m", "length of the crank")
    l2 = parameter("l2", 0.25, "m", "half length of the coupler")
    l3 = parameter("l3", 0.25, "m", "length of the rocker")
    d = parameter("d", 0.2, "m", "distance of the pivots")
    rho = parameter("rho", 2.0, "kg/m", "mass of the links by length")
    g = parameter("g", 9.81, "m/s2", "gravity")
    a = coordinate("a", "rad", start=0.5, velocity=10.0, doc="angle of the crank")
    b = coordinate("b", "rad", guess=2.2, doc="angle of the coupler")
    c = coordinate("c", "rad", guess=1.3, doc="angle of the rocker")

    x_A, y_A = l1 * cos(a), l1 * sin(a)
    x_B, y_B = -d + l3 * cos(c), l3 * sin(c)

    def rod(name, length, centre, angle):  # type: ignore[no-untyped-def]
        return Body(name, rho * length, centre, angle=angle, inertia=rho * length**3 / 12)

    return Mechanism(
        "four_bar_linkage",
        title="Four-bar linkage of Hoeken",
        source="R. L. Norton, Design of Machinery, McGraw-Hill, chapter 3",
        coordinates=[a, b, c],
        parameters=[l1, l2, l3, d, rho, g],
        gravity=g,
        bodies=[
            rod("crank", l1, (x_A / 2, y_A / 2), a),
            rod("coupler", 2 * l2, (x_A + l2 * cos(b), y_A + l2 * sin(b)), b),
            rod("rocker", l3, (-d + l3 / 2 * cos(c), l3 / 2 * sin(c)), c),
        ],
        constraints=[
            Constraint("loop_x", x_A + l2 * cos(b) - x_B),
            Constraint("loop_y", y_A + l2 * sin(b) - y_B),
        ],
        outputs=[
            Output("x_P", x_A + 2 * l2 * cos(b), "m", "end of the coupler, horizontal"),
            Output("y_P", y_A + 2 * l2 * sin(b), "m", "end of the coupler, vertical"),
        ],
        experiment=Experiment(stop_time=1.5, step=0.005, tolerance=1e-7),
        strict_units=True,
    )
