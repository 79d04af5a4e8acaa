"""The record ``Residual``: by how much a run breaks a law, in a unit that a reader understands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Accuracy:
    """What a way of running may be wrong by, each as a part of the size of such quantities in the run.

    ``exact``: what follows from the state alone, such as forces. ``states``: positions and velocities, where a law says
    what they are. ``motion``: what an integration gathers, such as energy, or the direction of a slow slip in space.

    ``step`` (s): of a method that steps over impacts and changes of modes, else 0. What happens in a step is up to so
    much late. Positions are then off by the step times the change of velocities, velocities by the step times that of
    accelerations. Laws hold in the middle of a step: at its end what is kept moves by what its row turns in half of it.
    Modes are those of the step before, so a force may break its law until the next one: only what lasts is judged.
    """

    exact: float
    states: float
    motion: float
    step: float = 0.0


@dataclass(frozen=True)
class Residual:
    """``law`` is broken by up to ``value`` in ``unit``; the ``bar`` has the same unit. ``where``: by what, and when."""

    law: str
    unit: str
    value: float
    bar: float
    where: str


def worst(
    law: str, elements: Sequence[str], units: Sequence[str], time: Floats, off: ArrayLike, bars: ArrayLike
) -> Iterator[Residual]:
    """The residual of a ``law`` that is nearest to its bar, or farthest beyond; none where nothing obeys the law.

    ``off`` (k, m) are the violations by k ``elements`` in their ``units`` at m times (s), NaN where the law says
    nothing; ``bars`` broadcast to (k, m).
    """
    values = np.asarray(off, dtype=float)
    limits = np.maximum(np.broadcast_to(np.asarray(bars, dtype=float), values.shape), 1e-300)
    ratio = np.where(np.isnan(values), -np.inf, values / limits)
    if values.size and ratio.max() > -np.inf:
        i, at = divmod(int(np.argmax(ratio)), ratio.shape[1])
        value = max(0.0, float(values[i, at]))
        where = f"{elements[i]} at t = {time[at]:.4g} s" if value else "never"
        yield Residual(law, units[i], value, float(limits[i, at]), where)
