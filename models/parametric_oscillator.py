r"""Parametric oscillator: the stiffness of the spring changes periodically with time.

::

      |--/\/\/\--[ m ]---> x     x          displacement from rest
       k (1 + h cos(gamma t))    m, k       mass, mean stiffness
                                 h, gamma   depth and frequency of its change
                                 c          friction

Rest is unstable where gamma is near 2 w0/n, w0^2 = k/m. About gamma = 2 w0 + epsilon small oscillations grow as
exp(s t), s^2 = ((h w0/2)^2 - epsilon^2)/4 to first order; friction takes off c/(2 m).

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 27.
"""

from sympy import cos

from lag2fmu.language.expressions import TIME as t
from lag2fmu.mechanism import Body, Damper, Energy, Mechanism, coordinate, parameter


def parametric_oscillator() -> Mechanism:
    """The mechanism with x: m x_ddot + c x_dot + k (1 + h cos(gamma t)) x = 0, Mathieu's equation for c = 0."""
    m = parameter("m", 1.0, "kg", "mass")
    k = parameter("k", 4.0, "N/m", "mean stiffness")
    h = parameter("h", 0.3, "1", "depth of the change of stiffness")
    gamma = parameter("gamma", 4.0, "rad/s", "angular frequency of the change")
    c = parameter("c", 0.0, "N.s/m", "friction")
    x = coordinate("x", "m", start=0.1, nominal=0.1, doc="displacement from rest")

    return Mechanism(
        "parametric_oscillator",
        title="Parametric oscillator",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 27",
        coordinates=[x],
        parameters=[m, k, h, gamma, c],
        bodies=[Body("body", m, (x, 0))],
        energy=Energy(potential=k * (1 + h * cos(gamma * t)) * x**2 / 2),
        dampers=[Damper("friction", c, rate=x.dot)],
        strict_units=True,
    )
