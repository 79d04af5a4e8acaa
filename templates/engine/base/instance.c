/* Start values and assignments. */
#include "instance.h"

#include <math.h>
#include <string.h>

/* Before anything is decided contacts and stops are open, and dry frictions stick. */
static void start_modes(State *state) {
    for (int i = 0; i < N_UNILATERALS + N_FRICTIONS; i++) {
        state->modes[i] = i < N_UNILATERALS ? MODE_OPEN : MODE_STICKS;
    }
}

void instance_work_in(Instance *instance, Arena *arena) {
    instance->arena = instance->cache.system.arena = instance->scratch.system.arena = arena;
}

void instance_start(Instance *instance) {
    State *state = &instance->state;
    memset(state, 0, sizeof *state);
    state->phase = PHASE_SETTING_UP;
    memcpy(state->states, START_STATES, sizeof state->states);
    memcpy(state->inputs, START_INPUTS, N_INPUTS * sizeof(double));
    memcpy(state->parameters, START_PARAMETERS, sizeof state->parameters);
    start_modes(state);
    observer_memory_start(&state->observer);
    state->previous_log_error = log(1e-4); /* the value dopri5.f starts from */
    memset(&instance->failure, 0, sizeof instance->failure);
    instance_forget_cache(instance);
}

static bool is_parameter(const State *state, const double *slot) {
    return slot >= state->parameters && slot < state->parameters + SIZE_PARAMETERS;
}

static bool is_input(const State *state, const double *slot) {
    return slot >= state->inputs && slot < state->inputs + N_INPUTS;
}

static Change kind_of(const State *state, const double *slot) {
    if (!is_input(state, slot)) {
        return CHANGED_STATE;
    }
    return slot >= state->inputs + FIRST_MOTION ? CHANGED_MOTION : CHANGED_INPUT;
}

void instance_assign(Instance *instance, double *slot, double value) {
    State *state = &instance->state;
    if (memcmp(slot, &value, sizeof value) == 0) {
        return;
    }
    *slot = value;
    state->settled = 0;
    if (is_parameter(state, slot)) {
        instance->cache.dependent_valid = false;
        instance->cache.least_pivots_valid = false;
    }
    state->displaced = state->displaced || is_input(state, slot) || is_parameter(state, slot);
    instance_forget_motion(instance);
    state->first_stage_valid = 0;
    solver_forget(&state->solver, kind_of(state, slot));
    state->ahead = 0;
    state->modes_settled = state->event_pending = 0;
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
    instance->cache.shown_valid = false;
    instance->cache.locals_valid = false;
    instance->cache.system_valid = false;
    instance->cache.indicators_valid = false;
}
