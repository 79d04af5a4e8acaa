"""Small mechanisms with known motions, built from the record's Python interface."""

from sympy import Symbol, cos, sin

from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import (
    Body,
    Damper,
    Definition,
    Energy,
    Load,
    Mechanism,
    Output,
    Point,
    Spring,
    coordinate,
    parameter,
    signal,
)


def pendulum(start: float = 1.0) -> Mechanism:
    """A bob on a massless rod, theta from the downward vertical."""
    m, length, g = parameter("m", 2.0, "kg"), parameter("l", 0.7, "m"), parameter("g", 9.81, "m/s2")
    theta = coordinate("theta", "rad", start=start)
    x, y = length * sin(theta), -length * cos(theta)
    return Mechanism(
        "pendulum",
        coordinates=[theta],
        parameters=[m, length, g],
        bodies=[Body("bob", m, (x, y))],
        gravity=g,
        outputs=[Output("x", x, "m"), Output("y", y, "m")],
    )


def oscillator() -> Mechanism:
    """A mass between a spring and a damper at a wall; mass and damping by a dependent parameter too."""
    m, k, zeta = parameter("m", 2.0, "kg"), parameter("k", 50.0, "N/m"), parameter("zeta", 0.1)
    c = parameter("c", 2 * zeta * (k * m) ** 0.5)
    x = coordinate("x", "m", start=0.3, velocity=-0.2)
    return Mechanism(
        "oscillator",
        coordinates=[x],
        parameters=[m, k, zeta, c],
        bodies=[Body("mass", m, (x, 0))],
        points=[Point("wall", (-1, 0))],
        springs=[Spring("spring", k, between=("wall", "mass"), length=1)],
        dampers=[Damper("damper", c, rate=x.dot)],
    )


def falling(support: object, motions: tuple = ()) -> Mechanism:
    """A mass that hangs on a spring from a support at height ``support``; its only coordinate is the elongation."""
    m, k = parameter("m", 1.5, "kg"), parameter("k", 20.0, "N/m")
    e = coordinate("e", "m", start=0.1)
    return Mechanism(
        "falling",
        coordinates=[e],
        parameters=[m, k],
        inputs=motions,
        bodies=[Body("mass", m, (0, support - e))],
        springs=[Spring("spring", k, elongation=e)],
        gravity=9.81,
    )


def driven_pendulum(motion: bool) -> Mechanism:
    """A pendulum whose support rises by 0.1 sin(5 t), as explicit time or as the motion input y0."""
    y0 = signal("y0", "m", motion=True)
    length, theta = parameter("l", 1.0, "m"), coordinate("theta", "rad", start=0.4)
    height = y0 if motion else sin(5 * TIME) / 10
    return Mechanism(
        "driven_pendulum",
        coordinates=[theta],
        parameters=[length],
        inputs=[y0] if motion else [],
        definitions=[Definition("support", height)],
        bodies=[Body("bob", 1, (length * sin(theta), Symbol("support", real=True) - length * cos(theta)))],
        gravity=9.81,
        energy=Energy(dissipation=theta.dot**2 / 20),
    )


def charged_particle() -> Mechanism:
    """A charge in a uniform magnetic field along z: L = m v^2 / 2 + q B (x y_dot - y x_dot) / 2."""
    m, qB = parameter("m", 0.5, "kg"), parameter("qB", 1.5, "kg/s")
    x, y = coordinate("x", "m", start=1.0), coordinate("y", "m", velocity=2.0)
    lagrangian = m * (x.dot**2 + y.dot**2) / 2 + qB * (x * y.dot - y * x.dot) / 2
    return Mechanism("charged_particle", coordinates=[x, y], parameters=[m, qB], energy=Energy(lagrangian=lagrangian))


def loaded() -> Mechanism:
    """A cart with a pole that has an inertia, springs, dampers, loads, a torque, inputs and a moving wall."""
    M, m, inertia, length = (
        parameter(name, value) for name, value in (("M", 3.0), ("m", 1.2), ("inertia", 0.2), ("l", 0.8))
    )
    w, push, hand = signal("w", "m", motion=True), signal("push", "N", start=0.3), signal("hand", "N.m")
    x, theta = coordinate("x", "m", start=0.2, velocity=0.1), coordinate("theta", "rad", start=0.5, velocity=-0.4)
    centre = (x + length * sin(theta) / 2, length * cos(theta) / 2)
    return Mechanism(
        "loaded",
        coordinates=[x, theta],
        parameters=[M, m, inertia, length],
        inputs=[w, push, hand],
        bodies=[Body("cart", M, (x, 0)), Body("pole", m, centre, angle=-theta, inertia=inertia)],
        points=[
            Point("tip", (x + length * sin(theta), length * cos(theta))),
            Point("wall", (-2 + w, sin(3 * TIME) / 5)),
        ],
        springs=[Spring("s", 30, between=("wall", "tip"), length=1), Spring("z", 5, between=("wall", "cart"))],
        dampers=[Damper("d", 0.7, between=("wall", "tip")), Damper("hinge", 0.1, rate=theta.dot)],
        loads=[
            Load("gust", point="tip", force=(push * cos(theta), -x.dot)),
            Load("motor", body="pole", torque=hand + TIME),
            Load("free", point="cart", input=True),
        ],
        forces={x: -(x.dot**3) / 10},
        gravity=9.81,
        energy=Energy(kinetic=theta.dot**2 * (1 + x**2) / 50, potential=theta**4 / 10 + x * theta.dot / 20),
        outputs=[Output("speed", x.dot + w.dot)],
    )
