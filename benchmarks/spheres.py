"""Spheres in a row on a rough plane, each against the next: a mechanism with any number of contacts."""

from __future__ import annotations

from sympy import Rational

from lag2fmu.mechanism import Contact, Energy, Experiment, Mechanism, coordinate, parameter


def spheres(count: int) -> Mechanism:
    """``count`` spheres that are thrown onto a rough plane and slide until they roll; each may strike the next one.

    A sphere has its centre (m) and the integrals of two angular velocities (rad) as coordinates: with equal moments of
    inertia the energy needs no more. Each has three rows of contact with the plane.
    """
    r, m, mu = parameter("r", 0.05, "m"), parameter("m", 0.5, "kg"), parameter("mu", 0.3, "1")
    g = parameter("g", 9.81, "m/s2")
    coordinates, contacts = [], []
    kinetic = potential = Rational(0)
    for k in range(count):
        x = coordinate(f"x{k}", "m", start=0.11 * k, velocity=1.0 - 0.2 * (k % 3))
        y = coordinate(f"y{k}", "m", velocity=0.5 * (k % 2))
        z = coordinate(f"z{k}", "m", start=0.05)
        a, b = (coordinate(f"{axis}{k}", "rad", velocity=2.0 * (k % 5)) for axis in "ab")
        coordinates += [x, y, z, a, b]
        kinetic += m * (x.dot**2 + y.dot**2 + z.dot**2) / 2 + m * r**2 * (a.dot**2 + b.dot**2) / 5
        potential += m * g * z
        slip = (x.dot - r * b.dot, y.dot + r * a.dot)
        contacts.append(Contact(f"plane{k}", gap=z - r, slip=slip, friction=mu))
        if k > 0:
            before = coordinates[5 * (k - 1)]
            contacts.append(Contact(f"pair{k}", gap=x - before - 2 * r, restitution=Rational(1, 2)))
    return Mechanism(
        f"spheres_{count}",
        coordinates=coordinates,
        parameters=[r, m, mu, g],
        energy=Energy(kinetic=kinetic, potential=potential),
        contacts=contacts,
        experiment=Experiment(stop_time=1.0, step=0.01),
    )
