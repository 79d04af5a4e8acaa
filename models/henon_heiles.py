r"""Henon-Heiles: a particle in the plane, in a potential with the symmetry of a triangle.

::

         \   /           x, y     position
          \ /            m, k     mass, stiffness of the linear part
        ---*---  x       kappa    strength of the cubic part
          / \
         /   \           V = k (x^2 + y^2)/2 + kappa (x^2 y - y^3/3)

Below k^3/(6 kappa^2) of energy the motion is bounded; from about half of that on chaos spreads.

Source: M. Henon, C. Heiles, The Astronomical Journal 69 (1964) 73-79.
"""

from lag2fmu.mechanism import Body, Energy, Mechanism, coordinate, parameter


def henon_heiles() -> Mechanism:
    """The mechanism with x and y as generalized coordinates, at an energy of regular motion (1/20)."""
    m = parameter("m", 1.0, "kg", "mass")
    k = parameter("k", 1.0, "N/m", "stiffness")
    kappa = parameter("kappa", 1.0, "N/m2", "strength of the cubic part")
    x = coordinate("x", "m", start=0.1, nominal=0.1, velocity=0.2, doc="position")
    y = coordinate("y", "m", start=0.2, nominal=0.1, doc="position")

    return Mechanism(
        "henon_heiles",
        title="Henon-Heiles system",
        source="M. Henon, C. Heiles, The Astronomical Journal 69 (1964) 73-79",
        coordinates=[x, y],
        parameters=[m, k, kappa],
        bodies=[Body("star", m, (x, y))],
        energy=Energy(potential=k * (x**2 + y**2) / 2 + kappa * (x**2 * y - y**3 / 3)),
        strict_units=True,
    )
