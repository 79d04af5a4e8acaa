/* The next time at which a switch turns that depends on nothing but the time: an importer's solver goes just so far. */
#include "timed_switches.h"

#include <float.h>
#include <math.h>

#include "event_noise.h"
#include "events.h"
#include "roots.h"
#include "settings.h"
#include "step_size.h"

enum { SIZE_SWITCHES = N_SWITCHES > 0 ? N_SWITCHES : 1, MOST_PARTS = 1000, MOST_CORRECTIONS = 8, MOST_ROUNDINGS = 20 };

/* The first part of the time to come that is looked at, in parts of the experiment; the next ones are longer. */
static const double FIRST_PART = 1e-9;
static const double GROWTH = 2.0;

/* Margins that are linear in the time. */
static double next_of_linear(Instance *instance) {
    const double t = instance->state.time;
    double values[SIZE_SWITCHES], later[SIZE_SWITCHES], next = HUGE_VAL;
    if (!switches_evaluate(instance, t, values) || !switches_evaluate(instance, t + 1.0, later)) {
        return HUGE_VAL;
    }
    for (int k = 0; k < N_SWITCHES; k++) {
        const double slope = later[k] - values[k];
        const double root = t - values[k] / slope;
        next = TIMED_SWITCHES[k] == 1 && slope < 0.0 && root > t && root < next ? root : next;
    }
    return next;
}

/* The time (s) near `root` at which the switch k turns, where it is 0 or, by rounding, just below. */
static double polished(Instance *instance, int k, double root, double slope) {
    double values[SIZE_SWITCHES], time = root, last = 0.0, last_value = 0.0;
    for (int i = 0; i < MOST_CORRECTIONS && switches_evaluate(instance, time, values) && values[k] != 0.0; i++) {
        slope = i > 0 && time != last && values[k] != last_value ? (values[k] - last_value) / (time - last) : slope;
        last = time;
        last_value = values[k];
        time -= values[k] / slope;
    }
    double further = DBL_EPSILON * fabs(time);
    for (int i = 0; i < MOST_ROUNDINGS && switches_evaluate(instance, time, values) && values[k] > 0.0; i++) {
        time += further;
        further *= 2.0;
    }
    return time;
}

/* Sets values[k][i] to the switches at the nodes of a part of the time. */
static bool sample(Instance *instance, double from, double width, double values[][ROOT_NODES]) {
    double at[SIZE_SWITCHES];
    for (int i = 0; i < ROOT_NODES; i++) {
        if (!switches_evaluate(instance, from + width * ROOT_PLACES[i], at)) {
            return false;
        }
        for (int k = 0; k < N_SWITCHES; k++) {
            values[k][i] = at[k];
        }
    }
    return true;
}

/* The first time (s) in a part at which a switch turns that is not linear in the time; HUGE_VAL if none does.
   *resolved: the nodes tell. */
static double next_in_part(Instance *instance, double from, double width, double values[][ROOT_NODES],
                           bool *resolved) {
    double next = HUGE_VAL, bernstein[ROOT_NODES];
    *resolved = true;
    for (int k = 0; k < N_SWITCHES && *resolved; k++) {
        if (TIMED_SWITCHES[k] != 2) {
            continue;
        }
        *resolved = roots_resolved(values[k]);
        roots_fit(values[k], bernstein);
        const double theta = roots_first_descent(bernstein, events_noise(instance, k));
        if (*resolved && theta <= 1.0) {
            const double root = from + width * theta;
            const double time = polished(instance, k, root, roots_slope(bernstein, theta) / width);
            next = smaller(next, theta > 0.0 && fabs(time - root) <= width ? time : root);
        }
    }
    return next;
}

static bool any_of_time(void) {
    bool any = false;
    for (int k = 0; k < N_SWITCHES; k++) {
        any = any || TIMED_SWITCHES[k] == 2;
    }
    return any;
}

/* Goes on in parts until the stop time. If there are too many of them, the answer is a time at which nothing happens,
   and from which the search goes on. */
double events_next_time(Instance *instance) {
    const double t = instance->state.time, duration = experiment_duration(&instance->state);
    const double linear = next_of_linear(instance), end = smaller(linear, t + duration);
    const double shortest = FIRST_PART * duration;
    double values[SIZE_SWITCHES][ROOT_NODES], from = t + shortest, width = shortest;
    if (!any_of_time()) {
        return linear;
    }
    for (int i = 0; i < MOST_PARTS; i++) {
        bool resolved;
        if (from >= end || !sample(instance, from, width, values)) {
            return linear;
        }
        const double next = next_in_part(instance, from, width, values, &resolved);
        if (!resolved && width > shortest) {
            width *= 0.5;
            continue;
        }
        if (next < HUGE_VAL) {
            return smaller(next, linear);
        }
        from += width;
        width *= GROWTH;
    }
    return from;
}
