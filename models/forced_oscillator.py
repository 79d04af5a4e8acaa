r"""Forced oscillator: a mass on a spring, with friction, driven by a periodic force.

::

      |--/\/\/\--+-----+                     x           displacement from rest
      |  k, beta |  m  |---> F0 cos(Omega t) m, k, c     mass, stiffness, friction
      |----[|----+-----+                     F0, Omega   amplitude and frequency of the force
      |    c       o o                       beta        strength of the cubic part of the spring's force
    =========================

With beta = 0 the oscillation settles at the amplitude F0/(m sqrt((w0^2 - Omega^2)^2 + (2 lambda Omega)^2)), where
w0^2 = k/m and lambda = c/(2 m); without friction it grows as t at Omega = w0. With beta the curve of resonance leans
over: in a range of frequencies there are two stable amplitudes, and the amplitude jumps at the ends of that range.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, sections 22, 25, 26 and 29.
"""

from sympy import cos

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Damper, Energy, Experiment, Mechanism, coordinate, parameter


def forced_oscillator() -> Mechanism:
    """The mechanism with x: m x_ddot + c x_dot + k x + beta x^3 = F0 cos(Omega t)."""
    m = parameter("m", 1.0, "kg", "mass")
    k = parameter("k", 4.0, "N/m", "stiffness of the spring")
    c = parameter("c", 0.4, "N.s/m", "friction")
    beta = parameter("beta", 0.0, "N/m3", "strength of the cubic part")
    F0 = parameter("F0", 1.0, "N", "amplitude of the force")
    Omega = parameter("Omega", 1.5, "rad/s", "angular frequency of the force")
    x = coordinate("x", "m", doc="displacement from rest")

    return Mechanism(
        "forced_oscillator",
        title="Forced oscillator with friction",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, sections 22, 26 and 29",
        coordinates=[x],
        parameters=[m, k, c, beta, F0, Omega],
        bodies=[Body("body", m, (x, 0))],
        energy=Energy(potential=k * x**2 / 2 + beta * x**4 / 4),
        dampers=[Damper("friction", c, rate=x.dot)],
        forces={x: F0 * cos(Omega * t)},
        experiment=Experiment(stop_time=20.0, step=0.02),
        strict_units=True,
    )
