"""Whether explicit solvers would spend their steps on stability instead of accuracy, judged at the start.

A motion is stiff where something decays much faster than the rest goes on. Explicit steps have to resolve the decay
even after it has died away: they are about 3 / rate long, while the accuracy of the rest allows about 0.3 / pace. Where
the one is some twenty times shorter, an implicit step of a few Newton iterations costs less; RATIO leaves a margin to
that, because the start is one place only. Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd
edition, sections IV.1 and IV.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lag2fmu.dynamics.analysis.linearization import linearize
from lag2fmu.dynamics.lagrange import EquationsOfMotion
from lag2fmu.errors import DerivationError

RATIO = 1000.0
"""From here on, rate by pace, a mechanism is called stiff."""
APERIODIC = 0.9
"""Share of an eigenvalue's size from which it is a decay: oscillations have to be followed by any method."""


@dataclass(frozen=True)
class Stiffness:
    """``rate`` of the fastest decay and ``pace`` of the fastest oscillation or growth, at least 1 / duration: 1/s."""

    rate: float
    pace: float

    @property
    def stiff(self) -> bool:
        """Whether implicit steps pay."""
        return self.rate > RATIO * self.pace


def stiffness(equations: EquationsOfMotion) -> Stiffness | None:
    """What the motion linearized about the start shows; None where it has no linearization there."""
    try:
        eigenvalues = linearize(equations).eigenvalues
    except DerivationError:
        return None
    size = np.abs(eigenvalues)
    decays = -eigenvalues.real > APERIODIC * size
    duration = equations.mechanism.experiment.stop_time
    return Stiffness(rate=float(size[decays].max(initial=0.0)), pace=float(size[~decays].max(initial=1.0 / duration)))
