r"""Heavy symmetric top: a body of revolution that spins about a fixed point of its axis, in Euler angles z-x-z.

::

           z |    / z'       phi     precession: angle of the line of nodes about the vertical z
             |   o C         theta   nutation: angle of the axis z' from the vertical
             |theta/ l       psi     spin: angle about the axis z'
             | /             m, l    mass, distance of the mass centre C from the fixed point O
             |/              A, C    moments of inertia about C, across the axis and about it
             O ------ y      g       gravity, along -z

phi and psi are cyclic: p_psi = C (psi_dot + phi_dot cos(theta)) and p_phi are conserved, as T + V is. Euler's angles
are singular at theta = 0; the top starts away from it, with a spin that is fast enough to hold it up.

Source: H. Goldstein, Classical Mechanics, 2nd edition, section 5-7; values: a top of turned wood, chosen.
"""

from lag2fmu.mechanism import Body, Experiment, Frame, Mechanism, Output, coordinate, parameter


def heavy_top() -> Mechanism:
    """The mechanism with phi, theta, psi as generalized coordinates; one frame carries the top."""
    m = parameter("m", 0.5, "kg", "mass of the top")
    l = parameter("l", 0.08, "m", "distance of the mass centre from the fixed point")  # noqa: E741
    A = parameter("A", 6e-4, "kg.m2", "moment of inertia about the mass centre, across the axis")
    C = parameter("C", 1e-3, "kg.m2", "moment of inertia about the axis")
    g = parameter("g", 9.81, "m/s2", "gravity")
    phi = coordinate("phi", "rad", doc="precession")
    theta = coordinate("theta", "rad", start=0.5, doc="nutation, from the upward vertical")
    psi = coordinate("psi", "rad", velocity=80.0, nominal=100.0, doc="spin about the axis of the top")

    top = Frame("top", rotations=[("z", phi), ("x", theta), ("z", psi)])

    return Mechanism(
        "heavy_top",
        title="Heavy symmetric top",
        source="H. Goldstein, Classical Mechanics, 2nd edition, section 5-7",
        coordinates=[phi, theta, psi],
        parameters=[m, l, A, C, g],
        frames=[top],
        bodies=[Body("rotor", m, frame=top, center=(0, 0, l), inertia=(A, A, C, 0, 0, 0))],
        gravity=g,
        outputs=[
            Output("centre", point="rotor", quantity="position", doc="mass centre"),
            Output("omega", frame=top, quantity="angular_velocity", axes="frame", doc="angular velocity, body axes"),
        ],
        experiment=Experiment(stop_time=5.0),
        strict_units=True,
    )
