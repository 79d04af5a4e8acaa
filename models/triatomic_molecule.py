r"""Linear triatomic molecule ABA: three atoms on a line, the middle one bound to both others.

::

      (A)--/\/\--(B)--/\/\--(A)      x1, x2, x3   displacements from rest along the line
       mA    k    mB    k    mA      mA, mB, k    masses of the atoms, stiffness of the bonds

Longitudinal frequencies: sqrt(k/mA) of the symmetrical vibration, sqrt(k (2 mA + mB)/(mA mB)) of the other one; the
molecule as a whole goes straight on.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 24, problem 1.
"""

from lag2fmu.mechanism import Body, Mechanism, Spring, coordinate, parameter


def triatomic_molecule() -> Mechanism:
    """The mechanism with the three displacements as generalized coordinates (in units of one's choice)."""
    mA = parameter("mA", 1.0, "kg", "mass of an outer atom")
    mB = parameter("mB", 0.75, "kg", "mass of the middle atom")
    k = parameter("k", 10.0, "N/m", "stiffness of a bond")
    x1 = coordinate("x1", "m", start=0.1, nominal=0.1, doc="displacement of the left atom")
    x2 = coordinate("x2", "m", start=0.05, nominal=0.1, doc="displacement of the middle atom")
    x3 = coordinate("x3", "m", start=-0.05, nominal=0.1, doc="displacement of the right atom")

    return Mechanism(
        "triatomic_molecule",
        title="Linear triatomic molecule",
        source="L. D. Landau, E. M. Lifshitz, Mechanics, section 24, problem 1",
        coordinates=[x1, x2, x3],
        parameters=[mA, mB, k],
        bodies=[Body("left", mA, (x1, 0)), Body("middle", mB, (x2, 0)), Body("right", mA, (x3, 0))],
        springs=[Spring("bond1", k, elongation=x2 - x1), Spring("bond2", k, elongation=x3 - x2)],
        strict_units=True,
    )
