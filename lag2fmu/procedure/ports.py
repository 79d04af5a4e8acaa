"""The table [ports] of a mechanism in sentences."""

from __future__ import annotations

from collections.abc import Iterator

from lag2fmu.mechanism.ports import input_names
from lag2fmu.mechanism.record import Mechanism


def port_sentences(m: Mechanism) -> Iterator[str]:
    """Sentences on the inputs that are left out, on places and on drives; none if the table is empty."""
    hidden = [name for name in input_names(m) if name in m.hidden_inputs]
    if hidden:
        yield f"no inputs of the FMU, but kept at their start values: {', '.join(hidden)}"
    words = {
        "forces": "force in at",
        "torques": "torque in on",
        "poses": "pose out of",
        "velocities": "velocity out of",
    }
    words |= {"accelerations": "acceleration out of"}
    for field, places in m.ports.listed().items():
        if places:
            yield f"ports: {words[field]} {', '.join(places)}"
    if m.ports.drives:
        yield f"ports: force out that carries {', '.join(m.ports.drives)}"
