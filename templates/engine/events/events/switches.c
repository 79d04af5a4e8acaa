/* Switches: the kinks of the equations of motion. A switch is +1 or -1, the sign of its margin; within a mode it keeps
   that value, so that the equations are smooth. */
#include <math.h>
#include <string.h>

#include "contact_events.h"
#include "derivative.h"
#include "event_noise.h"
#include "events.h"
#include "inputs.h"
#include "scale.h"
#include "settings.h"

enum { MOST_SWITCH_ROUNDS = 100 };
enum { MANY_EVENTS = 20 }; /* of model exchange, one soon after another */

/* Parts of the experiment by which it is looked ahead to see where the motion goes: the first, and the last. Margins
   that turn often, as sin(1/t), have other roots nearby. */

/* The switches stand in the parameters. */
static double *switches_of(Instance *instance) {
    return instance->state.parameters + N_MASKS;
}

static bool evaluate_margins(Instance *instance, double time, const double states[], double margins[]) {
    mechanism_switches(time, states, inputs_at(instance, time), instance->state.parameters, margins);
    for (int k = 0; k < N_SWITCHES; k++) {
        if (!isfinite(margins[k])) {
            instance->failure.kind = FAILURE_EVENT_VALUE;
            instance->failure.time = time;
            instance->failure.event = k;
            return false;
        }
    }
    return true;
}

/* values[N_SWITCHES] of the margins, positive where the switches are on their sides. */
static bool evaluate_sides(Instance *instance, double time, const double states[], double values[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, margins, SIZE_SWITCHES);
    if (!evaluate_margins(instance, time, states, margins)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < N_SWITCHES; k++) {
        values[k] = switches_of(instance)[k] * margins[k];
    }
    return arena_leave(mark, true);
}

bool events_evaluate(Instance *instance, double time, const double states[], double values[]) {
    return (N_SWITCHES == 0 || evaluate_sides(instance, time, states, values)) &&
           contacts_evaluate(instance, time, states, values + N_SWITCHES);
}

double events_noise(const Instance *instance, int k) {
    return NOISE * EVENT_NOMINALS[k] + instance->state.event_rests[k];
}

/* Values that follow from the modes are outdated. */
static void forget_directions(Instance *instance) {
    instance->cache.least_pivots_valid = false;
    instance_forget_motion(instance);
}

static void turn(Instance *instance, int k) {
    switches_of(instance)[k] *= -1.0;
    forget_directions(instance);
}

/* *rise is by how much the margin k is more than `from` on its side a little later under the present modes, as the
   accelerations at the present point say: at the first glance that tells it from rounding, or else at the last one. */
static bool glance_ahead(Instance *instance, int k, double from, double *rise) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, derivatives, N_STATES);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, margins, SIZE_SWITCHES);
    const State *state = &instance->state;
    const double duration = experiment_duration(state), noise = events_noise(instance, k);
    if (!derivative_at(instance, state->time, state->states, derivatives)) {
        return arena_leave(mark, false);
    }
    for (double part = SLIVER * SLIVER; part <= 1.5 * SLIVER; part *= 10.0) {
        const double h = part * duration;
        for (int i = 0; i < N; i++) {
            states[i] = state->states[i] + h * (state->states[N + i] + 0.5 * h * derivatives[N + i]);
        }
        for (int i = N; i < N_STATES; i++) {
            states[i] = state->states[i] + h * derivatives[i];
        }
        if (!evaluate_margins(instance, state->time + h, states, margins)) {
            return arena_leave(mark, false);
        }
        *rise = switches_of(instance)[k] * (margins[k] - from);
        if (fabs(*rise) > noise) {
            return arena_leave(mark, true);
        }
    }
    return arena_leave(mark, true);
}

/* Chooses the side of a switch whose margin is 0: the side to which the motion goes if the switch is on this side. */
static bool choose_side(Instance *instance, int k) {
    double rise;
    for (int attempt = 0; attempt < 2; attempt++) {
        if (!glance_ahead(instance, k, 0.0, &rise)) {
            return false;
        }
        if (rise > events_noise(instance, k)) {
            return true;
        }
        turn(instance, k);
    }
    return true; /* neither side is confirmed, or the margin stays at 0: the side stays as it was */
}

/* The margins at the present states and, where these are 0, a little further on along the velocities. */
static bool margins_onward(Instance *instance, double margins[], double onward[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    const State *state = &instance->state;
    const double h = SLIVER * experiment_duration(state);
    memcpy(states, state->states, N_STATES * sizeof(double));
    for (int i = 0; i < N; i++) {
        states[i] += h * state->states[N + i];
    }
    return arena_leave(mark, evaluate_margins(instance, state->time, state->states, margins) &&
                                 evaluate_margins(instance, state->time + h, states, onward));
}

bool events_take_sides(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, margins, SIZE_SWITCHES);
    WORK(mark, double, onward, SIZE_SWITCHES);
    bool turned = false;
    if (N_SWITCHES == 0 || !margins_onward(instance, margins, onward)) {
        instance->failure.kind = FAILURE_NONE; /* a guess; the start that is found has to have margins */
        return arena_leave(mark, false);
    }
    for (int k = 0; k < N_SWITCHES; k++) {
        const double noise = events_noise(instance, k);
        const double margin = switches_of(instance)[k] * (fabs(margins[k]) > noise ? margins[k] : onward[k]);
        if (margin < -noise) {
            turn(instance, k);
            turned = true;
        }
    }
    return arena_leave(mark, turned);
}

/* Turns the switches that are due, and those whose margins say so; at 0 the motion decides. *turned: any of them. */
static bool settle_switches(Instance *instance, const bool due[], bool *turned) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, margins, SIZE_SWITCHES);
    WORK(mark, double, before, SIZE_SWITCHES);
    const State *state = &instance->state;
    memcpy(before, switches_of(instance), N_SWITCHES * sizeof(double));
    for (int k = 0; k < N_SWITCHES; k++) {
        if (!evaluate_margins(instance, state->time, state->states, margins)) {
            return arena_leave(mark, false);
        }
        const double value = switches_of(instance)[k] * margins[k];
        const bool at_zero = fabs(value) <= events_noise(instance, k);
        if (due != NULL && due[k]) {
            turn(instance, k);
        } else if (at_zero && !choose_side(instance, k)) {
            return arena_leave(mark, false);
        } else if (!at_zero && value < 0.0) {
            turn(instance, k);
        }
    }
    *turned = memcmp(before, switches_of(instance), N_SWITCHES * sizeof(double)) != 0;
    return arena_leave(mark, true);
}

/* Notes by how much event functions are below 0 although their modes hold, which is rounding: in a gap that opens, for
   one. */
static bool note_rests(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, values, SIZE_EVENTS);
    State *state = &instance->state;
    instance->cache.indicators_valid = false;
    if (!events_evaluate(instance, state->time, state->states, values)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < N_EVENTS; k++) {
        if (values[k] < 0.0 && values[k] > -HYSTERESIS * EVENT_NOMINALS[k]) {
            state->event_rests[k] = fmax(state->event_rests[k], -2.0 * values[k]);
        }
    }
    return arena_leave(mark, true);
}

/* Turns switches as settle_switches does. Contacts open whose gaps jump up with them; at the start all are open. */
static bool settle_rows(Instance *instance, const bool due[], bool *turned) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ZEROS(mark, double, gaps, SIZE_UNILATERALS);
    const bool may_jump = N_SWITCHES > 0 && due != NULL;
    if (may_jump) {
        contacts_gaps(instance, gaps);
    }
    return arena_leave(mark, settle_switches(instance, due, turned) &&
                                 (!may_jump || !*turned || contacts_jump(instance, gaps)));
}

bool events_settle(Instance *instance, const bool due[], bool *jumped) {
    static const bool NONE[SIZE_EVENTS] = {false};
    bool turned = true;
    *jumped = false;
    if (due != NULL && !contacts_undo_drift(instance, jumped)) {
        return false;
    }
    for (int round = 0; round < MOST_SWITCH_ROUNDS && turned; round++) {
        const bool *now = round == 0 ? due : NONE;
        bool moved = false, again = false;
        if (!settle_rows(instance, now, &turned) ||
            !contacts_settle(instance, now != NULL ? now + N_SWITCHES : NULL, &moved, &again)) {
            return false;
        }
        instance_forget_motion(instance); /* the modes of contacts may be others, with the same states */
        *jumped = *jumped || moved;
        turned = turned || again || (moved && N_SWITCHES > 0);
    }
    instance->state.modes_settled = 1;
    instance->state.event_held = 0;
    return note_rests(instance);
}

bool events_refresh(Instance *instance, bool *jumped) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, values, SIZE_EVENTS);
    WORK(mark, bool, due, SIZE_EVENTS);
    State *state = &instance->state;
    *jumped = false;
    if (state->modes_settled || state->phase == PHASE_SETTING_UP) {
        return arena_leave(mark, true);
    }
    if (state->phase == PHASE_SOLVING_START) {
        return arena_leave(mark, events_settle(instance, NULL, jumped));
    }
    if (!events_evaluate(instance, state->time, state->states, values)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < N_EVENTS; k++) {
        const double noise = events_noise(instance, k);
        due[k] = values[k] < -noise || (state->event_held && state->due[k] && values[k] <= noise);
    }
    return arena_leave(mark, events_settle(instance, due, jumped));
}

bool events_indicate(Instance *instance, double indicators[]) {
    const State *state = &instance->state;
    if (!events_evaluate(instance, state->time, state->states, indicators)) {
        return false;
    }
    for (int k = 0; k < N_EVENTS; k++) {
        indicators[k] += HYSTERESIS * EVENT_NOMINALS[k] + 2.0 * state->event_rests[k];
    }
    return true;
}

bool events_push_back(Instance *instance, int k, bool *pushed) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, margins, SIZE_SWITCHES);
    const State *state = &instance->state;
    double rise;
    *pushed = false;
    if (N_SWITCHES == 0 || k >= N_SWITCHES) {
        return arena_leave(mark, true);
    }
    const double side = switches_of(instance)[k];
    bool known = evaluate_margins(instance, state->time, state->states, margins);
    *pushed = known && fabs(margins[k]) <= 10.0 * HYSTERESIS * EVENT_NOMINALS[k] + events_noise(instance, k);
    for (int i = 0; i < 2 && *pushed; i++) {
        turn(instance, k);
        known = glance_ahead(instance, k, margins[k], &rise);
        *pushed = known && rise < -events_noise(instance, k);
    }
    if (switches_of(instance)[k] != side) {
        turn(instance, k);
    }
    return arena_leave(mark, known);
}

bool events_go_on(Instance *instance) {
    State *state = &instance->state;
    const bool soon = fabs(state->time - state->event_time) <= SLIVER * experiment_duration(state);
    bool pushed = false;
    state->events_there = soon ? state->events_there + 1 : 1;
    state->event_time = state->time;
    for (int k = 0; k < N_SWITCHES && state->events_there > MANY_EVENTS; k++) {
        if (!events_push_back(instance, k, &pushed)) {
            return false;
        }
        if (pushed) {
            instance->failure.kind = FAILURE_CHATTERING;
            instance->failure.time = state->time;
            instance->failure.event = k;
            return false;
        }
    }
    return true;
}
