r"""Rattleback: a stone with the underside of an ellipsoid rolls on a plane; spun the wrong way, it turns back.

::

               z | psi              x, y      centre of the ellipsoid, over the plane
          _______|_______           psi       heading, about the vertical
        (    .   o G     )          phi, chi  roll about the long axis, pitch about the short one
         `-._________.-'            a, b, c   semi-axes of the ellipsoid (along body x, y, z)
      ===========*============      h         distance of the mass centre G below the centre of the ellipsoid
                                    m, g      mass, gravity along -z
                                    A ... D   inertia: xx, yy, zz, xy (about G, in body axes)

Because of D the principal axes of inertia are not those of the ellipsoid: a spin in one sense feeds the rattling, which
feeds a spin in the other sense. It turns back after 3 s; the run is short as it comes, for the rattling is quick. The
material point of contact is at rest.

Source: T. R. Kane, D. A. Levinson, Realistic mathematical modeling of the rattleback, International Journal of
Non-Linear Mechanics 17, 1982; without its damping.
"""

from math import radians

from sympy import Matrix, cos, sin, sqrt

from lag2fmu.mechanism import Body, Constraint, Experiment, Frame, Mechanism, Output, coordinate, parameter


def rattleback() -> Mechanism:
    """The mechanism with x, y, psi, phi and chi as coordinates and two rolling constraints."""
    m, g = parameter("m", 1.0, "kg", "mass"), parameter("g", 9.81, "m/s2", "gravity")
    a, b = parameter("a", 0.2, "m", "long semi-axis"), parameter("b", 0.03, "m", "short semi-axis")
    c = parameter("c", 0.02, "m", "vertical semi-axis")
    h = parameter("h", 0.01, "m", "mass centre, below the centre of the ellipsoid")
    A, B = parameter("A", 2e-4, "kg.m2", "inertia xx"), parameter("B", 1.6e-3, "kg.m2", "inertia yy")
    C, D = parameter("C", 1.7e-3, "kg.m2", "inertia zz"), parameter("D", -2e-5, "kg.m2", "inertia xy")
    x = coordinate("x", "m", start=0.0, nominal=0.1, doc="centre of the ellipsoid, x")
    y = coordinate("y", "m", start=0.0, nominal=0.1, doc="centre of the ellipsoid, y")
    psi = coordinate("psi", "rad", start=0.0, velocity=-5.0, doc="heading")
    phi = coordinate("phi", "rad", start=radians(0.5), velocity=0.0, nominal=0.1, doc="roll about the long axis")
    chi = coordinate("chi", "rad", start=radians(0.5), velocity=0.0, nominal=0.1, doc="pitch about the short axis")

    # in body axes: the vertical, the angular velocity, the point of contact from the centre of the ellipsoid
    vertical = Matrix([-cos(phi) * sin(chi), sin(phi), cos(phi) * cos(chi)])
    omega = vertical * psi.dot + Matrix([cos(chi), 0, sin(chi)]) * phi.dot + Matrix([0, 1, 0]) * chi.dot
    height = sqrt(sum((s * u) ** 2 for s, u in zip((a, b, c), vertical, strict=True)))
    contact = Matrix([-(s**2) * u / height for s, u in zip((a, b, c), vertical, strict=True)])

    # its velocity against the centre, along the heading and across it
    roll = Matrix([[1, 0, 0], [0, cos(phi), -sin(phi)], [0, sin(phi), cos(phi)]])
    pitch = Matrix([[cos(chi), 0, sin(chi)], [0, 1, 0], [-sin(chi), 0, cos(chi)]])
    along, across, _ = roll * pitch * omega.cross(contact)
    stone = Frame("stone", origin=(x, y, height), rotations=[("z", psi), ("x", phi), ("y", chi)])

    return Mechanism(
        "rattleback",
        title="Rattleback",
        source="T. R. Kane, D. A. Levinson, International Journal of Non-Linear Mechanics 17, 1982",
        coordinates=[x, y, psi, phi, chi],
        parameters=[m, g, a, b, c, h, A, B, C, D],
        frames=[stone],
        bodies=[Body("body", m, frame=stone, center=(0, 0, -h), inertia=(A, B, C, D, 0, 0))],
        gravity=g,
        constraints=[
            Constraint("rolling_along", x.dot * cos(psi) + y.dot * sin(psi) + along, kind="nonholonomic"),
            Constraint("rolling_across", y.dot * cos(psi) - x.dot * sin(psi) + across, kind="nonholonomic"),
        ],
        outputs=[Output("height", height, "m", "centre of the ellipsoid, over the plane")],
        experiment=Experiment(stop_time=0.2, step=0.005),
        strict_units=True,
    )
