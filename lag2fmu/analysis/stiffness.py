"""Whether explicit solvers would spend their steps on stability instead of accuracy, judged at the start.

A motion is stiff if a part of it decays much faster than the rest moves. Explicit steps have to resolve the decay even
after it has died away: they are about 3 / rate long, while the accuracy of the rest allows about 0.3 / pace. If the
first length is some twenty times shorter than the second, an implicit step of a few Newton iterations costs less.
RATIO is larger than twenty, because the start is one place only. The implicit methods are L-stable: they also damp fast
vibrations that their steps do not resolve, such as those of bodies on hard springs without dampers. Source: E. Hairer,
G. Wanner, Solving Ordinary Differential Equations II, 2nd edition, sections IV.1 and IV.2.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from lag2fmu.analysis.evaluation import attempted
from lag2fmu.analysis.linearization import about_start
from lag2fmu.analysis.modes import normal_modes
from lag2fmu.dynamics.equations import EquationsOfMotion
from lag2fmu.dynamics.terms import forcing

RATIO = 1000.0
"""A mechanism is called stiff if rate / pace is at least this."""
APERIODIC = 0.9
"""An eigenvalue is a decay if its real part is at least this share of its size; any method must follow oscillations."""
UNDAMPED = 0.05
"""An eigenvalue is an undamped vibration, which lasts for several periods, up to this share of the real part."""
FAST = 100
"""A vibration is fast if the experiment has more of its periods than this."""


class Stiffness(NamedTuple):
    """``rate`` of the fastest decay and ``pace`` of the fastest oscillation or growth, at least 1 / duration: 1/s."""

    rate: float
    pace: float

    @property
    def stiff(self) -> bool:
        """Whether implicit steps pay."""
        return self.rate > RATIO * self.pace


def stiffness(equations: EquationsOfMotion) -> Stiffness | None:
    """The rates (1/s) that the eigenvalues of the motion linearized about the start show; None without linearization.

    Source: Hairer, Wanner, Solving Ordinary Differential Equations II, 2nd edition, section IV.2, for stability.
    """
    eigenvalues = attempted(lambda: about_start(equations).eigenvalues, None)
    if eigenvalues is None:
        return None
    size = np.abs(eigenvalues)
    decays = -eigenvalues.real > APERIODIC * size
    duration = equations.mechanism.experiment.stop_time
    return Stiffness(rate=float(size[decays].max(initial=0.0)), pace=float(size[~decays].max(initial=1.0 / duration)))


def without_linear_dampers(equations: EquationsOfMotion) -> EquationsOfMotion:
    """``equations`` without what linear dampers pull: what is left to the explicit forces of a time step."""
    from lag2fmu.dynamics.implicit_dampers import implicit_dampers

    found = equations.apart()
    g = found.graph
    dampers = implicit_dampers(found, partial(forcing, g, found.variables))
    residual = tuple(g.subtract(r, dampers.drag.get(i, g.zero)) for i, r in enumerate(found.residual))
    return replace(found, forcing=dampers.rest, residual=residual, solution=None)


class Vibration(NamedTuple):
    """A vibration about the start: ``frequency`` in rad/s to three digits, and the ``coordinate`` that moves most."""

    frequency: float
    coordinate: str

    def __str__(self) -> str:
        """Such as '1e+03 rad/s (x)'."""
        return f"{self.frequency:.3g} rad/s ({self.coordinate})"


def undamped_vibrations(equations: EquationsOfMotion) -> tuple[Vibration, ...]:
    """The fast undamped vibrations (rad/s) of the motion linearized about the start, the fastest first.

    Fast means more than FAST periods in the experiment; undamped means |Re| < UNDAMPED |eigenvalue|. There are none if
    ``stiffness`` is None.
    """
    modes = attempted(lambda: normal_modes(about_start(equations)), ())
    coordinates = equations.mechanism.coordinates
    nominal = np.array([c.nominal for c in coordinates])
    slowest = 2 * np.pi * FAST / equations.mechanism.experiment.stop_time
    return tuple(
        Vibration(float(f"{mode.frequency:.3g}"), coordinates[int(np.argmax(np.abs(mode.shape) / nominal))].name)
        for mode in reversed(modes)
        if mode.frequency > slowest and abs(mode.eigenvalue.real) < UNDAMPED * abs(mode.eigenvalue)
    )
