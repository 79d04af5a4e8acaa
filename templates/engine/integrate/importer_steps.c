#include "importer_steps.h"

#include <math.h>
#include <string.h>

#include "constraints.h"
#include "contact_events.h"
#include "equations.h"
#include "events.h"
#include "massless.h"
#include "notices.h"
#include "scale.h"
#include "settings.h"
#include "timed_switches.h"
#include "watching.h"

/* Have the states left the constraints? Stabilised accelerations leave some drift. Where a constraint is nearly lost,
   less of it decides on which branch the motion goes on. */
static bool drifted(Instance *instance) {
    const State *state = &instance->state;
    const double drift = constraints_drift(instance, state->time, state->states, state->inputs);
    const double bar = DRIFT * solver_tolerance(state);
    const bool may = drift > CLEARLY_INDEPENDENT * bar && equations_factorize(instance);
    return drift > bar || (may && drift > constraints_firmness(instance, &instance->cache.system) * bar);
}

static void note_step_end(State *state) {
    if (state->time != state->step_ends[0]) {
        state->step_ends[1] = state->step_ends[0];
        state->step_ends[0] = state->time;
    }
}

/* Is the event function k a gap that is still as near to 0 as errors of the solver are? A gap whose last force has
   vanished opens with a high power of the time. */
static bool opens_slowly(const State *state, int k, double value) {
    const int function = k - N_SWITCHES;
    return function >= 0 && function < 2 * N_UNILATERALS && function % 2 == 0 && value <= state->event_rests[k];
}

/* The solver has made a step: what was left of event functions at their last event has ended with it. Is an indicator
   below 0 without it, so that there is an event? */
static bool forget_rests(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, values, N_EVENTS + 1); /* one more: there may be none */
    State *state = &instance->state;
    bool rested = false, below = false;
    for (int k = 0; k < N_EVENTS; k++) {
        rested = rested || state->event_rests[k] > 0.0;
    }
    if (!rested || !events_evaluate(instance, state->time, state->states, values)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < N_EVENTS; k++) {
        state->event_rests[k] = opens_slowly(state, k, values[k]) ? state->event_rests[k] : 0.0;
    }
    instance->cache.indicators_valid = false;
    for (int k = 0; k < N_EVENTS && equations_indicators(instance); k++) {
        below = below || instance->cache.indicators[k] <= 0.0;
    }
    return arena_leave(mark, below);
}

/* The derivative of an entry of the states, with the accelerations up to date. */
static double derivative_of(const Instance *instance, int state) {
    if (state < N_COORDINATES) {
        return instance->state.states[N_COORDINATES + state];
    }
    return state < 2 * N_COORDINATES ? instance->cache.accelerations[state - N_COORDINATES]
                                     : instance->cache.further[state - 2 * N_COORDINATES];
}

static bool derivatives_here(Instance *instance, double derivatives[]) {
    if (!equations_accelerations(instance)) {
        return false;
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        derivatives[i] = derivative_of(instance, CONTINUOUS_STATES[i]);
    }
    return true;
}

/* The same with the switches on the sides of the present states, for this evaluation alone. */
static bool derivatives_on_their_sides(Instance *instance, double derivatives[]) {
    enum { N_HELD = N_MASKS + N_SWITCHES };
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, modes, N_HELD + 1); /* one more: there may be none */
    double *present = instance->state.parameters;
    memcpy(modes, present, N_HELD * sizeof(double));
    const bool found = events_take_sides(instance) && derivatives_here(instance, derivatives);
    memcpy(present, modes, N_HELD * sizeof(double));
    instance->cache.least_pivots_valid = false;
    instance_forget_motion(instance);
    return arena_leave(mark, found);
}

/* A solver may try a state far beyond a kink, where exp(-abs(v)/w) overflows on the side that still holds. Many solvers
   end the run if the derivative is missing there. Beyond a kink any finite one serves, because the event cuts the step;
   that of the sides on which the tried state lies is the most like the motion. */
bool importer_derivatives(Instance *instance, double derivatives[]) {
    if (derivatives_here(instance, derivatives)) {
        return true;
    }
    const Failure failure = instance->failure;
    if (N_SWITCHES > 0 && derivatives_on_their_sides(instance, derivatives)) {
        instance->failure.kind = FAILURE_NONE;
        return true;
    }
    instance->failure = failure;
    return false;
}

bool importer_completes_step(Instance *instance) {
    begin_notices(instance);
    watch_motions(instance);
    keep_motions(&instance->state);
    if (!equations_massless(instance)) {
        return false;
    }
    watch_ranges(instance);
    massless_keep(&instance->state);
    equations_remember(instance);
    note_step_end(&instance->state);
    return forget_rests(instance) || drifted(instance) ||
           !contacts_oppose(instance, instance->state.time, instance->state.states, NULL);
}

void importer_enters_event(Instance *instance) {
    if (equations_massless(instance)) {
        massless_keep(&instance->state);
    }
}

/* Moves the states onto the constraints, or their velocities alone. */
static bool pull_back(Instance *instance, bool positions, bool *changed) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    State *state = &instance->state;
    bool moved;
    memcpy(states, state->states, N_STATES * sizeof(double));
    if (positions ? !constraints_project(instance, state->time, state->inputs, states, &moved)
                  : !constraints_project_velocities(instance, states, &moved)) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < N_CONTINUOUS; i++) {
        const int k = CONTINUOUS_STATES[i];
        *changed = *changed || memcmp(&states[k], &state->states[k], sizeof(double)) != 0;
    }
    for (int i = 0; i < N_STATES; i++) {
        instance_assign(instance, &state->states[i], states[i]);
    }
    massless_keep(state);
    return arena_leave(mark, true);
}

/* An importer may set states that are beyond a kink of a constraint; they are to be judged on their own side of it. */
static bool is_off(Instance *instance) {
    return drifted(instance) && (!events_take_sides(instance) || drifted(instance));
}

/* Have the states left the constraints at a kink, which solvers pass within smooth(...)? How far off they are, over how
   fast they get off, is how long ago that was. Smooth drift has no jump on that way. */
static bool came_past_kink(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, before, N_STATES);
    const State *state = &instance->state;
    const double bar = DRIFT * solver_tolerance(state), rate = constraints_velocity_drift(instance);
    if (rate <= bar) {
        return arena_leave(mark, false);
    }
    const double since = 2.0 * constraints_drift(instance, state->time, state->states, state->inputs) / rate;
    memcpy(before, state->states, N_STATES * sizeof(double));
    for (int i = 0; i < N; i++) {
        before[i] -= since * state->states[N + i];
    }
    if (!constraints_jump(instance, state->time, state->inputs, before, state->states, bar)) {
        return arena_leave(mark, false);
    }
    instance->failure.kind = FAILURE_KINK;
    instance->failure.time = state->time;
    return arena_leave(mark, true);
}

/* The state that a way back onto the constraints moves most. */
static int moved_most(const double from[], const double to[]) {
    int most = 0;
    double size = 0.0;
    for (int i = 0; i < N_STATES; i++) {
        const double moved = fabs(to[i] - from[i]) / NOMINAL_STATES[i];
        most = moved > size ? i : most;
        size = fmax(moved, size);
    }
    return most;
}

static bool meet_constraints(Instance *instance, bool *changed) {
    if (massless_return(instance)) {
        return pull_back(instance, true, changed);
    }
    if (!equations_massless(instance)) {
        return false;
    }
    if (!is_off(instance)) {
        return true;
    }
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, before, N_STATES);
    const bool kink = came_past_kink(instance);
    memcpy(before, instance->state.states, N_STATES * sizeof(double));
    if (!pull_back(instance, true, changed)) {
        return arena_leave(mark, false);
    }
    if (kink) {
        instance->failure.state = moved_most(before, instance->state.states);
    }
    return arena_leave(mark, !kink);
}

bool importer_updates_states(Instance *instance, bool *changed) {
    bool jumped;
    *changed = false;
    if (!meet_constraints(instance, changed)) {
        return false;
    }
    instance->state.modes_settled = 0;
    if (!events_refresh(instance, &jumped) || !events_go_on(instance)) {
        return false;
    }
    *changed = *changed || jumped;
    const bool cornered = constraints_velocity_drift(instance) > DRIFT * solver_tolerance(&instance->state);
    /* Behind a corner of a constraint velocities meet it no longer. Positions stay: on their way back onto the
       constraint they could pass the corner again, which would be another impact. */
    return !cornered || pull_back(instance, false, changed);
}

double importer_next_event(Instance *instance) {
    return timed_next(instance);
}

void importer_leaves_event(Instance *instance) {
    State *state = &instance->state;
    state->step_ends[0] = state->step_ends[1] = state->time;
    equations_remember(instance);
}
