r"""Coupled masses: n equal masses on a line between two walls, with equal springs between neighbours.

::

      |--/\/\--[m]--/\/\--[m]-- ... --[m]--/\/\--|    x1 ... xn   displacements from rest
          k         k                      k          m, k        mass and stiffness, each

The normal frequencies are 2 sqrt(k/m) sin(j pi/(2 (n + 1))), j = 1 ... n.

Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 23; A. L. Fetter, J. D. Walecka, Theoretical Mechanics of
Particles and Continua, chapter 4.
"""

from lag2fmu.mechanism import Body, Mechanism, Spring, coordinate, parameter


def coupled_masses(n: int = 3) -> Mechanism:
    """The line of ``n`` masses; the first one starts out of its place."""
    if not 1 <= n <= 200:
        raise ValueError(f"n = {n} masses; give 1 to 200")
    m = parameter("m", 1.0, "kg", "mass of each body")
    k = parameter("k", 10.0, "N/m", "stiffness of each spring")
    x = [
        coordinate(f"x{i}", "m", start=0.1 if i == 1 else 0.0, nominal=0.1, doc=f"displacement of body {i}")
        for i in range(1, n + 1)
    ]
    ends = [0, *x, 0]

    return Mechanism(
        "coupled_masses",
        title=f"{n} coupled masses",
        source="A. L. Fetter, J. D. Walecka, Theoretical Mechanics of Particles and Continua, chapter 4",
        coordinates=x,
        parameters=[m, k],
        bodies=[Body(f"body{i}", m, (q, 0)) for i, q in enumerate(x, start=1)],
        springs=[Spring(f"spring{i}", k, elongation=ends[i + 1] - ends[i]) for i in range(n + 1)],
        strict_units=True,
    )
