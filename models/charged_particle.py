r"""Charged particle in uniform fields: a magnetic field along z and an electric field along y.

::

      z | B              x, y, z   position
        |                q, m      charge and mass
        |__ y  E         B, E      magnetic flux density, electric field strength
       /
      x                  L = m v^2/2 + q A.v + q E y with A = (-y, x, 0) B/2

It turns with the cyclotron frequency q B/m about a centre that drifts along x with E/B.

Source: L. D. Landau, E. M. Lifshitz, The Classical Theory of Fields, sections 21 and 22.
"""

from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter


def charged_particle() -> Mechanism:
    """The mechanism with x, y and z as generalized coordinates."""
    m = parameter("m", 1.0, "kg", "mass")
    q = parameter("q", 1.0, "C", "charge")
    B = parameter("B", 2.0, "T", "magnetic flux density, along z")
    E = parameter("E", 0.5, "V/m", "electric field strength, along y")
    x = coordinate("x", "m", velocity=1.0, doc="position")
    y = coordinate("y", "m", doc="position")
    z = coordinate("z", "m", velocity=0.2, doc="position, along the magnetic field")

    kinetic = m * (x.dot**2 + y.dot**2 + z.dot**2) / 2
    field = q * B * (x * y.dot - y * x.dot) / 2 + q * E * y

    return Mechanism(
        "charged_particle",
        title="Charged particle in crossed fields",
        source="L. D. Landau, E. M. Lifshitz, The Classical Theory of Fields, sections 21 and 22",
        coordinates=[x, y, z],
        parameters=[m, q, B, E],
        energy=Energy(lagrangian=kinetic + field),
        strict_units=True,
    )
