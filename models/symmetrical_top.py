r"""Free symmetrical top: a rigid body of revolution that nothing acts on, in Euler angles.

::

        z |    / axis       phi, theta, psi   Euler angles: precession, nutation, rotation about the axis (z, x, z)
          |   /             I1                inertia across the axis
    theta |  /              I3                inertia about the axis
          | /               m                 mass; the mass centre rests
          O

The axis goes round the angular momentum M at a constant angle (regular precession) with M/I1; the body turns about
it with M cos(theta) (1/I3 - 1/I1).

Source: L. D. Landau, E. M. Lifshitz, Mechanics, sections 33 and 35.
"""

from lag2fmu.mechanism import Body, Frame, Mechanism, coordinate, parameter


def symmetrical_top() -> Mechanism:
    """The mechanism with the Euler angles as generalized coordinates.

    With theta_dot = 0 the start is a regular precession about z; as it is, M points elsewhere.
    """
    m = parameter("m", 1.0, "kg", "mass")
    I1 = parameter("I1", 0.02, "kg.m2", "inertia across the axis")
    I3 = parameter("I3", 0.03, "kg.m2", "inertia about the axis")
    phi = coordinate("phi", "rad", velocity=5.0, doc="precession")
    theta = coordinate("theta", "rad", start=1.0471975511965976, velocity=1.0, doc="nutation")
    psi = coordinate("psi", "rad", velocity=-5.0 / 6.0, doc="rotation about the axis")

    body = Frame("body", rotations=[("z", phi), ("x", theta), ("z", psi)])

    return Mechanism(
        "symmetrical_top",
        title="Free symmetrical top",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, sections 33 and 35",
        coordinates=[phi, theta, psi],
        parameters=[m, I1, I3],
        frames=[body],
        bodies=[Body("top", m, frame=body, center=(0, 0, 0), inertia=(I1, I1, I3, 0, 0, 0))],
        strict_units=True,
    )
