r"""Anharmonic oscillator: a mass on a spring whose force has a cubic part.

::

      |--/\/\/\--[ m ]---> x      x      displacement from rest
          k, beta                 m, k   mass, stiffness of the linear part
                                  beta   strength of the cubic part, V = k x^2/2 + beta x^4/4

The frequency grows with the amplitude a: by 3 beta a^2/(8 m omega_0) to first order.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 28.
"""

from lag2fmu.mechanism import Body, Energy, Mechanism, coordinate, parameter


def anharmonic_oscillator() -> Mechanism:
    """The mechanism with x as generalized coordinate: m x_ddot + k x + beta x^3 = 0."""
    m = parameter("m", 1.0, "kg", "mass")
    k = parameter("k", 4.0, "N/m", "stiffness of the linear part")
    beta = parameter("beta", 3.0, "N/m3", "strength of the cubic part")
    x = coordinate("x", "m", start=1.0, doc="displacement from rest")

    return Mechanism(
        "anharmonic_oscillator",
        title="Anharmonic oscillator",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 28",
        coordinates=[x],
        parameters=[m, k, beta],
        bodies=[Body("body", m, (x, 0))],
        energy=Energy(potential=k * x**2 / 2 + beta * x**4 / 4),
        strict_units=True,
    )
