r"""Rutherford scattering: particles fly past a fixed centre that repels them by U = alpha/r.

::

      y |                . o ->       x, y    position of the particle, from the centre
        |             .    \ chi      m       mass
        |  o --> v . . . . . .        v, b    velocity from afar and impact parameter (at the start: x_dot and y)
        |         b                   alpha   strength of the repulsion
        +-------- * -------- x        chi     angle of deflection

The path is a hyperbola with b = alpha/(m v^2) cot(chi/2), and the effective cross-section is
d sigma/d Omega = (alpha/(2 m v^2))^2/sin(chi/2)^4: Rutherford's formula.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, sections 18 and 19.
"""

from sympy import sqrt

from lag2fmu.mechanism import Body, Energy, Experiment, Mechanism, coordinate, parameter


def rutherford_scattering() -> Mechanism:
    """The mechanism with x and y as generalized coordinates, which stay exact where the particle is far away."""
    m = parameter("m", 1.0, "kg", "mass of the particle")
    alpha = parameter("alpha", 4.0, "N.m2", "strength of the repulsion")
    x = coordinate("x", "m", start=-5.0, velocity=2.0, doc="position along the beam")
    y = coordinate("y", "m", start=0.8, doc="position across the beam")

    return Mechanism(
        "rutherford_scattering",
        title="Rutherford scattering",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 19",
        coordinates=[x, y],
        parameters=[m, alpha],
        bodies=[Body("particle", m, (x, y))],
        energy=Energy(potential=alpha / sqrt(x**2 + y**2)),
        experiment=Experiment(stop_time=8.0),
        strict_units=True,
    )
