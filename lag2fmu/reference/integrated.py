"""The record of a direct integration: its trajectory, and what is known about its error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lag2fmu.description.names import velocity
from lag2fmu.reference.hybrid.modes import Event
from lag2fmu.reference.state import Floats
from lag2fmu.reference.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Reference:
    """A direct integration at m times; SI units.

    - ``trajectory``: q, qd, further states, qdd, outputs, multipliers and residuals of constraints, kinetic_energy,
      potential_energy, generalized_energy.
    - ``work`` (m,): the integral of Q.qd - qd.dR/dqd - dL/dt in J; generalized_energy - work is constant.
    - ``scales``: max(range, nominal) of every q, qd and further state z; the nominal value of a velocity is that of its
      coordinate by 1 s.
    - ``error``: |difference| of the runs at rtol and 10 rtol, for q, qd, z; an estimate from above for the trajectory.
    - ``amplification`` (m,): the largest ratio until t of the distance of two runs to the distance of their starts. The
      distance is max |difference| / unit over q, qd and z, see ``integrate``.
    - ``paths`` (m, n): how far each velocity has gone to and fro until t, in SI units; between the times as well. None
      where the times alone tell.
    - ``rates``: how fast each coordinate vibrates all along, in 1/s; none for a hybrid mechanism.
    - ``method``: the method that was used; ``evaluations``: how often it evaluated the equations.

    A hybrid mechanism has more. Its ``trajectory`` holds the results of contacts and frictions, and dissipated_energy,
    which enters ``work`` with a minus sign. ``events`` tells what happened, ``turns`` are the
    times (s) at which kinks of the equations turned. ``comparable`` (m,) says at which times
    runs of other accuracy are in the same modes, which they are not between the times of one impact in both.
    ``amplification`` is infinite behind the last such time.
    """

    trajectory: Trajectory
    work: Floats
    scales: Mapping[str, float]
    error: Trajectory
    amplification: Floats
    method: str
    evaluations: int
    events: tuple[Event, ...] = ()
    turns: tuple[float, ...] = ()
    comparable: NDArray[np.bool_] | None = None
    paths: Floats | None = None
    rates: Mapping[str, float] = field(default_factory=dict)

    @property
    def relative_error(self) -> Floats:
        """The estimated error relative to ``scales``, the worst of q, qd and z: (m,)."""
        worst: Floats = (self.error.values / [self.scales[name] for name in self.error.names]).max(axis=1, initial=0.0)
        return worst

    @property
    def growth(self) -> Floats:
        """By how much the errors of a solver's steps may grow until each time, relative to a hundred of them: (m,).

        It is the amplification. Each radian that the motion swings through adds an error of its own, which grows from
        there on, by the mean of the amplification so far: it is at least that for every hundred radians. So errors of a
        pendulum grow with the square of the time, because its period depends on its energy.
        """
        columns = [velocity(c) for c in self.scales if velocity(c) in self.scales]
        scales = np.array([self.scales[name] for name in columns])
        time, most = self.trajectory.time, np.maximum(1.0, self.amplification)
        paths = self.paths
        if paths is None:
            turns = np.abs(np.diff(self.trajectory.columns(columns), axis=0))
            paths = np.concatenate([np.zeros((1, len(columns))), np.cumsum(turns, axis=0)])
        radians = np.pi * (paths / scales).max(axis=1, initial=0.0)
        sums = np.cumsum((most[1:] + most[:-1]) / 2 * np.diff(time))
        mean = np.append(most[:1], sums / (time[1:] - time[0]))
        larger: Floats = np.maximum(most, radians / 100 * mean)
        return larger

    def growths(self, names: Sequence[str], most: float) -> Floats:
        """The growth for each of the ``names``, of coordinates, velocities and further states: (m, s).

        A vibration adds errors for its radians although it is too small to be seen beside the nominal values, as that
        of a stiff spring is. Up to ``most`` they count for the coordinate that vibrates.
        """
        rates = {**self.rates, **{velocity(name): rate for name, rate in self.rates.items()}}
        time = self.trajectory.time - self.trajectory.time[0]
        radians = time[:, None] * np.array([rates.get(name, 0.0) for name in names])
        found: Floats = np.maximum(self.growth[:, None], np.minimum(most, radians / 100))
        return found

    @property
    def balance(self) -> Floats:
        """generalized_energy - its start - work, in J: (m,); zero but for the integration's error."""
        h = self.trajectory["generalized_energy"]
        drift: Floats = h - h[0] - self.work
        return drift
