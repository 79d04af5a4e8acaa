"""The trials of FMI 3.0 by name, in the order in which they are done."""

from __future__ import annotations

from lag2fmu.checking.fmi3.derivatives import adjoint, directional
from lag2fmu.checking.fmi3.equations import dependencies, equations, output_derivatives
from lag2fmu.checking.fmi3.events import (
    event_mode,
    intermediate_update,
    reset_everywhere,
    saved_in_every_state,
    step_results,
)
from lag2fmu.checking.fmi3.illegal import ANY
from lag2fmu.checking.fmi3.illegal_own import OWN
from lag2fmu.checking.fmi3.same_run import same_run
from lag2fmu.checking.fmi3.ticks import ticking
from lag2fmu.checking.fmi3.trials import (
    after_the_end,
    before_initialization,
    configuration,
    free_no_state,
    instantiate,
    log_messages,
    nothing_asked,
)
from lag2fmu.checking.illegal import forbidden_trials
from lag2fmu.checking.trials import LEGAL, Trial, free_nothing, wrong_token

_OWN: dict[str, Trial] = {
    "before initialization": before_initialization,
    "reading and setting nothing": nothing_asked,
    "results of steps": step_results,
    "Event Mode": event_mode,
    "events by the FMU and by the importer": same_run,
    "clocks": ticking,
    "FMU state in every state": saved_in_every_state,
    "reset in every state": reset_everywhere,
    "intermediate update": intermediate_update,
    "after the end": after_the_end,
    "log": log_messages,
    "configuration": configuration,
    "derivatives of outputs": output_derivatives,
    "equations": equations,
    "dependencies": dependencies,
    "directional derivatives": directional,
    "adjoint derivatives": adjoint,
}
_MARGINAL: dict[str, Trial] = {
    "wrong instantiationToken": wrong_token,
    "freeing no instance": free_nothing,
    "freeing no FMU state": free_no_state,
}


def trials_of(kind: str) -> dict[str, Trial]:
    """The trials of ``kind`` in order; none of Scheduled Execution, which needs a scheduler."""
    if kind not in OWN:
        return {}
    return {"instantiate": instantiate} | LEGAL | _OWN | _MARGINAL | forbidden_trials(ANY | OWN[kind])
