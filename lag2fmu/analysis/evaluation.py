"""The equations of motion in numbers: accelerations, states that meet the constraints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np

from lag2fmu.deadline import OutOfTimeError
from lag2fmu.description import names
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.starts import start_values
from lag2fmu.errors import DerivationError
from lag2fmu.graph.autodiff import forward
from lag2fmu.graph.batches import Evaluator, Floats, Values

Found = TypeVar("Found")
Otherwise = TypeVar("Otherwise")


def attempted(find: Callable[[], Found], otherwise: Otherwise) -> Found | Otherwise:
    """What ``find`` gives; ``otherwise`` if it raises any error but that its time is over.

    It is for analyses that a caller can do without. Their algorithms of algebra and linear algebra raise errors of many
    kinds where numbers are not finite, matrices are empty, or formulas have no value.
    """
    try:
        return find()
    except OutOfTimeError:
        raise
    except Exception:
        return otherwise


def at(
    equations: EquationsOfMotion, values: Values, q: Floats, qd: Floats, further: Floats | None = None
) -> dict[str, float | Floats]:
    """``values`` {variable: SI value} with q and qd, (n,) or (n, *batch), and the ``further`` states (f,) put in."""
    coordinates = [c.name for c in equations.mechanism.coordinates]
    moved = dict(zip(coordinates, q, strict=True))
    if further is not None:
        moved |= zip(further_names(equations), further, strict=True)
    return {**values, **moved, **dict(zip(map(names.velocity, coordinates), qd, strict=True))}


def further_names(equations: EquationsOfMotion) -> list[str]:
    """The names of the further states, (f,)."""
    return [str(equations.graph.leaf[node]) for node in equations.variables.further]


def resting_inputs(equations: EquationsOfMotion) -> dict[str, float | Floats]:
    """{variable: SI value} of all variables at the start, with external forces of zero."""
    silent = {str(equations.graph.leaf[node]): 0.0 for node in equations.variables.plain}
    return {**start_values(equations.mechanism), **silent}


def operating_inputs(
    equations: EquationsOfMotion, inputs: Mapping[str, float] | None = None
) -> dict[str, float | Floats]:
    """{variable: SI value} of all variables at the start, inputs and external forces included.

    ``inputs`` {name: SI value} replace start values. Raises DerivationError for a name that is no input.
    """
    known = [str(equations.graph.leaf[node]) for node in equations.variables.inputs]
    for name in inputs or {}:
        if name not in known:
            raise DerivationError(
                f"mechanism '{equations.mechanism.name}': '{name}' is no input; known are {', '.join(known)}"
            )
    return {**start_values(equations.mechanism), **(inputs or {})}


def driven_by_time(equations: EquationsOfMotion) -> bool:
    """Whether the equations of motion change with time by themselves."""
    g, t = equations.apart().graph, equations.variables.t
    return any(rate != g.zero for rate in forward(g, equations.residual, {t: g.one}))


def unknowns(equations: EquationsOfMotion, values: Values) -> tuple[Floats, Floats]:
    """Accelerations (n,) and multipliers (m,) at the state ``values``, in SI units; see ``Unknowns``."""
    return Unknowns(equations)(values)


class Unknowns:
    """Accelerations (n,) and multipliers (m,) at states, in SI units, planned once for many states.

    Multipliers are of least norm where constraints are redundant. M and G are scaled by the coordinates' nominal
    values, so that the rank does not depend on units. Source: F. Udwadia, R. Kalaba, Analytical Dynamics, Cambridge
    1996, chapters 2 and 3.
    """

    def __init__(self, equations: EquationsOfMotion) -> None:
        g, c, n = equations.graph, equations.constraints, len(equations.forcing)
        self._equations, self._sizes = equations, (n * n, n * len(c), n)
        rows = (*equations.mass_matrix, *c.jacobian)
        self._evaluator = Evaluator(g, [x for row in rows for x in row] + [*equations.forcing, *c.accelerations])

    def __call__(self, values: Values) -> tuple[Floats, Floats]:
        """At the state ``values`` {variable: SI value}."""
        M, G, forcing, gamma = np.split(self._evaluator(values), np.cumsum(self._sizes))
        n, m = len(forcing), len(gamma)
        solution = saddle(self._equations, M.reshape(n, n), G.reshape(m, n)) @ np.concatenate([forcing, -gamma])
        return solution[:n], solution[n:]


def saddle(equations: EquationsOfMotion, M: Floats, G: Floats, pull: Floats | None = None) -> Floats:
    """The (pseudo-)inverse (n + m, n + m) of [M -G^T; G 0] for M (n, n) and G (m, n).

    ``pull`` (n, m) takes the place of -G^T where other forces depend on what the constraints bear. The matrix is scaled
    first, so that the rank does not depend on units. All entries are NaN if M or G is not finite. Source: F. Udwadia,
    R. Kalaba, Analytical Dynamics, Cambridge 1996, chapters 2 and 3.
    """
    m = len(G)
    whole = np.block([[M, -G.T if pull is None else pull], [G, np.zeros((m, m))]])
    # columns are scaled by the roots of M's diagonal, by nominal values without mass; rows of G get unit length
    diagonal = np.abs(np.diagonal(M))
    nominal = np.array([q.nominal for q in equations.mechanism.coordinates])
    columns = np.where(diagonal > 0, 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0)), nominal)
    length = np.linalg.norm(G * columns, axis=1)
    scale = np.concatenate([columns, 1 / np.where(length > 0, length, 1.0)])
    if not np.isfinite(whole).all():
        return np.full_like(whole, np.nan)
    inverse: Floats = scale[:, None] * np.linalg.pinv(scale[:, None] * whole * scale, rcond=1e-11) * scale
    return inverse
