r"""Foucault's pendulum: small oscillations of a pendulum on the rotating Earth, in its horizontal plane.

::

        y (north)          x, y     displacement of the bob to the east and to the north
        |                  omega    angular frequency of the pendulum, sqrt(g/l)
        |  o m             Omega    angular velocity of the frame of reference (Earth)
        | /                lat      geographical latitude
        O------- x (east)  m        mass of the bob

The plane of oscillation turns with the angular velocity -Omega sin(lat). The term of second order in Omega stays as it
comes from the square of the velocity in the inertial frame, so that this is exact.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 39, problem 3.
"""

from sympy import sin

from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter


def foucault_pendulum() -> Mechanism:
    """The mechanism with x and y as generalized coordinates; Omega is exaggerated so that the turning is seen."""
    m = parameter("m", 1.0, "kg", "mass of the bob")
    omega = parameter("omega", 3.0, "rad/s", "angular frequency of the pendulum")
    Omega = parameter("Omega", 0.2, "rad/s", "angular velocity of the Earth, exaggerated")
    lat = parameter("lat", 48.85, "deg", "geographical latitude, of Paris")
    x = coordinate("x", "m", start=0.1, nominal=0.1, doc="displacement to the east")
    y = coordinate("y", "m", nominal=0.1, doc="displacement to the north")

    turning = Omega * sin(lat)
    kinetic = m * ((x.dot - turning * y) ** 2 + (y.dot + turning * x) ** 2) / 2

    return Mechanism(
        "foucault_pendulum",
        title="Foucault's pendulum",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 39, problem 3",
        coordinates=[x, y],
        parameters=[m, omega, Omega, lat],
        energy=Energy(kinetic=kinetic, potential=m * omega**2 * (x**2 + y**2) / 2),
        strict_units=True,
    )
