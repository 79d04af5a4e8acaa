r"""Kepler's problem: a particle in the field U = -alpha/r + beta/r^2 of a fixed centre.

::

                 o m       r, phi   polar coordinates of the particle
              r /          alpha    strength of the attraction (gamma M m for gravity)
               / phi       beta     strength of the disturbance; 0: Kepler's problem, with closed orbits
      centre  *------- x   m        mass

With beta the ellipse turns: the perihelion advances by 2 pi (1/sqrt(1 + 2 m beta/p_phi^2) - 1) a revolution.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 15, with problem 3.
"""

from sympy import cos, sin

from lag2fmu.mechanism import Body, Energy, Mechanism, Output, coordinate, parameter


def kepler() -> Mechanism:
    """The mechanism with r and phi as generalized coordinates; it starts at the perihelion of an ellipse."""
    m = parameter("m", 1.0, "kg", "mass of the particle")
    alpha = parameter("alpha", 1.0, "N.m2", "strength of the attraction")
    beta = parameter("beta", 0.0, "N.m3", "strength of the disturbance")
    r = coordinate("r", "m", start=0.5, doc="distance from the centre")
    phi = coordinate("phi", "rad", velocity=3.4, doc="polar angle")

    x, y = r * cos(phi), r * sin(phi)

    return Mechanism(
        "kepler",
        title="Kepler's problem",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 15",
        coordinates=[r, phi],
        parameters=[m, alpha, beta],
        bodies=[Body("planet", m, (x, y))],
        energy=Energy(potential=-alpha / r + beta / r**2),
        outputs=[Output("x", x, "m", "particle"), Output("y", y, "m", "particle")],
        strict_units=True,
    )
