r"""Three bodies: particles of equal mass in the plane that attract each other, on a path of the form of an eight.

::

          o 1          x1 ... y3   positions of the particles
         . .           m           mass of each
        .   .          G           constant of gravitation
     3 o . . o 2

Source: A. Chenciner, R. Montgomery, Annals of Mathematics 152 (2000) 881-901; the start values (C. Simo) stand there,
with the period 6.32591398.
"""

from sympy import sqrt

from lag2fmu.mechanism import Body, Energy, Experiment, Mechanism, coordinate, parameter

X, Y = 0.97000436, -0.24308753
U, V = -0.93240737, -0.86473146


def three_bodies() -> Mechanism:
    """The mechanism with the Cartesian coordinates of the three particles."""
    m = parameter("m", 1.0, "kg", "mass of each particle")
    G = parameter("G", 1.0, "m3/(kg.s2)", "constant of gravitation")
    starts = [(X, Y, -U / 2, -V / 2), (-X, -Y, -U / 2, -V / 2), (0.0, 0.0, U, V)]
    places = [
        (
            coordinate(f"x{i}", "m", start=x, velocity=u, doc=f"particle {i}"),
            coordinate(f"y{i}", "m", start=y, velocity=v, doc=f"particle {i}"),
        )
        for i, (x, y, u, v) in enumerate(starts, start=1)
    ]

    pairs = [(places[i], places[j]) for i in range(3) for j in range(i)]
    potential = sum(-G * m**2 / sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) for a, b in pairs)

    return Mechanism(
        "three_bodies",
        title="Three bodies on a path of the form of an eight",
        source="A. Chenciner, R. Montgomery, Annals of Mathematics 152 (2000) 881-901",
        coordinates=[q for place in places for q in place],
        parameters=[m, G],
        bodies=[Body(f"particle{i}", m, place) for i, place in enumerate(places, start=1)],
        energy=Energy(potential=potential),
        experiment=Experiment(stop_time=6.3, step=0.01),
        strict_units=True,
    )
