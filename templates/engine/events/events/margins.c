/* Margins of switches, and the event functions that they make together with those of contacts. */
#include "margins.h"

#include <math.h>
#include <string.h>

#include "contact_events.h"
#include "derivative.h"
#include "event_noise.h"
#include "events.h"
#include "failure.h"
#include "inputs.h"
#include "scale.h"
#include "settings.h"

double *margins_switches(Instance *instance) {
    return instance->state.parameters + N_MASKS;
}

bool margins_evaluate(Instance *instance, double time, const double states[], double margins[]) {
    mechanism_switches(time, states, inputs_at(instance, time), instance->state.parameters, margins);
    for (int k = 0; k < N_SWITCHES; k++) {
        if (!isfinite(margins[k])) {
            return report_event(instance, FAILURE_EVENT_VALUE, time, k);
        }
    }
    return true;
}

/* values[N_SWITCHES] of the margins, positive where the switches are on their sides. */
static bool evaluate_sides(Instance *instance, double time, const double states[], double values[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, margins, SIZE_SWITCHES);
    if (!margins_evaluate(instance, time, states, margins)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < N_SWITCHES; k++) {
        values[k] = margins_switches(instance)[k] * margins[k];
    }
    return arena_leave(mark, true);
}

bool events_evaluate(Instance *instance, double time, const double states[], double values[]) {
    return (N_SWITCHES == 0 || evaluate_sides(instance, time, states, values)) &&
           contacts_evaluate(instance, time, states, values + N_SWITCHES);
}

double events_size(const Instance *instance, int k) {
    return k < N_SWITCHES ? EVENT_NOMINALS[k] : instance->state.contact_sizes[k - N_SWITCHES];
}

double events_noise(const Instance *instance, int k) {
    return NOISE * events_size(instance, k) + instance->state.event_rests[k];
}

void events_take_rests(State *state) {
    if (state->event_pending) {
        memcpy(state->event_rests, state->pending_rests, sizeof state->event_rests);
    }
}

void margins_turn(Instance *instance, int k) {
    margins_switches(instance)[k] *= -1.0;
    instance->cache.least_pivots_valid = false; /* values that follow from the modes are outdated */
    instance_forget_motion(instance);
}

bool margins_rise(Instance *instance, int k, double from, double *rise) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, derivatives, N_STATES);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, margins, SIZE_SWITCHES);
    const State *state = &instance->state;
    const double duration = experiment_duration(state), noise = events_noise(instance, k);
    if (N_SWITCHES == 0 || !derivative_at(instance, state->time, state->states, derivatives)) {
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
        if (!margins_evaluate(instance, state->time + h, states, margins)) {
            return arena_leave(mark, false);
        }
        *rise = margins_switches(instance)[k] * (margins[k] - from);
        if (fabs(*rise) > noise) {
            return arena_leave(mark, true);
        }
    }
    return arena_leave(mark, true);
}

bool events_indicate(Instance *instance, double indicators[]) {
    const State *state = &instance->state;
    if (!events_evaluate(instance, state->time, state->states, indicators)) {
        return false;
    }
    for (int k = 0; k < N_EVENTS; k++) {
        indicators[k] += HYSTERESIS * events_size(instance, k) + 2.0 * state->event_rests[k];
    }
    return true;
}
