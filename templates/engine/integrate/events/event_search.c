/* The search for the first place in a trial step at which an event function comes down to 0. */
#include "event_search.h"

#include <float.h>
#include <math.h>

#include "dense_output.h"
#include "event_noise.h"
#include "events.h"
#include "failure.h"
#include "scale.h"
#include "settings.h"
#include "step_size.h"
#include "timed_switches.h"

/* A function that keeps half of its greatest value at all nodes is positive between them, too: its values at the nodes
   are within 0.25 of 0.75 in units of the greatest one, and the polynomial is within 2.1 * 0.25, because the sum
   of the magnitudes of Lagrange's polynomials is less than 2.1. */
static const double FAR = 0.5;

/* In units of rounding of the time: the least length of the first part of a step. One rounding is then a thousandth of
   the part, and event functions show in it. */
static const double FINEST = 1024.0;

/* The shortest part of a step in which event functions are taken for polynomials. */
static const double SHORTEST_PART = 1.0 / 64.0;

/* The greatest error of a root on the interpolant, in units of the width of the part of the step that shows it. */
static const double WRONG = 0.125;

/* A part is longer than the one before it by this factor at most. */
static const double GROWTH_OF_SEARCH = 4.0;

/* In units of its noise (event_noise.h): a margin of a switch that is greater has to be resolved by the nodes of the
   shortest parts of a step. If it turns more often than they show, the step is repeated with another length. */
static const double CLEAR = 1e3;

/* Sets values[k][i] to the event functions k at the node i of a part of the step in state->dense. With cubic,
   the states there are those of Hermite's cubic alone. */
static bool sample_node(Instance *instance, double from, double width, bool cubic, int i,
                        double values[][ROOT_NODES]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, at, SIZE_EVENTS);
    const Dense *dense = &instance->state.dense;
    const double theta = from + width * ROOT_PLACES[i], time = dense->start + theta * (dense->end - dense->start);
    if (cubic) {
        dense_cubic_states(dense, theta, states);
    } else {
        dense_states(dense, time, states);
    }
    if (!events_evaluate(instance, time, states, at)) {
        return arena_leave(mark, false);
    }
    for (int k = 0; k < N_EVENTS; k++) {
        values[k][i] = at[k];
    }
    return arena_leave(mark, true);
}

/* Sets values to the event functions at all nodes of a part of the step but the first one, which is known. */
static bool sample(Instance *instance, double from, double width, double values[][ROOT_NODES]) {
    for (int i = 1; i < ROOT_NODES; i++) {
        if (!sample_node(instance, from, width, false, i, values)) {
            return false;
        }
    }
    return true;
}

static double greatest_of(const double values[]) {
    double greatest = 0.0;
    for (int i = 0; i < ROOT_NODES; i++) {
        greatest = larger(greatest, fabs(values[i]));
    }
    return greatest;
}

/* Do the nodes show all functions? Those of rounding alone, as the gap of a contact that has just opened, show
   nothing in a shorter part either. */
static bool all_resolved(const Instance *instance, double values[][ROOT_NODES]) {
    for (int k = 0; k < N_EVENTS; k++) {
        if (!TIMED_SWITCHES[k] && !roots_resolved(values[k]) &&
            greatest_of(values[k]) > events_noise(instance, k)) {
            return false;
        }
    }
    return true;
}

/* Do the nodes of a shortest part show the margins of all switches, or is the step short? */
static bool switches_told(Instance *instance, double values[][ROOT_NODES]) {
    const Dense *dense = &instance->state.dense;
    if (METHOD.error_order == 0 || dense->end - dense->start <= SLIVER * experiment_duration(&instance->state)) {
        return true;
    }
    for (int k = 0; k < N_SWITCHES; k++) {
        if (!TIMED_SWITCHES[k] && greatest_of(values[k]) > CLEAR * events_noise(instance, k) &&
            !roots_resolved(values[k])) {
            return report_event(instance, FAILURE_CHATTERING, instance->state.time, k);
        }
    }
    return true;
}

/* Are all these numbers greater than the level? */
static bool all_above(const double numbers[], int count, double level) {
    bool above = true;
    for (int i = 0; i < count; i++) {
        above = above && numbers[i] > level;
    }
    return above;
}

/* Is the function 1 at all nodes, as one is that has no meaning in the present mode? */
static bool is_one(const double values[]) {
    bool one = true;
    for (int i = 0; i < ROOT_NODES && one; i++) {
        one = values[i] == 1.0;
    }
    return one;
}

/* Is a function with these values at the nodes far from 0 between them? A function that begins at 0 is so if it rises
   steadily, which its quotients by theta tell. */
static bool is_far(const double values[], double noise) {
    const bool leaves = fabs(values[0]) <= noise;
    double least = leaves ? values[ROOT_NODES - 1] : values[0], greatest = least;
    if (is_one(values)) {
        return true;
    }
    for (int i = 1; i < ROOT_NODES; i++) {
        const double value = leaves ? values[i] / ROOT_PLACES[i] : values[i];
        least = smaller(least, value);
        greatest = larger(greatest, value);
    }
    return least > FAR * greatest && least > 0.0 && roots_resolved(values);
}

/* Does this function of a contact begin at 0 and rise from there? An early root of its polynomial is then no event: the
   polynomial may dip below 0 by its own error if the function rises with a high power of the time, as a gap does when
   its last force has vanished. Margins of switches do not rise like that. */
static bool rises(int k, const double values[], double noise) {
    return k >= N_SWITCHES && fabs(values[0]) <= noise && values[1] > 0.0 && values[2] > 0.0;
}

/* Notes the descents in a part of the step in *found. Values that rounding of the time makes count as 0, too. Returns
   false if the part is too long: a function rises from 0, so that its first root is no event, and comes down later. */
static bool search_zero(const Instance *instance, double from, double width, double values[][ROOT_NODES],
                        Descents *found) {
    bool clear = true;
    const Dense *dense = &instance->state.dense;
    const double rounding = 2.0 * DBL_EPSILON * fabs(dense->end) * dense->rate / width; /* of theta */
    for (int k = 0; k < N_EVENTS; k++) {
        double bernstein[ROOT_NODES];
        if (TIMED_SWITCHES[k]) {
            continue;
        }
        found->theta[k] = NO_ROOT;
        if (found->left_out[k] || is_far(values[k], 0.0)) {
            continue;
        }
        roots_fit(values[k], bernstein);
        const double noise = events_noise(instance, k) + rounding * fabs(roots_slope(bernstein, 0.0));
        double root = all_above(bernstein, ROOT_NODES, noise) ? NO_ROOT : roots_first_descent(bernstein, noise);
        if (root < ROOT_PLACES[2] && rises(k, values[k], noise)) {
            const bool stays = all_above(values[k] + 1, ROOT_NODES - 1, 0.0);
            clear = clear && stays;
            root = stays ? NO_ROOT : root;
        }
        found->theta[k] = root <= 1.0 ? from + width * root : NO_ROOT;
        if (root <= 1.0 && (found->first < 0 || found->theta[k] < found->theta[found->first])) {
            found->first = k;
            found->slope = roots_slope(bernstein, root) / width;
            found->earliest = larger(found->theta[k] - WRONG * width, 0.0);
            found->latest = smaller(found->theta[k] + WRONG * width, from + width);
        }
    }
    return clear;
}

static bool all_positive(double values[][ROOT_NODES], int i) {
    bool positive = true;
    for (int k = 0; k < N_EVENTS; k++) {
        positive = positive && values[k][i] > 0.0;
    }
    return positive;
}

/* The first part of the step that is looked at: twice what has lately passed without an event, so that periodic events
   lie within. In a longer one a margin that turns often would look like one that turns seldom. In one that is little
   more than rounding of the times up to the step's end (s), all margins would look like 0. */
static double first_width(const Instance *instance, double start, double length, double end) {
    const State *state = &instance->state;
    const double calm = 2.0 * larger(state->event_gap, start - state->event_time);
    const double told = larger(calm, FINEST * DBL_EPSILON * fabs(end));
    return calm > 0.0 && told < length ? told / length : 1.0;
}

/* The roots of switches that depend on the time alone, between two times (s). Fails if there is no telling whether
   there are any, because these switches turn too often; a shorter step tells. */
static bool find_timed(Instance *instance, double from, double to, TimedRoots *timed) {
    if (!timed_first(instance, from, to, timed)) {
        return false;
    }
    if (timed->first >= 0 || timed->known >= to) {
        return true;
    }
    int last = 0;
    for (int k = N_SWITCHES - 1; k >= 0; k--) {
        last = TIMED_SWITCHES[k] ? k : last;
    }
    return report_event(instance, FAILURE_EVENT_POLE, timed->known, last);
}

bool far_from_events(Instance *instance, Step step, const double start[], bool *far) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ROWS(mark, double, values, SIZE_EVENTS, ROOT_NODES);
    dense_begin_cubic(instance, step);
    *far = GROWTH_OF_SEARCH * first_width(instance, instance->state.time, step.length, step.end) >= 1.0;
    /* The last node comes first: it shows most events. */
    for (int i = ROOT_NODES - 1; i > 0 && *far; i--) {
        if (!sample_node(instance, 0.0, 1.0, true, i, values)) {
            return arena_leave(mark, false);
        }
        *far = all_positive(values, i);
    }
    for (int k = 0; k < N_EVENTS && *far; k++) {
        values[k][0] = start[k];
        *far = TIMED_SWITCHES[k] || is_far(values[k], events_noise(instance, k));
    }
    if (*far) {
        TimedRoots timed;
        if (!find_timed(instance, instance->state.time, step.end, &timed)) {
            return arena_leave(mark, false);
        }
        *far = timed.first < 0;
    }
    return arena_leave(mark, true);
}

/* Adds the roots of switches that depend on the time alone. */
static void add_timed(const Dense *dense, const TimedRoots *timed, Descents *found) {
    const double length = dense->end - dense->start;
    for (int k = 0; k < N_SWITCHES && timed->first >= 0; k++) {
        if (TIMED_SWITCHES[k] && timed->roots[k] <= dense->end) {
            found->theta[k] = smaller((timed->roots[k] - dense->start) / length, 1.0);
        }
    }
    if (timed->first >= 0 && (found->first < 0 || found->theta[timed->first] < found->theta[found->first])) {
        found->first = timed->first;
        found->slope = timed->slopes[timed->first] * length;
        found->earliest = 0.0;
        found->latest = 1.0;
    }
}

bool find_descents(Instance *instance, const double start[], Descents *found) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_ROWS(mark, double, values, SIZE_EVENTS, ROOT_NODES);
    WORK_OF(mark, TimedRoots, timed);
    const Dense *dense = &instance->state.dense;
    double from = 0.0, width = first_width(instance, dense->start, dense->end - dense->start, dense->end);
    const double shortest = width * SHORTEST_PART;
    double most = 1.0;
    if (!find_timed(instance, dense->start, dense->end, timed)) {
        return arena_leave(mark, false);
    }
    found->first = -1;
    found->slope = 0.0;
    for (int k = 0; k < N_EVENTS; k++) {
        values[k][0] = start[k];
        found->theta[k] = NO_ROOT;
    }
    while (from < 1.0 && found->first < 0) {
        if (!sample(instance, from, width, values)) {
            return arena_leave(mark, false);
        }
        if (width > shortest && !all_resolved(instance, values)) {
            width *= 0.5;
            most = larger(width, SHORTEST_PART);
            continue;
        }
        if (width <= shortest && !switches_told(instance, values)) {
            return arena_leave(mark, false);
        }
        if (!search_zero(instance, from, width, values, found) && width > shortest) {
            found->first = -1;
            width *= 0.5;
            most = larger(width, SHORTEST_PART);
            continue;
        }
        from = width < 1.0 - from ? from + width : 1.0;
        for (int k = 0; k < N_EVENTS; k++) {
            values[k][0] = values[k][ROOT_NODES - 1];
        }
        width = smaller(smaller(GROWTH_OF_SEARCH * width, most), 1.0 - from);
    }
    add_timed(dense, timed, found);
    found->start = found->first >= 0 ? start[found->first] : 0.0;
    return arena_leave(mark, true);
}
