"""How large a communication step may be when another FMU acts through a port: a force and the displacement along it.

Coupled FMUs that run side by side know each other's outputs at the beginning of a communication step h only. From there
the force of a spring between them is continued as a polynomial: held (degree 0), with its first derivative (1), or with
its second one too (2). Take an oscillation m x'' = -k x with w^2 = k/m, whose force is k times the Taylor polynomial of
x. The exact solution over a step h multiplies (x, x') by a matrix. For the three degrees its determinants are, with
a = (w h)^2,

    1 + a/2,     1 + a^2/12,     1 - a^2/24 + a^3/144.

So the coupling adds to the damping ratio -w h/4, -(w h)^3/24 and +(w h)^3/48. For a held force this means: the force
comes h/2 late, which is a damper of -k h/2. If the coupling is only a share of the stiffness, it adds this share of the
ratio. The error of the motion is of the order degree + 1. With c for what is added:

- One oscillation changes its amplitude by the share 2 pi |c|. This bounds h where accuracy is wanted.
- A motion with the damping ratio z decays as long as c + z > 0. This bounds h for held inputs.

Another kind of port takes a motion y and gives the force F that carries it. A body of mass M on the other side moves by
M y'' = -F, where F = C x + D0 y + D1 y' + D2 y'' contains y'' itself. Each exchange of F and y'' at a communication
point multiplies the error by D2/M. Then y'' = -(C x + D0 y + D1 y')/(M + D2) is continued as a polynomial. The ratios
above hold with the share of an eigenvalue that this feedback moves.

Sources: R. Kuebler, W. Schiehlen, Two methods of simulator coupling, Mathematical and Computer Modelling of Dynamical
Systems 6 (2000), pp. 93-113, for loops of direct feed-through; M. Arnold, C. Clauss, T. Schierz, Error analysis and
error estimates for co-simulation in FMI for Model Exchange and Co-Simulation v2.0, Archive of Mechanical Engineering
60 (2013), pp. 75-94, for the order. The ratios follow from the determinants, by expansion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from math import pi
from typing import NamedTuple

import numpy as np

from lag2fmu.analysis.state_space import Linearization
from lag2fmu.description import names
from lag2fmu.description.symbols import names_of
from lag2fmu.graph.batches import Floats
from lag2fmu.language.units import Unit
from lag2fmu.mechanism.display import display_units

CHANGE = 0.01
"""The share by which the coupling may change the amplitude of one oscillation."""
_FACTORS = ((1, 4.0), (3, 24.0), (3, 48.0))
"""The damping ratio that the coupling adds, for each degree: the power of w h, and its divisor."""
_STIFFER, _SLOW = 4.0, 1e-3
"""How much stiffer than the mechanism the assumed spring is; and the rate (1/s) below which nothing moves by itself."""
_SEEN, _NOTHING = 0.1, 1e-9
"""Modes belong to a port if a spring there moves them by this share of the mode that it moves most; and the share below
which a change is rounding."""
_MOST = 4
"""The most ports that a report looks for; each needs the eigenvalues of a matrix."""


@dataclass(frozen=True)
class Swing:
    """An oscillation of ``frequency`` (rad/s) and ``damping`` ratio; the coupling has a ``share`` of its stiffness."""

    frequency: float
    damping: float
    share: float

    def step(self, degree: int) -> float:
        """The longest communication step (s) with which the amplitude changes by at most CHANGE in one oscillation.

        ``degree``: the order of the derivatives that inputs have, 0 where they are held, 2 at most. The formula stands
        in the module's head.
        """
        power, divisor = _FACTORS[degree]
        return float((divisor * CHANGE / (2 * pi * self.share)) ** (1 / power) / self.frequency)

    @property
    def bound(self) -> float:
        """The communication step (s) from which on the motion grows with held inputs; 0 without damping."""
        return max(0.0, _FACTORS[0][1] * self.damping / (self.share * self.frequency))


@dataclass(frozen=True)
class CouplingPort(Swing):
    """Forces as inputs, the displacement along them as output, and the swing that a spring between them makes.

    ``inertia`` (kg, kg.m2) is the force by the acceleration there, ``stiffness`` (N/m, N.m/rad) that of the assumed
    spring.
    """

    inputs: tuple[str, ...]
    output: str
    inertia: float
    stiffness: float


class Bond(NamedTuple):
    """A ``motion`` as input and the ``force`` that carries it as output, with a body that this force moves.

    ``inertia`` (kg, kg.m2) is the force by the acceleration there, ``mass`` (kg, kg.m2) that of the assumed body.
    ``swing`` is the oscillation of the body, None if there is none.
    """

    motion: str
    force: str
    inertia: float
    mass: float
    swing: Swing | None


def ports(about: Linearization, stiffness: float | None = None) -> Iterator[CouplingPort]:
    """The ports of ``about``; a force of the user stands before the generalized one along the same displacement.

    The spring has the ``stiffness`` (N/m, N.m/rad), by default four times that of the mechanism itself. The latter is
    inertia times the square of the fastest rate there or, where nothing moves by itself, of 1 Hz. Ports without mass
    are left out, because they follow a force at once. Ports that do not swing with the spring are left out too. Source:
    M. Arnold, C. Clauss, T. Schierz, Archive of Mechanical Engineering 60 (2013), pp. 75-94.
    """
    own = Spectrum(about.A)
    yield from filter(None, (_port(about, own, *pair, stiffness) for pair in _pairs(about)))


def _pairs(about: Linearization) -> Iterator[tuple[tuple[str, ...], str]]:
    """The forces that act along a coordinate alone, and the coordinate."""
    by_row: dict[tuple[float, ...], tuple[str, list[str]]] = {}
    rows = dict(zip((q.name for q in about.mechanism.coordinates), np.eye(len(about.mass)), strict=True))
    for name, column in zip(reversed(about.inputs), reversed(about.action.T), strict=True):
        found = next((q for q, row in rows.items() if np.array_equal(row, column)), None)
        if found is not None:
            by_row.setdefault(tuple(column), (found, []))[1].append(name)
    for q in rows:
        for output, inputs in by_row.values():
            if output == q:
                yield tuple(sorted(inputs, key=lambda x: x.startswith("Q_"))), output


def _port(
    about: Linearization, own: Spectrum, inputs: tuple[str, ...], output: str, stiffness: float | None
) -> CouplingPort | None:
    row = about.shape[[q.name for q in about.mechanism.coordinates].index(output)]
    column = about.B[:, about.inputs.index(inputs[0])]
    mobility = float(row @ about.A @ column)
    if not np.isfinite(mobility) or mobility <= _NOTHING * float(np.abs(about.B).max(initial=1e-300)):
        return None
    if stiffness is None:
        rate = abs(own.fastest(row, column)[0])
        stiffness = _STIFFER * (rate if rate > _SLOW else 2 * pi) ** 2 / mobility
    swinging, moved = Spectrum(about.A - stiffness * np.outer(column, row)).fastest(row, column)
    size = abs(swinging)
    if swinging.imag <= _NOTHING * size:
        return None
    swing = (size, _damping(swinging), 2 * stiffness * moved / size)
    return CouplingPort(*swing, inputs, output, 1 / mobility, stiffness)


def _damping(swinging: complex) -> float:
    """The damping ratio of an eigenvalue."""
    size = abs(swinging)
    return 0.0 if abs(swinging.real) <= _NOTHING * size else -swinging.real / size


def bonds(about: Linearization, mass: float | None = None) -> Iterator[Bond]:
    """The prescribed motions of ``about`` whose forces are among its outputs.

    The body on the other side has the ``mass`` (kg, kg.m2), by default four times the inertia that a slow motion has to
    carry, or four times that at once if this is more. Motions that carry no inertia are left out. Filtered motions are
    left out, because they feed nothing back at once. Source: R. Kuebler, W. Schiehlen, Mathematical and Computer
    Modelling of Dynamical Systems 6 (2000), pp. 93-113.
    """
    least = _NOTHING * float(np.abs(about.mass).max(initial=0.0))
    for motion in (u for u in about.mechanism.motions if names.drive(u.name) in about.outputs):
        force = names.drive(motion.name)
        C, D = about.C[about.outputs.index(force)], about.D[about.outputs.index(force)]
        columns = [about.inputs.index(name) for name in names_of(motion)]
        B, D = about.B[:, columns], D[columns]
        inertia = float(D[2]) if abs(D[2]) > least else 0.0
        carried = max(inertia, _slowly(about.A, B[:, 2], C, D[2]))
        if carried > least:
            other = _STIFFER * carried if mass is None else mass
            yield Bond(motion.name, force, inertia, other, _swing(about.A, B, C, D, other))


def _slowly(A: Floats, column: Floats, row: Floats, direct: float) -> float:
    """Force by acceleration when the acceleration lasts and all swings have decayed; 0 if there is no such state."""
    try:
        found = float(direct - row @ np.linalg.solve(A, column))
    except np.linalg.LinAlgError:
        return 0.0
    return found if np.isfinite(found) else 0.0


def _swing(A: Floats, B: Floats, C: Floats, D: Floats, mass: float) -> Swing | None:
    """The swing of a body of this ``mass`` under the force C x + D (y, y', y''); None if it does not swing."""
    k = len(A)
    whole, column = np.zeros((k + 2, k + 2)), np.concatenate([B[:, 2], [0.0, 1.0]])
    whole[:k, :k], whole[:k, k:], whole[k, k + 1] = A, B[:, :2], 1.0
    row = -np.concatenate([C, D[:2]]) / (mass + D[2])
    swinging, moved = Spectrum(whole + np.outer(column, row)).fastest(row, column)
    size = abs(swinging)
    if swinging.imag <= max(_SLOW, _NOTHING * size) or moved <= _NOTHING * size:
        return None
    return Swing(size, _damping(swinging), 2 * moved / size)


class Spectrum:
    """The eigenvalues of a matrix A (k, k), and which of them a spring moves."""

    def __init__(self, A: Floats) -> None:
        self.values, self.right = np.linalg.eig(A)

    def fastest(self, row: Floats, column: Floats) -> tuple[complex, float]:
        """The fastest eigenvalue that a spring at the port of ``row`` and ``column`` (k,) moves, and by how much.

        Its imaginary part is not negative.

        A spring dk moves the eigenvalue of the vectors v and w by -dk (w column)(row v)/(w v).
        """
        try:
            moved = np.abs((row @ self.right) * np.linalg.solve(self.right, column.astype(complex)))
        except np.linalg.LinAlgError:  # a double eigenvalue of one vector, as of what nothing holds
            moved = np.ones(len(self.values))
        least = _SEEN * moved.max(initial=0.0)
        own = [(x, float(m)) for x, m in zip(self.values, moved, strict=True) if m >= least]
        found, by = max(own, key=lambda pair: (round(abs(pair[0].imag), 9), pair[0].imag), default=(0j, 0.0))
        return complex(found.real, abs(found.imag)), by


def sentences(about: Linearization) -> Iterator[str]:
    """Sentences on a coupling through the ports of ``about``; none if it has no port."""
    pairs, own = _pairs(about), Spectrum(about.A)
    found = list(islice(filter(None, (_port(about, own, *pair, None) for pair in pairs)), _MOST))
    carried, units = list(bonds(about)), display_units(about.mechanism)
    if not found and not carried:
        return
    assumed = (
        f" Assumed is a spring across the port, {_STIFFER:g} times as stiff as the mechanism there; s times that makes "
        "the steps shorter by the root of s."
    )
    yield (
        "What another FMU computes from the motion here acts on it late: the error is of order 1 in the communication "
        f"step with held inputs, 2 and 3 with first and second input derivatives.{assumed if found else ''}"
    )
    for port in found:
        unit = _ratio(units.get(port.inputs[0]), units.get(port.output))
        yield (
            f"{', '.join(port.inputs)} and {port.output}: with {f'{port.stiffness:.3g} {unit}'.rstrip()} it swings at "
            f"{_steps(port)}"
        )
    for bond in carried[:_MOST]:
        told = _told(bond, _ratio(units.get(bond.force), units.get(names.acceleration(bond.motion))))
        if told:
            yield f"{bond.motion} and {bond.force}. {told}"
    further = sum(1 for _ in pairs)
    if further:
        yield f"Up to {further} further ports were not looked at."


def _told(bond: Bond, unit: str) -> str:
    """Sentences on a bond: what the other side needs, and how long steps may be; ``unit`` is that of the inertia."""
    found = []
    inertia, mass = (f"{x:.3g} {unit}".rstrip() for x in (bond.inertia, bond.mass))
    if bond.inertia > 0:
        found.append(
            f"The force contains {inertia} times {names.acceleration(bond.motion)}: what it acts on in the other FMU "
            "needs more than that, else each exchange makes the error larger."
        )
    if bond.swing is not None:
        found.append(f"With {mass} on the other side it swings at {_steps(bond.swing)}")
    return " ".join(found)


def _steps(swing: Swing) -> str:
    """The frequency and the communication steps that go with it, as the end of a sentence."""
    steps = [f"{swing.step(degree):.2g} s" for degree in range(len(_FACTORS))]
    grows = f"; with held inputs it grows from {swing.bound:.2g} s on" if swing.bound > 0 else ""
    return (
        f"{swing.frequency:.3g} rad/s. Communication steps up to {steps[0]} with held inputs, {steps[1]} with first "
        f"and {steps[2]} with second derivatives change an oscillation by a hundredth at most{grows}."
    )


def _ratio(one: Unit | None, other: Unit | None) -> str:
    return "" if one is None or other is None else (one / other).si_name
