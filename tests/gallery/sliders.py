"""Problem 5 of the slides for small vibrations: a pendulum on a massless slider between springs, its values in SI."""

from __future__ import annotations

from lag2fmu.mechanism import Energy, Mechanism, coordinate, parameter, signal

m, l, k, g, c = 1.0, 0.5, 100.0, 9.81, 10.0  # noqa: E741


def with_friction(friction: bool = True) -> Mechanism:
    """Small vibrations, with a damper c on the massless slider."""
    x, phi = coordinate("x", "m", nominal=0.1), coordinate("phi", "rad", start=0.1)
    F = signal("F", "N")
    mass, rod = parameter("m", m, "kg"), parameter("l", l, "m")
    return Mechanism(
        "rubbed_slider",
        coordinates=[x, phi],
        parameters=[mass, rod],
        inputs=[F],
        energy=Energy(
            kinetic=mass * (x.dot + rod * phi.dot) ** 2 / 2,
            potential=k * x**2 + mass * g * rod * phi**2 / 2,
            dissipation=c * x.dot**2 / 2 if friction else None,
        ),
        forces={x: F, phi: F * rod},
    )
