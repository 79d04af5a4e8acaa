"""SymPy's objects as energies, generalized forces and constraints in q and qd.

Kane's generalized speeds u are linear in the velocities, u = U(t, q) qd + w(t, q), and are replaced by this. A body has
its kinetic energy, a load has the generalized forces F . dv/dqd. Source: T. R. Kane, D. A. Levinson, Dynamics,
McGraw-Hill 1985, sections 2.9 and 4.4; J. Moore, SymPy's documentation of physics.mechanics.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp
from sympy.physics.mechanics import KanesMethod, LagrangesMethod, ReferenceFrame, System, dynamicsymbols

from lag2fmu.errors import LoadError
from lag2fmu.formats.mechanics.gyroscopic import gyroscopic_forces, moving

T = dynamicsymbols._t
"""The time of dynamic symbols."""


@dataclass(frozen=True)
class Problem:
    """A mechanical system in SymPy's dynamic symbols: ``coordinates`` q(t) and, by the name, their velocities q'(t).

    It has a ``lagrangian`` or the ``kinetic`` energy, the generalized ``forces`` Q (n,), and expressions that are 0:
    the ``holonomic`` and the ``nonholonomic`` constraints, and those that ``repeat``, which may follow from the
    holonomic ones. ``speeds`` are {u: its expression in q and q'}.
    """

    coordinates: tuple[sp.Expr, ...]
    kinetic: sp.Expr | None
    lagrangian: sp.Expr | None
    forces: tuple[sp.Expr, ...]
    holonomic: tuple[sp.Expr, ...]
    nonholonomic: tuple[sp.Expr, ...]
    speeds: Mapping[sp.Expr, sp.Expr]
    repeat: bool = False


def from_lagrange(method: LagrangesMethod, name: str) -> Problem:
    """The problem of a ``LagrangesMethod``; raises LoadError for loads without a frame."""
    q, holonomic = tuple(method.q), tuple(method._hol_coneqs)
    loads = list(method.forcelist or ())
    if loads and method.inertial is None:
        raise LoadError(f"'{name}': LagrangesMethod has loads and no inertial frame; give it frame=N")
    forces = _generalized(loads, q, {}, method.inertial)
    return Problem(q, None, method._L[0], forces, holonomic, tuple(list(method.coneqs)[len(holonomic) :]), {})


def from_kane(method: KanesMethod, name: str) -> Problem:
    """The problem of a ``KanesMethod``; raises LoadError where bodies or kinematic equations are missing."""
    bodies, loads = method._bodylist, method._forcelist
    if not bodies:
        raise LoadError(f"'{name}': KanesMethod has no bodies; call its kanes_equations(bodies, loads) first")
    kinematic = method._k_ku_implicit * method.u + method._k_kqdot_implicit * method._qdot + method._f_k_implicit
    constraints = method._k_nh * method.u + method._f_nh if method._k_nh else ()
    auxiliary = dict.fromkeys(method._uaux, sp.S.Zero)
    return _in_velocities(
        name,
        method._inertial,
        (method.q, method.u),
        kinematic,
        bodies,
        loads or (),
        (method._f_h, constraints),
        auxiliary,
    )


def from_system(system: System, name: str) -> Problem:
    """The problem of a ``System``; raises LoadError where bodies or kinematic equations are missing."""
    if not system.bodies:
        raise LoadError(f"'{name}': the System has no bodies; add_bodies or add_joints brings them")
    loads = [*system.loads, *(load for actuator in system.actuators for load in actuator.to_loads())]
    constraints = (system.holonomic_constraints, system.nonholonomic_constraints)
    auxiliary = dict.fromkeys(system.u_aux, sp.S.Zero)
    return _in_velocities(
        name, system.frame, (system.q, system.u), system.kdes, system.bodies, loads, constraints, auxiliary
    )


def _in_velocities(
    name: str,
    frame: ReferenceFrame,
    states: tuple[Sequence[sp.Expr], Sequence[sp.Expr]],
    kinematic: Iterable[sp.Expr],
    bodies: Iterable[Any],
    loads: Iterable[Any],
    constraints: tuple[Iterable[sp.Expr], Iterable[sp.Expr]],
    auxiliary: Mapping[sp.Expr, sp.Expr],
) -> Problem:
    """The problem with the generalized speeds replaced by their expressions in velocities.

    A speed without a kinematic equation is the velocity of a coordinate of its own. A wheel has one if its angle does
    not matter.
    """
    q, u = tuple(states[0]), tuple(states[1])
    kinematic = [sp.sympify(e).xreplace(auxiliary) for e in kinematic]
    ignored = [speed for speed in u if not any(e.has(speed) for e in kinematic)]
    added = [dynamicsymbols(f"integral_{speed.func}") for speed in ignored]
    kinematic += [x.diff(T) - speed for x, speed in zip(added, ignored, strict=True)]
    q = (*q, *added)
    speeds, left = _speeds(name, kinematic, u)
    put = {**speeds, **auxiliary}
    kinetic = sum((body.kinetic_energy(frame) for body in bodies), sp.S.Zero)
    gyroscopic = gyroscopic_forces([moving(body, frame, put) for body in bodies], q)
    forces = tuple(map(sp.Add, _generalized(loads, q, speeds, frame), gyroscopic))
    holonomic, velocities = (tuple(sp.sympify(e).xreplace(put) for e in group) for group in constraints)
    return Problem(
        q,
        kinetic.xreplace(put),
        None,
        tuple(force.xreplace(put) for force in forces),
        holonomic,
        (*velocities, *left),
        speeds,
        repeat=True,
    )


def _speeds(
    name: str, kinematic: Sequence[sp.Expr], u: Sequence[sp.Expr]
) -> tuple[dict[sp.Expr, sp.Expr], tuple[sp.Expr, ...]]:
    """{u: its expression in q, q'} from the ``kinematic`` equations, and the equations left, which tie velocities."""
    left = [sp.sympify(e).doit() for e in kinematic]
    found: dict[sp.Expr, sp.Expr] = {}
    for speed in u:  # one after the other, because each equation gives one speed
        usable = [e for e in left if e.has(speed) and not sp.diff(e, speed).has(speed)]
        if not usable:
            raise LoadError(f"'{name}': no kinematic differential equation says what {speed} is; give kd_eqs")
        equation = min(usable, key=lambda e: (sum(e.has(other) for other in u), sp.count_ops(e.diff(speed))))
        solution = (-equation.xreplace({speed: sp.S.Zero}) / equation.diff(speed)).xreplace(found)
        left = [e.xreplace({speed: solution}) for e in left if e is not equation]
        found = {key: value.xreplace({speed: solution}) for key, value in found.items()} | {speed: solution}
    return found, tuple(e for e in left if e.simplify() != 0)


def _generalized(
    loads: Iterable[Any], q: Sequence[sp.Expr], speeds: Mapping[sp.Expr, sp.Expr], frame: ReferenceFrame
) -> tuple[sp.Expr, ...]:
    """Q (n,) of ``loads`` (point or frame, vector): by the partial velocities of ``speeds`` and of q' themselves."""
    rates = [x.diff(T) for x in q]
    total = [sp.S.Zero for _ in q]
    for place, vector in (tuple(load) for load in loads):
        if vector == 0:
            continue
        velocity = place.ang_vel_in(frame) if isinstance(place, ReferenceFrame) else place.vel(frame)
        for i, rate in enumerate(rates):
            total[i] += velocity.diff(rate, frame, var_in_dcm=False).dot(vector)
        for speed, value in speeds.items():
            along = velocity.diff(speed, frame, var_in_dcm=False).dot(vector)
            if along != 0:
                for i, rate in enumerate(rates):
                    total[i] += along * value.diff(rate)
    return tuple(total)
