r"""Whipple bicycle: frame with a rigid rider, front fork and two wheels with thin rims; it may balance by itself.

::

           (rider)  \ steer axis, tilted by lam    x, y     rear contact P      psi      yaw
              B   H  \                             phi      roll (lean)         chi      pitch of the frame
          ,-.        ,\.                           delta    steer               theta_R, theta_F  wheels
         ( R )      ( F \                          w, c     wheel base, trail   rR, rF   radii of the wheels
     x ---'P'--------'Q'-\---  z down              m*, x*, z*, I*   masses, mass centres (from P), inertias

Eight coordinates, two wheels that roll (four equations in the velocities) and the front wheel that stays on the ground
leave three degrees of freedom. Axes as in the source: x ahead, y to the right, z down; the wheels turn backwards,
theta_R_dot = -v/rR. It balances for 4.292 m/s < v < 6.024 m/s; the start has 4.6 m/s and a push to the side.

Source: J. P. Meijaard, J. M. Papadopoulos, A. Ruina, A. L. Schwab, Linearized dynamics equations for the balance and
steer of a bicycle, Proc. R. Soc. A 463, 2007, table 1.
"""

from sympy import Matrix, cos, pi, rot_ccw_axis1, rot_ccw_axis2, rot_ccw_axis3, sin, sqrt

from lag2fmu.mechanism import Body, Constraint, Experiment, Frame, Gravity, Mechanism, coordinate, parameter

VALUES = {
    "m": {"w": 1.02, "c": 0.08, "rR": 0.3, "rF": 0.35, "xB": 0.3, "zB": -0.9, "xH": 0.9, "zH": -0.7},
    "kg": {"mR": 2.0, "mB": 85.0, "mH": 4.0, "mF": 3.0},
    "kg.m2": {
        "IRxx": 0.0603, "IRyy": 0.12, "IBxx": 9.2, "IByy": 11.0, "IBzz": 2.8, "IBxz": 2.4,
        "IHxx": 0.05892, "IHyy": 0.06, "IHzz": 0.00708, "IHxz": -0.00756, "IFxx": 0.1405, "IFyy": 0.28,
    },
}  # fmt: skip
STARTS = {"x": (0, None), "y": (0, None), "psi": (0, None), "phi": (0, 0.5), "chi": (None, None), "delta": (0, 0),
          "theta_R": (0, -4.6 / 0.3), "theta_F": (0, None)}  # fmt: skip


def whipple_bicycle() -> Mechanism:
    """The mechanism with rear contact, yaw, roll, pitch, steer and the wheels' angles as coordinates."""
    p = {
        n: parameter(n, v, u, f"{n} in table 1 of the source") for u, group in VALUES.items() for n, v in group.items()
    }
    p["lam"], p["g"] = (
        parameter("lam", pi / 10, "rad", "tilt of the steer axis"),
        parameter("g", 9.81, "m/s2", "gravity"),
    )
    w, c, rR, rF, xB, zB, xH, zH, mR, mB, mH, mF = list(p.values())[:12]
    IRxx, IRyy, IBxx, IByy, IBzz, IBxz, IHxx, IHyy, IHzz, IHxz, IFxx, IFyy, lam, g = list(p.values())[12:]
    q = [
        coordinate(name, "m" if name in "xy" else "rad", start=place, velocity=rate, doc=f"{name} in the figure")
        for name, (place, rate) in STARTS.items()
    ]
    x, y, psi, phi, chi, delta, theta_R, theta_F = q

    upright = [("z", psi), ("x", phi)]
    P = rot_ccw_axis3(psi) * rot_ccw_axis1(phi)  # axes of track and wheel plane
    S = P * rot_ccw_axis2(chi) * rot_ccw_axis2(lam)  # of the steer axis
    rear_centre = Matrix([x, y, 0]) - rR * P[:, 2]
    rear = Frame("rear", origin=rear_centre, rotations=[*upright, ("y", chi)])
    fork = Frame("fork", rear, (w + c, 0, rR), [("y", lam), ("z", delta), ("y", -lam)])
    wheels = [
        Frame("rear_wheel", rear, rotations=[("y", theta_R)]),
        Frame("front_wheel", fork, (-c, 0, -rF), [("y", theta_F)]),
    ]

    F = S * rot_ccw_axis3(delta)
    axle = F[:, 1]
    centre = (
        rear_centre + S * rot_ccw_axis2(-lam) * Matrix([w + c, 0, rR]) + F * rot_ccw_axis2(-lam) * Matrix([-c, 0, -rF])
    )
    down = (Matrix([0, 0, 1]) - axle[2] * axle) / sqrt(1 - axle[2] ** 2)  # from the axle to the lowest point of the rim
    omega = (
        psi.dot * Matrix([0, 0, 1]) + phi.dot * P[:, 0] + chi.dot * P[:, 1] + delta.dot * S[:, 2] + theta_F.dot * axle
    )
    slip = centre.jacobian(q) * Matrix([u.dot for u in q]) + omega.cross(rF * down)
    rolled = -rR * (chi.dot + theta_R.dot)
    return Mechanism(
        "whipple_bicycle",
        title="Whipple bicycle",
        source="J. P. Meijaard, J. M. Papadopoulos, A. Ruina, A. L. Schwab, Proc. R. Soc. A 463, 2007",
        coordinates=q,
        parameters=p.values(),
        frames=[rear, fork, *wheels],
        bodies=[
            Body("R", mR, frame="rear_wheel", inertia=(IRxx, IRyy, IRxx, 0, 0, 0)),
            Body("B", mB, frame=rear, center=(xB, 0, zB + rR), inertia=(IBxx, IByy, IBzz, 0, IBxz, 0)),
            Body("H", mH, frame=fork, center=(xH - w - c, 0, zH), inertia=(IHxx, IHyy, IHzz, 0, IHxz, 0)),
            Body("F", mF, frame="front_wheel", inertia=(IFxx, IFyy, IFxx, 0, 0, 0)),
        ],
        gravity=Gravity(g, (0, 0, 1)),
        constraints=[
            Constraint("front_height", (centre + rF * down)[2]),
            Constraint("rear_x", x.dot - rolled * cos(psi), kind="nonholonomic"),
            Constraint("rear_y", y.dot - rolled * sin(psi), kind="nonholonomic"),
            Constraint("front_x", slip[0], kind="nonholonomic"),
            Constraint("front_y", slip[1], kind="nonholonomic"),
        ],
        experiment=Experiment(stop_time=2.0, step=0.02),
        strict_units=True,
    )
