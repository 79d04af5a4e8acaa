"""Accelerations of mechanisms that were made of SymPy's mechanics, and SymPy's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import sympy as sp
from kkt import solve
from numpy.typing import NDArray
from sympy.physics.mechanics import KanesMethod

from lag2fmu import derive
from lag2fmu.formats.mechanics.equations import T, from_kane
from lag2fmu.mechanism.record import Mechanism

Floats = NDArray[np.float64]


def accelerations(mechanism: Mechanism, q: Sequence[float], qd: Sequence[float], **values: float) -> Floats:
    """The accelerations (n,) of a mechanism at a state, its constraints held by multipliers."""
    names = [x.name for x in mechanism.coordinates]
    at = {"t": 0.0, **{p.name: p.value for p in mechanism.parameters}, **{f"Q_{name}": 0.0 for name in names}}
    at |= dict(zip(names, q, strict=True)) | dict(zip((f"{name}_dot" for name in names), qd, strict=True)) | values
    return solve(derive(mechanism), at)[0]


def speeds_of_kane(method: KanesMethod, values: Mapping[sp.Expr, float]) -> tuple[Floats, Floats]:
    """SymPy's own q' and u' of a ``KanesMethod`` whose constants and states have ``values``."""
    mass, forcing = (np.array(x.xreplace(values), float) for x in (method.mass_matrix_full, method.forcing_full))
    rates = np.linalg.solve(mass, forcing).ravel()
    n = len(method.q)
    return rates[:n], rates[n:]


def rates_of_speeds(method: KanesMethod, values: Mapping[sp.Expr, float], qdd: Floats, qd: Floats) -> Floats:
    """u' of the same speeds at our accelerations qdd."""
    problem, put = from_kane(method, "x"), dict(values)
    for q, rate, second in zip(problem.coordinates, qd, qdd, strict=True):
        put |= {q.diff(T): rate, q.diff(T, 2): second}
    return np.array([float(problem.speeds[u].diff(T).doit().xreplace(put)) for u in method.u])
