"""The trials of FMI 2.0 by name, in the order in which they are done."""

from __future__ import annotations

from lag2fmu.checking.fmi2.derivatives import directional
from lag2fmu.checking.fmi2.illegal import ANY, OWN
from lag2fmu.checking.fmi2.trials import equations, free_no_state, instantiate, read_nothing, signals
from lag2fmu.checking.illegal import forbidden_trials
from lag2fmu.checking.trials import LEGAL, Trial, free_nothing, wrong_token

_OWN: dict[str, Trial] = {
    "derivatives of signals": signals,
    "equations": equations,
    "directional derivatives": directional,
}
_MARGINAL: dict[str, Trial] = {
    "wrong guid": wrong_token,
    "freeing no instance": free_nothing,
    "freeing no FMU state": free_no_state,
    "reading no variable": read_nothing,
}


def trials_of(kind: str) -> dict[str, Trial]:
    """The trials of ``kind`` in order."""
    return {"instantiate": instantiate} | LEGAL | _OWN | _MARGINAL | forbidden_trials(ANY | OWN[kind])
