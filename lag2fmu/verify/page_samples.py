"""Samples of a direct integration, with which a live page compares its own trajectory."""

from __future__ import annotations

import numpy as np

from lag2fmu.description.names import velocity
from lag2fmu.fmu.live.samples import Samples
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.reference.integrated import Reference
from lag2fmu.verify.agreement import CHAOS, SAFETY


def page_samples(mechanism: Mechanism, reference: Reference) -> Samples:
    """Samples of the default experiment of ``mechanism``, whose direct integration is ``reference``.

    They are at times at which two right runs have to agree, see ``agreement``.
    """
    trajectory, tolerance = reference.trajectory, mechanism.experiment.tolerance
    columns = [name for q in mechanism.coordinates for name in (q.name, velocity(q.name))]
    columns += [z.name for z in mechanism.states]
    reached = float(trajectory.time[-1])
    compared = SAFETY * reference.growth * tolerance <= CHAOS
    if reference.comparable is not None:
        compared &= reference.comparable & _apart_from_events(mechanism, reference)
    return Samples(
        names=tuple(columns),
        times=trajectory.time[compared],
        values=trajectory.columns(columns)[compared],
        scales=np.array([reference.scales[name] for name in columns]),
        growth=reference.growth[compared],
        bar=SAFETY * tolerance,
        until=None if reached >= mechanism.experiment.stop_time * (1 - 1e-9) else reached,
    )


def _apart_from_events(mechanism: Mechanism, reference: Reference) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """At which times no event is near, because an event may come a little earlier or later in another run."""
    time = reference.trajectory.time
    apart = np.ones(len(time), dtype=bool)
    for event in reference.events:
        apart &= np.abs(time - event.time) > mechanism.experiment.step
    return apart
