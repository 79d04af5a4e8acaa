/* Steps that end at events, and what happens there. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "dense_output.h"
#include "event_noise.h"
#include "equations.h"
#include "events.h"
#include "projection.h"
#include "roots.h"
#include "step_size.h"

enum { MOST_CORRECTIONS = 8, MOST_EVENTS_AT_ONCE = 20, MOST_EVENTS_IN_A_STEP = 1000000 };

/* A function that keeps this part of its greatest value at the nodes is far from 0 between them, too: the sum of
   Lagrange's polynomials is less than 2.1. */
static const double FAR = 0.5;
static const double LITTLE = 1e-6; /* of a step's length, by which its end is moved without repeating it */
static const double NO_ROOT_THERE = 1e-3; /* of a function's size, that is left of it where it seemed to be 0 */
static const double SHORTEST_PART = 1.0 / 64.0; /* of a step, in which event functions are taken for polynomials */

/* Where the event functions come down in a trial step: theta of its length, NO_ROOT for those that do not; the first
   one, and its slope there by theta. */
typedef struct {
    double theta[SIZE_EVENTS];
    int first;
    double slope;
    double start; /* its value where the step begins */
} Descents;

/* values[k][i] of the event functions at the node i of a part of the step in state->dense, or of its cubic alone. */
static bool sample_node(Instance *instance, double from, double width, bool cubic, int i,
                        double values[][ROOT_NODES]) {
    const Dense *dense = &instance->state.dense;
    const double theta = from + width * ROOT_PLACES[i], time = dense->start + theta * (dense->end - dense->start);
    double states[N_STATES], at[SIZE_EVENTS];
    if (cubic) {
        dense_cubic_states(dense, theta, states);
    } else {
        dense_states(dense, time, states);
    }
    if (!events_evaluate(instance, time, states, at)) {
        return false;
    }
    for (int k = 0; k < N_EVENTS; k++) {
        values[k][i] = at[k];
    }
    return true;
}

/* The same at all nodes of a part of the step; the first one is known. */
static bool sample(Instance *instance, double from, double width, double values[][ROOT_NODES]) {
    for (int i = 1; i < ROOT_NODES; i++) {
        if (!sample_node(instance, from, width, false, i, values)) {
            return false;
        }
    }
    return true;
}

static bool all_resolved(double values[][ROOT_NODES]) {
    for (int k = 0; k < N_EVENTS; k++) {
        if (!roots_resolved(values[k])) {
            return false;
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

/* Does the function mean nothing in the present mode? */
static bool is_one(const double values[]) {
    bool one = true;
    for (int i = 0; i < ROOT_NODES && one; i++) {
        one = values[i] == 1.0;
    }
    return one;
}

/* Is a function with these values at the nodes far from 0 between them? One that leaves 0 is so if it rises steadily:
   its quotients by theta are taken. */
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
    return least > FAR * greatest && least > 0.0 && (leaves || roots_resolved(values));
}

/* Does a function of a contact that begins at 0 rise from there, so that an early root may be none? The polynomial may
   dip below 0 by its own error, where the function rises with a high power of the time, as a gap does from which the
   last force has vanished. Margins of switches do not rise like that. */
static bool rises(int k, const double values[], double noise) {
    return k >= N_SWITCHES && fabs(values[0]) <= noise && values[1] > 0.0 && values[2] > 0.0;
}

/* The descents in a part of the step, into *found. Rounding of the time counts as 0, too. Returns false where the part
   is too long to tell: a function rises from 0, so that its first root is none, and comes down later. */
static bool search(const Instance *instance, double from, double width, double values[][ROOT_NODES],
                   Descents *found) {
    bool clear = true;
    const Dense *dense = &instance->state.dense;
    const double rounding = 2.0 * DBL_EPSILON * fabs(dense->end) * dense->rate / width; /* of the time, in the part */
    for (int k = 0; k < N_EVENTS; k++) {
        double bernstein[ROOT_NODES];
        found->theta[k] = NO_ROOT;
        if (is_far(values[k], 0.0)) {
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

/* Are all functions, which begin with start[N_EVENTS], so far from 0 on Hermite's cubic that a better interpolant makes
   no difference? Most steps end with this question. Of the nodes the last one comes first: it shows most events. */
static bool far_from_events(Instance *instance, Step step, const double start[], bool *far) {
    double values[SIZE_EVENTS][ROOT_NODES];
    dense_begin_cubic(instance, step);
    *far = true;
    for (int i = ROOT_NODES - 1; i > 0 && *far; i--) {
        if (!sample_node(instance, 0.0, 1.0, true, i, values)) {
            return false;
        }
        *far = all_positive(values, i);
    }
    for (int k = 0; k < N_EVENTS && *far; k++) {
        values[k][0] = start[k];
        *far = is_far(values[k], events_noise(instance, k));
    }
    return true;
}

/* Goes through the step from its beginning, in parts in which the event functions are like polynomials, to the first
   part with a descent. The functions begin with start[N_EVENTS]. found->first is -1 if there is none. */
static bool find_descents(Instance *instance, const double start[], Descents *found) {
    double values[SIZE_EVENTS][ROOT_NODES];
    double from = 0.0, width = 1.0;
    found->first = -1;
    found->slope = 0.0;
    for (int k = 0; k < N_EVENTS; k++) {
        values[k][0] = start[k];
    }
    while (from < 1.0 && found->first < 0) {
        if (!sample(instance, from, width, values)) {
            return false;
        }
        if (width > SHORTEST_PART && !all_resolved(values)) {
            width *= 0.5;
            continue;
        }
        if (!search(instance, from, width, values, found) && width > SHORTEST_PART) {
            found->first = -1;
            width *= 0.5;
            continue;
        }
        from += width;
        for (int k = 0; k < N_EVENTS; k++) {
            values[k][0] = values[k][ROOT_NODES - 1];
        }
    }
    found->start = found->first >= 0 ? start[found->first] : 0.0;
    return true;
}

/* The event functions after the step, which is taken once more with its present length. */
static bool repeat(Instance *instance, Step *step, double length, double values[]) {
    State *state = &instance->state;
    step->end = state->time + length;
    step->length = step->end - state->time;
    state->solver = instance->scratch.solver_before;
    if (step->length > 0.0) {
        return solver_step(instance, *step) && bring_back_result(instance, *step) &&
               events_evaluate(instance, step->end, instance->scratch.new_states, values);
    }
    memcpy(instance->scratch.new_states, state->states, sizeof state->states);
    memcpy(instance->scratch.new_derivatives, state->first_stage, sizeof state->first_stage);
    return events_evaluate(instance, state->time, state->states, values);
}

/* Moves the end of the repeated step by a little (s): by the explicit midpoint rule, the error of which is of third
   order. */
static bool shift_end(Instance *instance, Step *step, double shift, double values[]) {
    Scratch *scratch = &instance->scratch;
    const double end = step->end + shift, *rates = scratch->new_derivatives;
    double *middle = scratch->stage_states, slopes[N_STATES];
    for (int i = 0; i < N_STATES; i++) {
        middle[i] = scratch->new_states[i] + 0.5 * shift * rates[i];
    }
    if (!equations_derivative(instance, step->end + 0.5 * shift, middle, slopes)) {
        return false;
    }
    for (int i = 0; i < N_STATES; i++) {
        scratch->new_states[i] += shift * slopes[i];
    }
    step->end = end;
    step->length = end - instance->state.time;
    return equations_derivative(instance, end, scratch->new_states, scratch->new_derivatives) &&
           bring_back_result(instance, *step) && events_evaluate(instance, end, scratch->new_states, values);
}

/* Takes the step to another end. Momenta of a variational method belong to the whole step. */
static bool move_end(Instance *instance, Step *step, double length, double values[]) {
    const double shift = length - step->length;
    const bool little = fabs(shift) <= LITTLE * step->length && step->end + shift <= instance->scratch.step_end;
    return little && !METHOD.variational ? shift_end(instance, step, shift, values)
                                         : repeat(instance, step, length, values);
}

/* Repeats the step until the first function is 0 at its end, by secant steps from the root on its interpolant; at the
   beginning of the step it is where it is.
   values[N_EVENTS]: at that end. */
static bool polish(Instance *instance, const Descents *found, Step *step, double values[]) {
    const double whole = step->length, rounding = DBL_EPSILON * fabs(step->end);
    const int k = found->first;
    double length = found->theta[k] * whole, slope = found->slope / whole;
    double last_length = 0.0, last_value = 0.0;
    for (int i = 0; i < MOST_CORRECTIONS; i++) {
        if (!(i == 0 ? repeat(instance, step, length, values) : move_end(instance, step, length, values))) {
            return false;
        }
        if (i > 0 && fabs(length - last_length) > rounding && values[k] != last_value) {
            slope = (values[k] - last_value) / (length - last_length);
        }
        last_length = length;
        last_value = values[k];
        length = smaller(larger(length - values[k] / slope, 0.0), whole);
        if (found->theta[k] <= 0.0 || !(fabs(length - last_length) > rounding) ||
            fabs(last_value) <= DBL_EPSILON * EVENT_NOMINALS[k]) {
            break;
        }
    }
    return true;
}

/* Is what is left of the event function k (its value after the step) no more than rounding of the states makes of it?
   A stiff spring turns that into a force which stays above 0, however often the step is repeated. */
static bool is_rounding_of_states(Instance *instance, Step step, int k, double value) {
    double states[N_STATES], values[SIZE_EVENTS], rounding = 0.0;
    memcpy(states, instance->scratch.new_states, sizeof states);
    for (int i = 0; i < N_STATES; i++) {
        const double kept = states[i];
        states[i] += 2.0 * DBL_EPSILON * kept;
        if (!events_evaluate(instance, step.end, states, values)) {
            return false;
        }
        rounding += fabs(values[k] - value);
        states[i] = kept;
    }
    return value <= rounding;
}

/* Notes which events are due at the end of the step: those of functions that came down there together. Where the step
   is no longer than rounding of the time, no shorter one tells the first of them better: a slip in space that comes to
   rest is never nearer to 0 than the solver's errors are. */
static void note_due(Instance *instance, const Descents *found, Step step, const double values[]) {
    State *state = &instance->state;
    const double shortest = 4.0 * DBL_EPSILON * fabs(step.end), rounding = shortest * fabs(found->slope);
    for (int k = 0; k < N_EVENTS; k++) {
        const double noise = events_noise(instance, k);
        const bool came_down = found->theta[k] <= 1.0 && values[k] <= noise;
        const bool first_due = k == found->first && (values[k] <= noise + rounding || step.length <= shortest ||
                                                     is_rounding_of_states(instance, step, k, values[k]));
        state->due[k] = came_down || values[k] < -noise || first_due;
        state->event_rests[k] = state->due[k] ? 4.0 * fabs(values[k]) : state->event_rests[k];
        state->event_pending = state->event_pending || state->due[k];
    }
}

/* The function that seemed to come down is not 0 there: it changes its sign through infinity, as a force does whose
   lever vanishes. A shorter step may end before that, or tell the root better. */
static bool report_pole(Instance *instance, int k) {
    instance->state.event_pending = 0;
    instance->failure.kind = FAILURE_EVENT_POLE;
    instance->failure.time = instance->state.time;
    instance->failure.event = k;
    return false;
}

bool events_end_step(Instance *instance, Step *step) {
    Descents found;
    State *state = &instance->state;
    double start[SIZE_EVENTS], values[SIZE_EVENTS];
    bool far = false;
    state->event_pending = 0;
    if (!events_evaluate(instance, state->time, state->states, start) ||
        (DENSE_ROWS > 0 && !far_from_events(instance, *step, start, &far))) {
        return false;
    }
    if (far) {
        return true;
    }
    if (!dense_begin(instance, *step) || !find_descents(instance, start, &found)) {
        return false;
    }
    if (found.first >= 0) {
        const double whole = step->length;
        if (!polish(instance, &found, step, values)) {
            return false;
        }
        found.slope /= whole;
        note_due(instance, &found, *step, values);
        if (fabs(values[found.first]) > NO_ROOT_THERE * (fabs(found.start) + EVENT_NOMINALS[found.first])) {
            return report_pole(instance, found.first);
        }
    }
    return true;
}

bool events_at_hand(Instance *instance, double span) {
    State *state = &instance->state;
    double states[N_STATES], values[SIZE_EVENTS];
    for (int i = 0; i < N_STATES; i++) {
        states[i] = state->states[i] + span * state->first_stage[i];
    }
    if (!events_evaluate(instance, state->time + span, states, values)) {
        return false;
    }
    state->event_pending = 0;
    for (int k = 0; k < N_EVENTS; k++) {
        state->due[k] = values[k] <= 0.0;
        state->event_rests[k] = state->due[k] ? 4.0 * fabs(values[k]) : state->event_rests[k];
        state->event_pending = state->event_pending || state->due[k];
    }
    return state->event_pending != 0;
}

int events_latest(const State *state, double since) {
    int latest = -1;
    for (int k = N_EVENTS - 1; k >= 0 && state->event_time >= since; k--) {
        latest = state->due[k] ? k : latest;
    }
    return latest;
}

/* Counts events at one time; there are too many if modes do not settle. */
static bool count_event(Instance *instance) {
    State *state = &instance->state;
    const bool same = fabs(state->time - state->event_time) <= 4.0 * DBL_EPSILON * fabs(state->time);
    state->events_there = same ? state->events_there + 1 : 1;
    state->event_time = state->time;
    if (state->events_there <= MOST_EVENTS_AT_ONCE + 2 * N_EVENTS) {
        return true;
    }
    instance->failure.kind = FAILURE_CHATTERING;
    instance->failure.time = state->time;
    instance->failure.event = (int)larger(events_latest(state, state->time), 0);
    return false;
}

/* What the solver knows belongs to the equations before the event. */
static void start_anew(Instance *instance) {
    instance->state.first_stage_valid = 0;
    solver_forget(&instance->state.solver, false);
}

/* Counts the events of a communication step, the number of which bounds the work in it. */
static bool count_in_step(Instance *instance) {
    if (++instance->scratch.events_passed <= MOST_EVENTS_IN_A_STEP) {
        return true;
    }
    instance->failure.kind = FAILURE_EVENT_COUNT;
    instance->failure.time = instance->state.time;
    instance->failure.amount = (double)MOST_EVENTS_IN_A_STEP;
    return false;
}

bool events_pass(Instance *instance) {
    State *state = &instance->state;
    bool due[SIZE_EVENTS];
    bool jumped;
    for (int k = 0; k < N_EVENTS; k++) {
        due[k] = state->due[k] != 0;
    }
    state->event_pending = 0;
    if (!count_event(instance) || !count_in_step(instance) || !events_settle(instance, due, &jumped)) {
        return false;
    }
    start_anew(instance);
    return true;
}

bool events_begin(Instance *instance) {
    const bool settled = instance->state.modes_settled != 0;
    bool jumped;
    if (!events_refresh(instance, &jumped)) {
        return false;
    }
    if (!settled) {
        start_anew(instance);
    }
    return true;
}
