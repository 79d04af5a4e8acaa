r"""Wilberforce pendulum: a body on a helical spring that goes up and down and twists, in turn.

::

      =====
        \\            z        elongation from rest, upwards
        //            theta    twist from rest
        \\            m, I     mass and inertia of the body about the vertical
       [##] | z       k, delta stiffness against elongation and against twist
       theta          epsilon  coupling of both, by the spring

At sqrt(k/m) = sqrt(delta/I) all energy goes to and fro, with the beat frequency epsilon/(2 sqrt(delta m)) about.

Source: R. E. Berg, T. S. Marshall, American Journal of Physics 59 (1991) 32-38; values: of the size of their
apparatus, in exact resonance, chosen.
"""

from lag2fmu.mechanism import Energy, Experiment, Mechanism, coordinate, parameter


def wilberforce_pendulum() -> Mechanism:
    """The mechanism with z and theta as generalized coordinates."""
    m = parameter("m", 0.5, "kg", "mass of the body")
    I = parameter("I", 1.4e-4, "kg.m2", "inertia of the body about the vertical")  # noqa: E741
    k = parameter("k", 2.75, "N/m", "stiffness against elongation")
    delta = parameter("delta", 7.7e-4, "N.m/rad", "stiffness against twist")
    epsilon = parameter("epsilon", 9.3e-3, "N/rad", "coupling")
    z = coordinate("z", "m", start=0.1, nominal=0.1, doc="elongation from rest, upwards")
    theta = coordinate("theta", "rad", doc="twist from rest")

    return Mechanism(
        "wilberforce_pendulum",
        title="Wilberforce pendulum",
        source="R. E. Berg, T. S. Marshall, American Journal of Physics 59 (1991) 32-38",
        coordinates=[z, theta],
        parameters=[m, I, k, delta, epsilon],
        energy=Energy(
            kinetic=m * z.dot**2 / 2 + I * theta.dot**2 / 2,
            potential=k * z**2 / 2 + delta * theta**2 / 2 + epsilon * z * theta / 2,
        ),
        experiment=Experiment(stop_time=40.0, step=0.05),
        strict_units=True,
    )
