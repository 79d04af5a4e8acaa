"""The trials by name, in the order in which they are done."""

from __future__ import annotations

from lag2fmu.checking.trials import (
    Trial,
    equations,
    instances,
    instantiate,
    repeat,
    run,
    serialize,
    signals,
    start_values,
    state,
)
from lag2fmu.checking.trials_derivatives import directional
from lag2fmu.checking.trials_illegal import (
    forbidden_trials,
    free_no_state,
    free_nothing,
    read_nothing,
    wrong_guid,
)

_LEGAL: dict[str, Trial] = {
    "instantiate": instantiate,
    "run": run,
    "start values": start_values,
    "repeat and reset": repeat,
    "several instances": instances,
    "FMU state": state,
    "serialized FMU state": serialize,
    "derivatives of signals": signals,
    "equations": equations,
    "directional derivatives": directional,
}
_MARGINAL: dict[str, Trial] = {
    "wrong guid": wrong_guid,
    "freeing no instance": free_nothing,
    "freeing no FMU state": free_no_state,
    "reading no variable": read_nothing,
}
ESSENTIAL = ("instantiate", "run")
"""Where one of these fails, the other trials would say nothing new."""


def trials_of(kind: str) -> dict[str, Trial]:
    """The trials of ``kind`` in order."""
    return _LEGAL | _MARGINAL | forbidden_trials(kind)
