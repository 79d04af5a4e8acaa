"""The record ``Task`` of what is validated, and the bar of comparisons without integration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lag2fmu.deadline import LIMIT
from lag2fmu.description import names
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.signals import Signals, held, interpolated
from lag2fmu.reference.trajectory import Trajectory

Floats = NDArray[np.float64]

ROUNDING = 1e-10
"""Bar of comparisons without integration; the condition of the mass matrix may cost some digits of 1e-16."""

_FINE, _COARSE = 5, 10  # communication steps: step / 5, step, 10 step


@dataclass(frozen=True)
class Task:
    """The FMU ``path`` of ``mechanism``, to be validated until ``stop_time`` (s) with the relative ``tolerance``.

    ``inputs`` (SI units over time in s) drive both sides; None: all inputs keep their start values. With ``hold`` they
    are constant during a communication step. ``limit`` (s) is the CPU time of the direct integrations. ``solver_step``
    (s) is that of an FMU that steps over impacts and changes of modes, 0 for one that locates them.
    """

    mechanism: Mechanism
    path: Path
    stop_time: float
    tolerance: float
    inputs: Trajectory | None
    hold: bool = False
    limit: float = LIMIT
    solver_step: float = 0.0

    @property
    def holds(self) -> bool:
        """Whether there are inputs that are held."""
        return self.inputs is not None and self.hold

    def driving(self, step: float) -> Signals | None:
        """The inputs that the FMU gets with a communication ``step`` (s), as signals over time.

        Raises LoadError if a motion has only one of its derivatives.
        """
        if self.inputs is None:
            return None
        motions = [motion.name for motion in self.mechanism.motions]
        pieces = interpolated(self.inputs, motions, self.stop_time)
        if not self.hold:
            return pieces.signals
        grid = self.grid(step)
        return held(Trajectory(grid, pieces.names, np.array([pieces.values(t) for t in grid])), motions)

    @property
    def steps(self) -> tuple[float, float, float]:
        """Three communication steps in s whose grids are nested, the middle one about the experiment's step."""
        coarse = max(2, round(self.stop_time / (_COARSE * self.mechanism.experiment.step)))
        return tuple(self.stop_time / (coarse * n) for n in (1, _COARSE, _COARSE * _FINE))  # type: ignore[return-value]

    @property
    def states(self) -> list[str]:
        """The names of q, qd and the further states, (2 n + f,)."""
        q = [c.name for c in self.mechanism.coordinates]
        return [*q, *map(names.velocity, q), *(z.name for z in self.mechanism.states)]

    @property
    def settings(self) -> dict[str, float]:
        """What is set in the FMU before its runs."""
        return {"solver_step": self.solver_step} if self.solver_step else {}

    @property
    def settable(self) -> list[str]:
        """The ``states`` that have a start value in the FMU: all but coordinates without mass and their velocities."""
        follows = {c.coordinate for c in self.mechanism.constraints if c.massless}
        return [name for name in self.states if name not in follows | {names.velocity(str(q)) for q in follows}]

    def further(self, run: Trajectory) -> dict[str, Floats]:
        """The further states along a ``run``, by name: (k,) each."""
        return {z.name: run[z.name] for z in self.mechanism.states}

    def grid(self, step: float) -> Floats:
        """The communication points for ``step``, in s: (k,) from 0 to the stop time."""
        points: Floats = np.linspace(0.0, self.stop_time, round(self.stop_time / step) + 1, dtype=np.float64)
        return points


def moves_a_target(mechanism: Mechanism, inputs: Trajectory | None) -> bool:
    """Whether ``inputs`` move the target of a filtered motion of ``mechanism``.

    Such inputs are held, because only co-simulation knows the derivatives that a filter uses.
    """
    targets = [name for name in map(names.target, mechanism.filtered) if inputs is not None and name in inputs]
    return any(np.ptp(inputs[name]) > 0 for name in targets)  # type: ignore[index]
