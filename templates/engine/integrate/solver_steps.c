#include "solver_steps.h"

#include <string.h>

#include "contact_events.h"
#include "derivative.h"
#include "event_steps.h"
#include "inputs.h"
#include "projection.h"

bool update_first_stage(Instance *instance) {
    State *state = &instance->state;
    double *derivatives = instance->scratch.new_derivatives; /* a failure may leave them half done */
    if (!TIME_STEPPING && !state->first_stage_valid) {
        if (!bring_back(instance, state->time, state->states, derivatives) ||
            !derivative_at(instance, state->time, state->states, derivatives)) {
            return false;
        }
        memcpy(state->first_stage, derivatives, sizeof state->first_stage);
        state->first_stage_valid = 1;
    }
    return true;
}

void begin_trial(Instance *instance, Step step) {
    instance->scratch.trial_length = step.length;
    instance->scratch.derivatives_late = false;
    if (ENDS_AT_EVENTS) {
        contacts_turn(instance);
        instance->scratch.solver_before = instance->state.solver;
    }
}

bool end_at_event(Instance *instance, Step *step) {
    return !ENDS_AT_EVENTS || events_end_step(instance, step);
}

bool pass_event(Instance *instance) {
    return !ENDS_AT_EVENTS || !instance->state.event_pending || step_waits(instance) ||
           (events_pass(instance) && update_first_stage(instance));
}

void accept_step(Instance *instance, Step step) {
    State *state = &instance->state;
    state->time = step.end;
    memcpy(state->states, instance->scratch.new_states, sizeof state->states);
    memcpy(state->first_stage, instance->scratch.new_derivatives, sizeof state->first_stage);
    state->first_stage_valid = !instance->scratch.derivatives_late;
}

/* Tells the listener that the present point is the end of a solver step. The listener may answer with a nearer end of
   the communication step. Apart from that the run goes on as without a listener. */
static void tell_step_end(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, inputs, (2 + MAX_INPUT_ORDER) * N_INPUTS);
    State *state = &instance->state;
    Scratch *scratch = &instance->scratch;
    const int64_t set = state->input_derivatives_set;
    const bool move = scratch->inputs_move;
    if (instance->listener.follow == NULL) {
        arena_release(mark);
        return;
    }
    memcpy(inputs, state->inputs, ((2 + MAX_INPUT_ORDER) * N_INPUTS) * sizeof(double));
    inputs_end(instance); /* the listener reads values of the present point */
    state->event_held = state->event_pending;
    instance_forget_motion(instance);
    scratch->step_end = instance->listener.follow(instance->listener.owner, scratch->step_end);
    instance_forget_motion(instance);
    state->event_held = 0;
    memcpy(state->inputs, inputs, ((2 + MAX_INPUT_ORDER) * N_INPUTS) * sizeof(double));
    state->input_derivatives_set = set;
    scratch->inputs_move = move;
    arena_release(mark);
}

bool end_solver_step(Instance *instance) {
    tell_step_end(instance);
    return pass_event(instance);
}
