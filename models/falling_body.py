r"""Falling body: a throw to the north as it is seen from the rotating Earth, and free fall, with their deflections.

::

      z (up)             x, y, z   position to the east, to the north and upwards
      |   o m            Omega     angular velocity of the Earth
      |   :              lat       geographical latitude
      |   v              g         gravity with the centrifugal force, along -z
      +------- x (east)  m         mass

The centrifugal force counts as part of g, the same everywhere: beside it there is the Coriolis force only, exactly.
From the height h the body falls (1/3) g Omega cos(lat) (2 h/g)^(3/2) to the east, to first order in Omega.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 39, problems 1 and 2.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Energy, Experiment, Mechanism, coordinate, parameter


def falling_body() -> Mechanism:
    """The mechanism with x, y and z as generalized coordinates, in the rotating frame."""
    m = parameter("m", 1.0, "kg", "mass of the body")
    g = parameter("g", 9.81, "m/s2", "gravity")
    Omega = parameter("Omega", 7.292115e-5, "rad/s", "angular velocity of the Earth")
    lat = parameter("lat", 45.0, "deg", "geographical latitude")
    x = coordinate("x", "m", nominal=0.01, doc="to the east")
    y = coordinate("y", "m", velocity=5.0, doc="to the north")
    z = coordinate("z", "m", start=100.0, doc="height")

    w_y, w_z = Omega * cos(lat), Omega * sin(lat)
    v_x, v_y, v_z = x.dot + w_y * z - w_z * y, y.dot + w_z * x, z.dot - w_y * x
    # what the square of the velocity brings of the second order in Omega is part of g already
    centrifugal = m * ((w_y * z - w_z * y) ** 2 + (w_y**2 + w_z**2) * x**2) / 2

    return Mechanism(
        "falling_body",
        title="Throw and fall on the rotating Earth",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 39, problems 1 and 2",
        coordinates=[x, y, z],
        parameters=[m, g, Omega, lat],
        energy=Energy(kinetic=m * (v_x**2 + v_y**2 + v_z**2) / 2, potential=m * g * z + centrifugal),
        experiment=Experiment(stop_time=4.5, step=0.01),
        strict_units=True,
    )
