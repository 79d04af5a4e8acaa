r"""Potential well: a particle on a line in the field U = -U0/cosh(x/a)^2.

::

      U |                         x     position
      --+--------------- x        m     mass
         \             /          U0    depth of the well
          `-.  o m  .-'           a     width of the well
             `-...-'

For E < 0 the particle swings with the period 2 pi a sqrt(m/(2 |E|)), sinh(x/a) being a sine of time. From the period
as a function of the energy the potential can be found again.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 11, problem 2b, and section 12.
"""

from sympy import cosh

from lag2fmu.mechanism import Body, Energy, Mechanism, coordinate, parameter


def potential_well() -> Mechanism:
    """The mechanism with x as generalized coordinate; it starts in the middle of the well."""
    m = parameter("m", 1.0, "kg", "mass")
    U0 = parameter("U0", 2.0, "J", "depth of the well")
    a = parameter("a", 0.5, "m", "width of the well")
    x = coordinate("x", "m", velocity=1.5, doc="position, from the middle of the well")

    return Mechanism(
        "potential_well",
        title="Particle in a potential well",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 11, problem 2b",
        coordinates=[x],
        parameters=[m, U0, a],
        bodies=[Body("particle", m, (x, 0))],
        energy=Energy(potential=-U0 / cosh(x / a) ** 2),
        strict_units=True,
    )
