r"""Sphere on an incline: a ball rolls without slipping on an inclined plane.

::

        ( )                 x, y      centre of the ball: down the slope, across it
       `-.'-.               e0 ... e3 quaternion of its orientation
          `-.`-. x          R, m      radius and mass
             `-.`           kappa     I/(m R^2), I being the moment of inertia: 2/5 homogeneous, 2/3 hollow
       alpha  ( `-.`        alpha, g  angle of the slope, gravity
      --------------

The centre moves as a projectile, with the acceleration g sin(alpha)/(1 + kappa) down the slope: 5/7 g sin(alpha) for a
homogeneous ball. Its spin about the normal stays.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 38, problem 1 (sphere that rolls under a given force).
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Constraint, Experiment, Frame, Gravity, Mechanism, Output, coordinate, parameter


def sphere_on_incline() -> Mechanism:
    """The mechanism with x, y and a unit quaternion as coordinates; z is normal to the plane."""
    m, R = parameter("m", 0.2, "kg", "mass of the ball"), parameter("R", 0.03, "m", "radius of the ball")
    kappa = parameter("kappa", 0.4, "1", "moment of inertia, in m R^2")
    I = parameter("I", kappa * m * R**2, "kg.m2", "moment of inertia of the ball")  # noqa: E741
    alpha = parameter("alpha", 0.3, "rad", "angle of the slope")
    g = parameter("g", 9.81, "m/s2", "gravity")
    x = coordinate("x", "m", velocity=-0.5, doc="centre of the ball, down the slope")
    y = coordinate("y", "m", velocity=0.3, doc="centre of the ball, across the slope")
    e0 = coordinate("e0", "1", start=1.0, doc="quaternion, scalar part")
    e1, e2, e3 = (
        coordinate(f"e{i}", "1", start=0.0, doc=f"quaternion, part along {k}") for i, k in enumerate("xyz", 1)
    )

    # angular velocity in the fixed axes: twice the vector part of e_dot times the conjugate of e
    omega_x = 2 * (e0 * e1.dot - e1 * e0.dot + e2 * e3.dot - e3 * e2.dot)
    omega_y = 2 * (e0 * e2.dot - e2 * e0.dot + e3 * e1.dot - e1 * e3.dot)
    ball = Frame("ball", origin=(x, y, R), quaternion=(e0, e1, e2, e3))

    return Mechanism(
        "sphere_on_incline",
        title="Sphere rolling on an inclined plane",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 38, problem 1",
        coordinates=[x, y, e0, e1, e2, e3],
        parameters=[m, R, kappa, I, alpha, g],
        frames=[ball],
        bodies=[Body("sphere", m, frame=ball, inertia=(I, I, I, 0, 0, 0))],
        gravity=Gravity(g, direction=(sin(alpha), 0, -cos(alpha))),
        constraints=[
            Constraint("rolling_x", x.dot - R * omega_y, kind="nonholonomic"),
            Constraint("rolling_y", y.dot + R * omega_x, kind="nonholonomic"),
        ],
        outputs=[Output("omega", frame=ball, quantity="angular_velocity", doc="angular velocity, fixed axes")],
        experiment=Experiment(stop_time=0.5, step=0.005),
        strict_units=True,
    )
