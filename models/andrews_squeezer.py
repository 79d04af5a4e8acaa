r"""Andrews' squeezing mechanism: seven links in the plane, driven by a motor, held by a spring; over in 0.03 s.

::

        C ~~~ D___ K3         O        motor: crank K1 (O F) turns by beta
               \  / |         Theta    angle of K2 (F E) against the crank
        K7  H---E   B         gamma    angle of the triangle K3, B D E; a spring holds D to C
      K6 \ / /  |             Phi      angle of K4 (G E) against K5
          G -K4 F--O  mom     delta    angle of K5 (A G)
         K5  \ /  K1          Omega    angle of K6 (H E) against K7
              A               epsilon  angle of K7 (A H)

Three loops close in E: over B, over G and over H, six equations for seven angles. Velocities reach 1400 rad/s.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.7; Test Set for Initial Value
Problem Solvers (CWI, Amsterdam), Andrews' squeezing mechanism. Letters and values are those of the sources.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Constraint, Experiment, Mechanism, Point, Spring, coordinate, parameter

LENGTHS = {
    "d": 0.028, "da": 0.0115, "e": 0.02, "ea": 0.01421, "zf": 0.02, "zt": 0.04, "fa": 0.01421, "rr": 0.007,
    "ra": 0.00092, "ss": 0.035, "sa": 0.01874, "sb": 0.01043, "sc": 0.018, "sd": 0.02, "ta": 0.02308, "tb": 0.00916,
    "u": 0.04, "ua": 0.01228, "ub": 0.00449, "xa": -0.06934, "ya": -0.00227, "xb": -0.03635, "yb": 0.03273,
    "xc": 0.014, "yc": 0.072, "l0": 0.07785,
}  # fmt: skip
MASSES = (0.04325, 0.00365, 0.02373, 0.00706, 0.0705, 0.00706, 0.05498)
INERTIAS = (2.194e-6, 4.41e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
GUESSES = {"beta": -0.06, "gamma": 0.46, "Phi": 0.22, "delta": 0.49, "Omega": -0.22, "epsilon": 1.23}


def andrews_squeezer() -> Mechanism:
    """The mechanism with the seven angles of the sources as coordinates."""
    size = {
        name: parameter(name, value, "m", f"length {name} in the figure of the source")
        for name, value in LENGTHS.items()
    }
    d, da, e, ea, zf, zt, fa, rr, ra, ss, sa, sb, sc, sd, ta, tb, u, ua, ub, xa, ya, xb, yb, xc, yc, l0 = size.values()
    m = [parameter(f"m{i}", value, "kg", f"mass of link {i}") for i, value in enumerate(MASSES, 1)]
    I = [parameter(f"I{i}", value, "kg.m2", f"moment of inertia of link {i}") for i, value in enumerate(INERTIAS, 1)]  # noqa: E741
    c0 = parameter("c0", 4530.0, "N/m", "stiffness of the spring")
    mom = parameter("mom", 0.033, "N.m", "torque of the motor")
    beta, gamma, Phi, delta, Omega, epsilon = (
        coordinate(name, "rad", guess=value, doc=f"angle {name}") for name, value in GUESSES.items()
    )
    Theta = coordinate("Theta", "rad", start=0.0, velocity=0.0, doc="angle Theta")
    bT, Pd, Oe = beta + Theta, Phi + delta, Omega + epsilon

    places = [  # mass centre and angle of each link
        (ra * cos(beta), ra * sin(beta), beta),
        (rr * cos(beta) - da * cos(bT), rr * sin(beta) - da * sin(bT), bT),
        (xb + sa * sin(gamma) + sb * cos(gamma), yb - sa * cos(gamma) + sb * sin(gamma), gamma),
        (xa + zt * cos(delta) + (e - ea) * sin(Pd), ya + zt * sin(delta) - (e - ea) * cos(Pd), Pd),
        (xa + ta * cos(delta) - tb * sin(delta), ya + ta * sin(delta) + tb * cos(delta), delta),
        (xa + u * sin(epsilon) + (zf - fa) * cos(Oe), ya - u * cos(epsilon) + (zf - fa) * sin(Oe), Oe),
        (xa + ua * sin(epsilon) - ub * cos(epsilon), ya - ua * cos(epsilon) - ub * sin(epsilon), epsilon),
    ]
    D = xb + sc * sin(gamma) + sd * cos(gamma), yb - sc * cos(gamma) + sd * sin(gamma)
    E = rr * cos(beta) - d * cos(bT), rr * sin(beta) - d * sin(bT)
    loops = {
        "B": (xb + ss * sin(gamma), yb - ss * cos(gamma)),
        "G": (xa + zt * cos(delta) + e * sin(Pd), ya + zt * sin(delta) - e * cos(Pd)),
        "H": (xa + u * sin(epsilon) + zf * cos(Oe), ya - u * cos(epsilon) + zf * sin(Oe)),
    }
    return Mechanism(
        "andrews_squeezer",
        title="Andrews' squeezing mechanism",
        source="Test Set for Initial Value Problem Solvers, CWI, Andrews' squeezing mechanism",
        coordinates=[beta, Theta, gamma, Phi, delta, Omega, epsilon],
        parameters=[*size.values(), *m, *I, c0, mom],
        bodies=[Body(f"K{i + 1}", m[i], (x, y), angle=angle, inertia=I[i]) for i, (x, y, angle) in enumerate(places)],
        points=[Point("C", (xc, yc)), Point("D", D)],
        springs=[Spring("spring", c0, between=("C", "D"), length=l0)],
        forces={beta: mom},
        constraints=[Constraint(f"{k}_{s}", E[i] - p[i]) for k, p in loops.items() for i, s in enumerate("xy")],
        experiment=Experiment(stop_time=0.0075, step=0.00005),
        strict_units=True,
    )
