/* Switches: the kinks of the equations of motion. A switch is +1 or -1, the sign of its margin; within a mode it keeps
   that value, so that the equations are smooth. */
#include <math.h>
#include <string.h>

#include "contact_events.h"
#include "event_noise.h"
#include "events.h"
#include "margins.h"
#include "scale.h"
#include "settings.h"

/* Bound of the rounds in which switches, impacts and modes of contacts settle at one event. */
enum { MOST_SWITCH_ROUNDS = 100 };

/* How fast the margin of a switch that is 0 rises on its side; 0 where the motion has no values there, as that of
   if(x > 0, 1/x, 0) has none at 0. *has_values: whether it has. */
static bool rise_from_zero(Instance *instance, int k, double *rise, bool *has_values) {
    const FailureKind *kind = &instance->failure.kind;
    *has_values = margins_rise(instance, k, 0.0, rise);
    if (*has_values || (*kind != FAILURE_NOT_FINITE && *kind != FAILURE_FURTHER)) {
        return *has_values;
    }
    *rise = 0.0;
    instance->failure.kind = FAILURE_NONE; /* if no side has values, the start says so */
    return true;
}

/* Chooses the side of a switch whose margin is 0: the side to which the motion goes if the switch is on this side. */
static bool choose_side(Instance *instance, int k) {
    bool has_values[2];
    for (int attempt = 0; attempt < 2; attempt++) {
        double rise;
        if (!rise_from_zero(instance, k, &rise, &has_values[attempt])) {
            return false;
        }
        if (rise > events_noise(instance, k)) {
            return true;
        }
        margins_turn(instance, k);
    }
    if (has_values[1] && !has_values[0]) {
        margins_turn(instance, k);
    }
    return true; /* neither side is confirmed, or the margin stays at 0: the side stays as it was, if it has values */
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
    return arena_leave(mark, margins_evaluate(instance, state->time, state->states, margins) &&
                                 margins_evaluate(instance, state->time + h, states, onward));
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
        const double margin = margins_switches(instance)[k] * (fabs(margins[k]) > noise ? margins[k] : onward[k]);
        if (margin < -noise) {
            margins_turn(instance, k);
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
    memcpy(before, margins_switches(instance), N_SWITCHES * sizeof(double));
    for (int k = 0; k < N_SWITCHES; k++) {
        if (!margins_evaluate(instance, state->time, state->states, margins)) {
            return arena_leave(mark, false);
        }
        const double value = margins_switches(instance)[k] * margins[k];
        const bool at_zero = fabs(value) <= events_noise(instance, k);
        if (due != NULL && due[k]) {
            margins_turn(instance, k);
        } else if (at_zero && !choose_side(instance, k)) {
            return arena_leave(mark, false);
        } else if (!at_zero && value < 0.0) {
            margins_turn(instance, k);
        }
    }
    *turned = memcmp(before, margins_switches(instance), N_SWITCHES * sizeof(double)) != 0;
    return arena_leave(mark, true);
}

/* Notes how far event functions are below 0 although their modes hold, as a gap is that opens: that is rounding, and
   counts as 0. */
static bool note_rests(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, values, SIZE_EVENTS);
    State *state = &instance->state;
    instance->cache.indicators_valid = false;
    if (!events_evaluate(instance, state->time, state->states, values)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < N_EVENTS; k++) {
        if (values[k] < 0.0 && values[k] > -HYSTERESIS * events_size(instance, k)) {
            state->event_rests[k] = fmax(state->event_rests[k], -2.0 * values[k]);
        }
    }
    return arena_leave(mark, true);
}

/* Turns switches by settle_switches, and opens contacts whose gaps jump up with them; at the start all are open. */
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
    if (state->event_held) {
        events_take_rests(state);
    }
    for (int k = 0; k < N_EVENTS; k++) {
        const double noise = events_noise(instance, k);
        due[k] = values[k] < -noise || (state->event_held && state->due[k] && values[k] <= noise);
    }
    return arena_leave(mark, events_settle(instance, due, jumped));
}
