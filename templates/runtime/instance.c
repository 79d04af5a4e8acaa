/* Start values, assignments and the gate that every fmi2 function passes. */
#include "instance.h"

#include <math.h>

#include <string.h>

#include "integrator.h"
#include "logging.h"

void instance_start(Instance *instance) {
    State *state = &instance->state;
    memset(state, 0, sizeof *state);
    state->type = instance->type;
    state->mode = MODE_INSTANTIATED;
    memcpy(state->states, START_STATES, sizeof state->states);
    memcpy(state->inputs, START_INPUTS, N_INPUTS * sizeof(double));
    memcpy(state->parameters, START_PARAMETERS, sizeof state->parameters);
    state->previous_log_error = log(1e-4); /* the value dopri5.f starts from */

    memset(&instance->failure, 0, sizeof instance->failure);
    memset(instance->noted_calls, 0, sizeof instance->noted_calls);
    memset(instance->noted_kinds, 0, sizeof instance->noted_kinds);
    instance->noted_singularity = false;
    instance->categories = instance->logging_requested ? ALL_CATEGORIES : 0u;
    instance_forget_cache(instance);
}

void instance_assign(Instance *instance, double *slot, double value) {
    State *state = &instance->state;
    if (memcmp(slot, &value, sizeof value) == 0) {
        return;
    }
    *slot = value;
    state->settled = 0;
    if (slot >= state->parameters && slot < state->parameters + SIZE_PARAMETERS) {
        instance->cache.dependent_valid = false;
        instance->cache.least_pivots_valid = false;
    }
#if N_MASSLESS > 0
    state->displaced = state->displaced || (slot >= state->inputs && slot < state->inputs + N_INPUTS) ||
                       (slot >= state->parameters && slot < state->parameters + SIZE_PARAMETERS);
#endif
    instance_forget_motion(instance);
    state->first_stage_valid = 0;
#if VARIATIONAL
    if (slot >= state->inputs + FIRST_MOTION && slot < state->inputs + N_INPUTS) {
        state->canonical.moved = 1; /* forces are finite: where a support jumps, momenta go on and velocities do not */
    } else {
        state->canonical.valid = 0;
    }
#endif
    state->ahead = 0;
    state->undisturbed = 0;
}

void instance_forget_cache(Instance *instance) {
    instance->cache.states_behind = false;
    instance->cache.dependent_valid = false;
    instance->cache.least_pivots_valid = false;
    instance_forget_motion(instance);
}

void instance_forget_motion(Instance *instance) {
    instance->cache.accelerations_valid = false;
    instance->cache.locals_valid = false;
    instance->cache.system_valid = false;
}

const char *variable_name(VariableKind kind, int index) {
    for (int i = 0; i < N_VARIABLES; i++) {
        if (VARIABLES[i].kind == kind && VARIABLES[i].index == index) {
            return VARIABLES[i].name;
        }
    }
    return "?";
}

const char *state_name(int index) {
    const char *name = variable_name(VARIABLE_STATE, index);
    return name[0] != '?' ? name : variable_name(VARIABLE_MASSLESS, index);
}

/* Says why a call is illegal and where it would be legal. */
static void report_illegal_call(Instance *instance, Call call) {
    char modes[160];
    legal_modes(call, instance->type, modes, sizeof modes);
    const char *type = instance->type == fmi2ModelExchange ? "model exchange" : "co-simulation";
    if (modes[0] == '\0') {
        fail(instance, "an instance for %s has no use for this function in any state; do not call it", type);
    } else {
        fail(instance, "illegal in state \"%s\" of an instance for %s; expected one of the states: %s",
             mode_name((Mode)instance->state.mode), type, modes);
    }
}

Instance *instance_enter(fmi2Component component, Call call) {
    Instance *instance = component;
    if (instance == NULL) {
        return NULL;
    }
    instance->call = call;
    const Verdict verdict = legal_call(call, instance->type, (Mode)instance->state.mode);
    if (verdict == VERDICT_ILLEGAL) {
        report_illegal_call(instance, call);
        return NULL;
    }
    if (verdict == VERDICT_TOLERATED && !instance->noted_calls[call]) {
        instance->noted_calls[call] = true;
        note(instance, "accepted in state \"%s\", although the standard does not foresee it there",
             mode_name((Mode)instance->state.mode));
    }
    return instance;
}

Instance *instance_enter_present(fmi2Component component, Call call) {
    Instance *instance = instance_enter(component, call);
    if (instance != NULL && !integrator_catch_up(instance)) {
        report_failure(instance, fmi2Error);
        return NULL;
    }
    return instance;
}
