"""The start of a hybrid mechanism: declared values that meet its constraints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lag2fmu.errors import SimulationError
from lag2fmu.reference.constraints import newton
from lag2fmu.reference.energies import declared_starts
from lag2fmu.reference.hybrid.run import HybridRun
from lag2fmu.reference.state import Floats


def started(run: HybridRun, overrides: Mapping[str, float]) -> Floats:
    """q, qd and further states at the start, (s,), in SI units; guesses are solved for.

    ``overrides`` {NAME or NAME_dot: SI value} replace declared values. Raises LoadError for unknown names and unusable
    values, SimulationError where constraints cannot be met.
    """
    coordinates, n, system = run.system.mechanism.coordinates, run.n, run.system
    start: Floats = np.array(list(declared_starts(system.mechanism, overrides).values()), dtype=float)
    if not system.constraints.m:
        return start
    run.started(start)  # the sides of kinks there
    free = [c.given is False for c in coordinates], [c.velocity_given is False for c in coordinates]
    t, h = float(run.times[0]), system.constraints.h

    def positions(q: Floats) -> tuple[Floats, Floats]:
        phi, _, _, G = system.constraints(run.state(t, np.concatenate([q, start[n:]])))
        return phi[:h], G[:h] * system.nominal

    def velocities(qd: Floats) -> tuple[Floats, Floats]:
        _, v, _, G = system.constraints(run.state(t, np.concatenate([start[:n], qd, start[2 * n :]])))
        return v, G * system.nominal

    for half, function, flags in ((slice(0, n), positions, free[0]), (slice(n, 2 * n), velocities, free[1])):
        for chosen in (np.array(flags, dtype=bool), np.ones(n, dtype=bool)):
            if len(function(start[half])[0]):
                start[half] = newton(function, start[half], chosen, system.nominal)
        residual, jacobian = function(start[half])
        size = np.maximum(np.abs(jacobian).max(axis=1, initial=0.0), 1e-300)
        if np.max(np.abs(residual) / size, initial=0.0) > 1e-9 * max(1.0, float(np.abs(start[half]).max())):
            raise SimulationError(f"the constraints cannot be met from the start values; residuals: {residual}")
    return start
