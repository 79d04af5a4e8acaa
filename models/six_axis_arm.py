r"""Six-axis arm: the PUMA 560 robot with the inertial parameters that were measured on a dismantled one.

::

                 3 o-------- a2 -------- o 2       joint i turns by theta_i about z_i of frame i, which is on frame
                   |                   /_ 1_       i - 1 by Denavit and Hartenberg's modified convention:
                d4 |                    |  |       turned by alpha_i about x, moved by a_i along x, then by d_i along
              4,5,6 o wrist             |__| base  the new z. Gravity is along -z of the base.

J_i and b_i are inertia and viscous friction of motor i times its gear ratio squared; torques are Q_theta_i. Oddities of
the table: link 1 has no mass and only Izz, all that matters there; other copies of it give Izz = 0.086 for link 3, more
than Ixx + Iyy, which no body has.

Source: B. Armstrong, O. Khatib, J. Burdick, The explicit dynamic model and inertial parameters of the PUMA 560 arm,
IEEE Conf. Robotics and Automation, 1986, as in P. Corke, Robotics Toolbox, mdl_puma560akb.m; friction: P. Corke,
B. Armstrong-Helouvry, A search for consensus among model parameters reported for the PUMA 560 robot, ibid. 1994.
"""

from sympy import cos, pi, sin

from lag2fmu.mechanism import Body, Damper, Energy, Frame, Mechanism, Output, Point, coordinate, parameter

COLUMNS = dict.fromkeys(("a", "d"), "m") | {"m": "kg"} | dict.fromkeys(("cx", "cy", "cz"), "m")
COLUMNS |= dict.fromkeys(("Ixx", "Iyy", "Izz", "J"), "kg.m2") | {"b": "N.m.s/rad"}
LINKS = (  # alpha, start (rad); a, d, m, cx, cy, cz, Ixx, Iyy, Izz; inertia and friction of the motor, its gear ratio
    (0, 0.0, 0, 0, 0, 0, 0, 0, 0.35, 0.35, 0.35, 291e-6, 1.48e-3, 62.6111),
    (-pi / 2, -0.6, 0, 0.2435, 17.4, 0.068, 0.006, -0.016, 0.13, 0.524, 0.539, 409e-6, 817e-6, 107.815),
    (0, 0.4, 0.4318, -0.0934, 4.8, 0, -0.07, 0.014, 0.066, 0.0125, 0.066, 299e-6, 1.38e-3, 53.7063),
    (pi / 2, 0.3, -0.0203, 0.4331, 0.82, 0, 0, -0.019, 1.8e-3, 1.8e-3, 1.3e-3, 35e-6, 71.2e-6, 76.0364),
    (-pi / 2, 0.5, 0, 0, 0.34, 0, 0, 0, 0.3e-3, 0.3e-3, 0.4e-3, 35e-6, 82.6e-6, 71.923),
    (pi / 2, 0.0, 0, 0, 0.09, 0, 0, 0.032, 0.15e-3, 0.15e-3, 0.04e-3, 35e-6, 36.7e-6, 76.686),
)


def six_axis_arm() -> Mechanism:
    """The robot with theta_1 ... theta_6 as generalized coordinates: it sinks from its start until it hangs."""
    parameters = [g := parameter("g", 9.81, "m/s2", "gravity"), tool := parameter("tool", 0.0563, "m", "flange on z_6")]
    theta, frames, bodies, rotors, dampers = [], [], [], 0, []
    for i, (alpha, start, *sizes, rotor, friction, ratio) in enumerate(LINKS, 1):
        values = zip(COLUMNS.items(), (*sizes, rotor * ratio**2, friction * ratio**2), strict=True)
        link = {k: parameter(f"{k}_{i}", x, unit, f"{k} of link {i}") for (k, unit), x in values if x}
        a, d, m, cx, cy, cz, Ixx, Iyy, Izz, J, b = (link.get(k, 0) for k in COLUMNS)
        parameters += link.values()
        theta.append(q := coordinate(f"theta_{i}", "rad", start=start, doc=f"angle of joint {i}"))
        origin = (a, -sin(alpha) * d, cos(alpha) * d)
        frames.append(Frame(f"link_{i}", frames[-1] if frames else "world", origin, [("x", alpha), ("z", q)]))
        bodies.append(Body(f"link_{i}", m, frame=frames[-1], center=(cx, cy, cz), inertia=(Ixx, Iyy, Izz, 0, 0, 0)))
        rotors += J * q.dot**2 / 2
        dampers.append(Damper(f"joint_{i}", b, rate=q.dot))

    return Mechanism(
        "six_axis_arm",
        title="Six-axis arm: PUMA 560",
        source="B. Armstrong, O. Khatib, J. Burdick, IEEE Conf. Robotics and Automation, 1986",
        coordinates=theta,
        parameters=parameters,
        energy=Energy(kinetic=rotors),
        frames=frames,
        bodies=bodies,
        points=[Point("flange", (0, 0, tool), frames[-1])],
        dampers=dampers,
        gravity=g,
        outputs=[
            Output("flange", point="flange", quantity="position", doc="centre of the flange"),
            Output("tool", frame=frames[-1], quantity="quaternion", doc="orientation of the flange"),
        ],
        strict_units=True,
    )
