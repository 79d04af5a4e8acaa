"""A second opinion for small mechanisms: SymPy's own Lagrange equations, differentiated symbolically."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from lag2fmu.errors import DerivationError, SimulationError
from lag2fmu.language.rebuilding import replaced
from lag2fmu.language.vocabulary import TIME
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.energies import EnergyFunctions
from lag2fmu.reference.functions import compiled
from lag2fmu.reference.state import Floats, InputValues

MAX_COORDINATES = 3
"""The most coordinates of a mechanism whose equations SymPy differentiates."""


def sympy_accelerations(mechanism: Mechanism) -> Callable[[float, ArrayLike, ArrayLike, InputValues | None], Floats]:
    """A function (t, q, qd, inputs) -> qdd (n,) of the Lagrange equations that SymPy differentiates.

    Parameters are the declared ones. Values are in SI units: q and qd (n,), inputs name -> value, or None. Raises
    DerivationError for more than 3 coordinates; the function raises SimulationError where M is singular. Source:
    SymPy's ``diff`` applied to d/dt dL/dqd - dL/dq, Goldstein, Classical Mechanics, section 1.4.
    """
    energies = EnergyFunctions(mechanism)
    if energies.n > MAX_COORDINATES:
        raise DerivationError(
            f"mechanism '{mechanism.name}' has {energies.n} coordinates; SymPy's equations are made for at most "
            f"{MAX_COORDINATES}"
        )
    s = energies.composition.symbols
    mass, forcing = lagrange_equations(energies)
    arguments = (TIME, *s.q, *s.qd, *s.inputs, *s.parameters)
    function = compiled(arguments, [*mass, *forcing])
    constants = [np.float64(value) for value in energies.parameters.values()]

    def accelerations(t: float, q: ArrayLike, qd: ArrayLike, inputs: InputValues | None = None) -> Floats:
        values = function(energies.state(t, q, qd, inputs).rows, constants)
        n = energies.n
        try:
            qdd: Floats = np.linalg.solve(values[: n * n].reshape(n, n), values[n * n :])
        except np.linalg.LinAlgError as error:
            raise SimulationError(
                f"mechanism '{mechanism.name}' at time {t!r} s: the mass matrix is singular"
            ) from error
        return qdd

    return accelerations


def lagrange_equations(energies: EnergyFunctions) -> tuple[sp.Matrix, sp.Matrix]:
    """M (n, n) and forcing (n, 1) of M qdd = forcing as expressions in plain symbols, differentiated by SymPy.

    d/dt dL/dqd - dL/dq is formed with functions of time. M is the part that qdd multiplies, the Hessian of L along qd.
    Forces and dissipation -dR/dqd are added to the forcing. Parts on frames are composed into expressions here. Source:
    Goldstein, Classical Mechanics, sections 1.4 and 1.5.
    """
    c, s = energies.composition, energies.composition.symbols
    clock = sp.Dummy("clock", real=True)
    moving = {x: sp.Function(f"f{i}", real=True)(clock) for i, x in enumerate((*s.q, *s.motion))}
    to_time = {TIME: clock, **moving}
    for x, x_dot in zip((*s.q, *s.motion), (*s.qd, *s.motion_dot), strict=True):
        to_time[x_dot] = moving[x].diff(clock)
    kinetic, potential, dissipation = (
        own + sp.sympify(framed)
        for own, framed in zip((c.kinetic, c.potential, c.dissipation), energies.spatial.symbolic(), strict=True)
    )
    lagrangian = kinetic - potential
    momenta = [lagrangian.diff(v) for v in s.qd]
    # the highest derivatives first, because they contain lower ones
    second = {moving[y].diff(clock, 2): y_ddot for y, y_ddot in zip(s.motion, s.motion_ddot, strict=True)}
    second |= {moving[q].diff(clock, 2): sp.S.Zero for q in s.q}
    first = {value: x for x, value in to_time.items() if isinstance(value, sp.Derivative)}
    zeroth = {value: x for x, value in to_time.items() if value not in first}

    def plain(p: sp.Expr) -> sp.Expr:
        """The part of dp/dt without qdd."""
        return p.xreplace(to_time).diff(clock).xreplace(second).xreplace(first).xreplace(zeroth)

    loads = energies.spatial.symbolic_forces()
    forcing = [
        Q + load + lagrangian.diff(q) - dissipation.diff(v) - plain(p)
        for Q, load, q, v, p in zip(c.forces, loads, s.q, s.qd, momenta, strict=True)
    ]
    mass = sp.Matrix([[p.diff(v) for v in s.qd] for p in momenta])
    return mass.applyfunc(_done), sp.Matrix(forcing).applyfunc(_done)


def _done(expression: sp.Expr) -> sp.Expr:
    """``expression`` with the derivatives that SymPy leaves undone, as d|x|/dx."""
    return replaced(expression, {x: x.doit() for x in expression.atoms(sp.Derivative)})
