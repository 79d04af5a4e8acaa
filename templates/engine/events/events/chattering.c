/* Places to which a motion is pushed back from both sides of a switch, so that there is no end of events. */
#include <math.h>

#include "event_noise.h"
#include "events.h"
#include "failure.h"
#include "margins.h"
#include "scale.h"
#include "settings.h"

/* The events of model exchange, one soon after another, after which pushing back from both sides is looked for. */
enum { MANY_EVENTS = 20 };

bool events_push_back(Instance *instance, int k, bool *pushed) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, margins, SIZE_SWITCHES);
    const State *state = &instance->state;
    double rise;
    *pushed = false;
    if (N_SWITCHES == 0 || k >= N_SWITCHES) {
        return arena_leave(mark, true);
    }
    const double side = margins_switches(instance)[k];
    bool known = margins_evaluate(instance, state->time, state->states, margins);
    *pushed = known && fabs(margins[k]) <= 10.0 * HYSTERESIS * EVENT_NOMINALS[k] + events_noise(instance, k);
    for (int i = 0; i < 2 && *pushed; i++) {
        margins_turn(instance, k);
        known = margins_rise(instance, k, margins[k], &rise);
        *pushed = known && rise < -events_noise(instance, k);
    }
    if (margins_switches(instance)[k] != side) {
        margins_turn(instance, k);
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
            return report_event(instance, FAILURE_CHATTERING, state->time, k);
        }
    }
    return true;
}
