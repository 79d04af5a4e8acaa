"""The equations of motion M(q, t) qdd = f(q, qd, t), solved."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .linear_solve import solve
from .model import STATE, Model, Unsolvable, Vector

NAMES_SHOWN = 8


def accelerations(model: Model, t: float, states: Vector, inputs: Vector, parameters: Vector) -> list[float]:
    """qdd of M qdd = f, (n,); raises Unsolvable with a sentence that names the coordinates concerned."""
    try:
        mass, forcing = model.equations(t, states, inputs, parameters)
        found, concerned = solve(mass, forcing)
    except Exception as reason:  # a pole, the end of a domain, or whatever a user's own equations may raise
        raise Unsolvable(
            f"at time {t:.17g} the equations of motion cannot be evaluated ({type(reason).__name__}: {reason}); "
            "the motion has left the range where they are defined"
        ) from reason
    if concerned and all(math.isfinite(entry) for row in mass for entry in row):
        raise Unsolvable(
            f"at time {t:.17g} the mass matrix is singular and does not determine the acceleration of "
            f"{_names(model, concerned)}; check the masses and inertias, or start elsewhere",
            singular=True,
        )
    infinite = [i for i, x in enumerate(found) if not math.isfinite(x)]
    if infinite:
        raise Unsolvable(
            f"at time {t:.17g} the equations of motion give no finite acceleration of "
            f"{_names(model, concerned or infinite)}; the motion has left the range where they are defined"
        )
    return found


def further_rates(
    model: Model, t: float, states: Vector, inputs: Vector, parameters: Vector, qdd: Vector
) -> list[float]:
    """The derivatives of the further states, (f,); raises Unsolvable with a sentence that names one without value."""
    if model.further is None:
        return []
    try:
        found = [float(x) for x in model.further(t, states, inputs, parameters, qdd)]
    except Exception as reason:  # a pole, the end of a domain, or whatever a user's own equations may raise
        raise Unsolvable(
            f"at time {t:.17g} the derivatives of the further states cannot be evaluated "
            f"({type(reason).__name__}: {reason}); the motion has left the range where they are defined"
        ) from reason
    for variable, x in zip(model.of(STATE)[2 * len(model.nominal) :], found, strict=True):
        if not math.isfinite(x):
            raise Unsolvable(
                f"at time {t:.17g} the derivative of the state {variable.name} is {x:g}; its expression is not "
                "defined for the present states and inputs"
            )
    return found


def _names(model: Model, concerned: Sequence[int]) -> str:
    names = [model.coordinates[i] for i in concerned[:NAMES_SHOWN]]
    return ", ".join(names + ["..."] * (len(concerned) > NAMES_SHOWN))
