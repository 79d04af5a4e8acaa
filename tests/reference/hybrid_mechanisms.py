"""Small mechanisms with contacts, stops and dry friction whose motions are known in closed form."""

import numpy as np
import sympy as sp
from sympy import cos, sin

from lag2fmu.description.events import Contact, Friction, Stop
from lag2fmu.language.expressions import TIME
from lag2fmu.mechanism import Body, Constraint, Energy, Mechanism, Spring, coordinate, parameter

G = sp.Rational(981, 100)


def ball(restitution: object = sp.Rational(4, 5)) -> Mechanism:
    """A ball dropped from 1 m."""
    y = coordinate("y", "m", start=1.0)
    floor = Contact("floor", gap=y, restitution=restitution)
    return Mechanism("ball", coordinates=[y], bodies=[Body("ball", 1, (0, y))], gravity=G, contacts=[floor])


def cradle(impacts: str) -> Mechanism:
    """Three equal balls on a line, the first one coming at 1 m/s."""
    a, b, c = (coordinate(f"x{i}", "m", start=float(i) - (i == 0), velocity=float(i == 0)) for i in range(3))
    return Mechanism(
        "cradle",
        impacts=impacts,
        coordinates=[a, b, c],
        bodies=[Body(f"ball{i}", 1, (x, 0)) for i, x in enumerate((a, b, c))],
        contacts=[Contact("first", gap=b - a - 1, restitution=1), Contact("second", gap=c - b - 1, restitution=1)],
    )


def coulomb_oscillator() -> Mechanism:
    """A mass on a spring with Coulomb friction, pulled out by 5 m."""
    x = coordinate("x", "m", start=5.0)
    return Mechanism(
        "coulomb_oscillator",
        coordinates=[x],
        bodies=[Body("block", 1, (x, 0))],
        springs=[Spring("spring", 1, elongation=x)],
        frictions=[Friction("ground", on=x.dot, force=sp.Rational(3, 10))],
    )


def belt() -> Mechanism:
    """A mass on a spring and on a belt of 0.2 m/s, with more static than sliding friction, that sticks to it."""
    x = coordinate("x", "m", velocity=0.2)
    return Mechanism(
        "belt",
        coordinates=[x],
        bodies=[Body("block", 1, (x, 0))],
        springs=[Spring("spring", 1, elongation=x)],
        frictions=[Friction("belt", on=x.dot - sp.Rational(1, 5), force=sp.Rational(1, 2), static=1)],
    )


def clutch() -> Mechanism:
    """Two discs, one of them turning at 100 rad/s, pressed together."""
    a, b = coordinate("a", "rad", velocity=100.0), coordinate("b", "rad")
    return Mechanism(
        "clutch",
        coordinates=[a, b],
        energy=Energy(kinetic=a.dot**2 / 2 + b.dot**2),
        frictions=[Friction("plates", on=a.dot - b.dot, force=10)],
    )


def sliding_sphere(direction: float) -> Mechanism:
    """A sphere thrown at 5 m/s over a plane without turning, in a ``direction`` (rad); x, y in the plane."""
    r, J = sp.Rational(1, 10), sp.Rational(2, 500)
    x = coordinate("x", "m", velocity=float(5 * np.cos(direction)))
    y = coordinate("y", "m", velocity=float(5 * np.sin(direction)))
    z, a, b = coordinate("z", "m", start=0.1), coordinate("a", "rad"), coordinate("b", "rad")
    kinetic = (x.dot**2 + y.dot**2 + z.dot**2) / 2 + J * (a.dot**2 + b.dot**2) / 2
    slip = (x.dot - r * a.dot, y.dot - r * b.dot)
    return Mechanism(
        "sliding_sphere",
        coordinates=[x, y, z, a, b],
        energy=Energy(kinetic=kinetic, potential=G * z),
        contacts=[Contact("plane", gap=z - r, slip=slip, friction=sp.Rational(1, 5))],
    )


def two_balls() -> Mechanism:
    """A ball of 9 kg with one of 1 kg upon it, dropped from 1 m."""
    a, b = coordinate("a", "m", start=1.0), coordinate("b", "m", start=1.0)
    return Mechanism(
        "two_balls",
        coordinates=[a, b],
        bodies=[Body("lower", 9, (0, a)), Body("upper", 1, (0, b))],
        gravity=G,
        contacts=[Contact("floor", gap=a, restitution=1), Contact("balls", gap=b - a, restitution=1)],
    )


def incline(friction: object, start: float = 0.0) -> Mechanism:
    """A block on a plane of 30 degrees; x down the plane, y out of it."""
    x, y = coordinate("x", "m", velocity=start), coordinate("y", "m")
    return Mechanism(
        "incline",
        coordinates=[x, y],
        energy=Energy(kinetic=(x.dot**2 + y.dot**2) / 2, potential=G * (y * cos(sp.pi / 6) - x * sin(sp.pi / 6))),
        contacts=[Contact("plane", gap=y, slip=x.dot, friction=friction)],
    )


def stopped_pendulum() -> Mechanism:
    """A pendulum of 1 m with a stop at -0.5 rad, e = 0.5, let go at 1 rad."""
    theta = coordinate("theta", "rad", start=1.0)
    return Mechanism(
        "stopped_pendulum",
        coordinates=[theta],
        bodies=[Body("bob", 1, (sin(theta), -cos(theta)))],
        gravity=G,
        stops=[Stop("hinge", of=theta, lower=-sp.Rational(1, 2), restitution=sp.Rational(1, 2))],
    )


def blocks_and_wall(ratio: int) -> Mechanism:
    """A block of ``ratio`` kg that comes at 1 m/s to one of 1 kg before a wall; e = 1."""
    a, b = coordinate("a", "m", start=1.0), coordinate("b", "m", start=2.0, velocity=-1.0)
    return Mechanism(
        "blocks_and_wall",
        coordinates=[a, b],
        bodies=[Body("light", 1, (a, 0)), Body("heavy", ratio, (b, 0))],
        contacts=[Contact("wall", gap=a, restitution=1), Contact("blocks", gap=b - a, restitution=1)],
    )


def falling_rod(friction: float, angle: float) -> Mechanism:
    """A rod of 1 kg and 2 m whose lower end slides on the ground at 1 m/s; ``angle`` (rad) is over the ground."""
    theta = coordinate("theta", "rad", start=angle)
    x = coordinate("x", "m", velocity=1.0)
    y = coordinate("y", "m", start=float(np.sin(angle)))
    gap = y - sin(theta)
    slip = x.dot - sin(theta) * theta.dot  # of the end at (x + cos theta, y - sin theta) in front of the centre
    return Mechanism(
        "falling_rod",
        coordinates=[x, y, theta],
        bodies=[Body("rod", 1, (x, y), angle=theta, inertia=sp.Rational(1, 3))],
        gravity=G,
        contacts=[Contact("tip", gap=gap, slip=slip, friction=friction)],
    )


def double_pendulum_on_floor(friction: float) -> Mechanism:
    """Kane's example: a double pendulum whose end strikes the floor with friction, e = 0.5."""
    a0, b0 = np.radians([20.0, 30.0])
    a, b = (
        coordinate("a", "rad", start=float(a0), velocity=-0.1),
        coordinate("b", "rad", start=float(b0), velocity=-0.2),
    )
    floor = parameter("floor_depth", float(np.cos(a0) + np.cos(b0)), "m")
    J = sp.Rational(1, 12)
    return Mechanism(
        "double_pendulum_on_floor",
        coordinates=[a, b],
        parameters=[floor],
        bodies=[
            Body("upper", 1, (sin(a) / 2, -cos(a) / 2), angle=a, inertia=J),
            Body("lower", 1, (sin(a) + sin(b) / 2, -cos(a) - cos(b) / 2), angle=b, inertia=J),
        ],
        gravity=G,
        contacts=[
            Contact(
                "end",
                gap=floor - cos(a) - cos(b),
                slip=cos(a) * a.dot + cos(b) * b.dot,
                restitution=sp.Rational(1, 2),
                friction=friction,
            )
        ],
    )


def loaded_slider(slope: object, friction: object) -> Mechanism:
    """A bead of 1 kg thrown at 2 m/s up a straight guide y = slope x; what the guide bears makes its friction."""
    k = sp.sympify(slope)
    x, y = coordinate("x", "m", velocity=2.0), coordinate("y", "m", velocity=float(2 * k))
    borne = sp.Symbol("multiplier_guide", real=True)
    return Mechanism(
        "loaded_slider",
        coordinates=[x, y],
        bodies=[Body("bead", 1, (x, y))],
        gravity=G,
        constraints=[Constraint("guide", y - k * x)],
        frictions=[Friction("rail", on=x.dot, force=friction * abs(borne))],
    )


def gripper() -> Mechanism:
    """A carriage of 1 kg at 1 m/s that takes a resting one of 3 kg from 1 s to 2 s."""
    a, b = coordinate("a", "m", velocity=1.0), coordinate("b", "m")
    return Mechanism(
        "gripper",
        coordinates=[a, b],
        bodies=[Body("hand", 1, (a, 0)), Body("piece", 3, (b, 0))],
        constraints=[Constraint("grip", a.dot - b.dot, kind="nonholonomic", while_=(TIME - 1) * (2 - TIME))],
    )


def wedge() -> Mechanism:
    """The billiard in a flat wedge, which is chaotic: H. E. Lehtihet, B. N. Miller, Physica D 21 (1986), pp. 93-104."""
    x, y = coordinate("x", "m", start=0.1, velocity=0.3), coordinate("y", "m", start=1.0)
    walls = [Contact("left", gap=y + x / 2, restitution=1), Contact("right", gap=y - x / 2, restitution=1)]
    return Mechanism("wedge", coordinates=[x, y], bodies=[Body("ball", 1, (x, y))], contacts=walls, gravity=9.81)
