/* Steps that end at events, and the passing of events. */
#include "event_steps.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "contact_events.h"
#include "contacts.h"
#include "dense_output.h"
#include "derivative.h"
#include "event_noise.h"
#include "event_search.h"
#include "events.h"
#include "failure.h"
#include "projection.h"
#include "scale.h"
#include "step_size.h"

/* Bounds: of secant steps to a root; of events at one time, beside two for each event function, from half of which on
   they count as a repetition; and of events in a communication step. Beyond the last two the run fails. */
enum { MOST_CORRECTIONS = 8, MOST_EVENTS_AT_ONCE = 20, MOST_EVENTS_IN_A_STEP = 1000000 };

/* The part of the time between two events that is expected at least until the next one. Two events that come one soon
   after another by chance say little about the next one. */
static const double LEAST_FALL = 0.25;

/* A part of the size of an event function. Where the function seems to come down to 0 and has more than this left at
   the end of the repeated step, it has a pole, not a root. Near a root a step leaves less by orders of magnitude, near
   a pole more. */
static const double POLE = 1e-3;

/* A step of fixed length is cut to CUT of it while its interpolant shows a root before EARLY of it, too early to be
   told. */
static const double CUT = 0.25, EARLY = 0.1;

/* Takes the step once more, with this length (s), and sets values[N_EVENTS] to the event functions at its end. */
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

/* Moves the end of the repeated step by a little (s), by the explicit midpoint rule, whose error is of third order. */
static bool shift_end(Instance *instance, Step *step, double shift, double values[]) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, slopes, N_STATES);
    Scratch *scratch = &instance->scratch;
    const double end = step->end + shift, *rates = scratch->new_derivatives;
    double *middle = scratch->stage_states;
    for (int i = 0; i < N_STATES; i++) {
        middle[i] = scratch->new_states[i] + 0.5 * shift * rates[i];
    }
    if (!derivative_at(instance, step->end + 0.5 * shift, middle, slopes)) {
        return arena_leave(mark, false);
    }
    for (int i = 0; i < N_STATES; i++) {
        scratch->new_states[i] += shift * slopes[i];
    }
    step->end = end;
    step->length = end - instance->state.time;
    return arena_leave(mark, derivative_at(instance, end, scratch->new_states, scratch->new_derivatives) &&
                                 bring_back_result(instance, *step) &&
                                 events_evaluate(instance, end, scratch->new_states, values));
}

/* Takes the step to another end. That of a variational method is repeated, because momenta belong to a whole step. */
static bool move_end(Instance *instance, Step *step, double length, double values[]) {
    const double shift = length - step->length;
    const bool little = fabs(shift) <= SLIVER * step->length && step->end + shift <= instance->scratch.step_end;
    return little && !METHOD.variational ? shift_end(instance, step, shift, values)
                                         : repeat(instance, step, length, values);
}

/* Repeats the step until the first function is 0 at its end, by secant steps from the root on its interpolant. A root
   at the beginning of the step stays there. Secants lead astray where the function is rounding: they stay
   where all functions were looked at. values[N_EVENTS] are the event functions at the end. */
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
        length = smaller(larger(length - values[k] / slope, found->earliest * whole), found->latest * whole);
        if (found->theta[k] <= 0.0 || !(fabs(length - last_length) > rounding) ||
            fabs(last_value) <= NOISE * events_size(instance, k)) {
            break;
        }
    }
    return true;
}

/* Is the value of the event function k at the end of the step no more than what rounding of the states makes of it? A
   stiff spring makes a force of this rounding which stays above 0 however often the step is repeated. */
static bool is_rounding_of_states(Instance *instance, Step step, int k, double value) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, values, SIZE_EVENTS);
    double rounding = 0.0;
    memcpy(states, instance->scratch.new_states, N_STATES * sizeof(double));
    for (int i = 0; i < N_STATES; i++) {
        const double kept = states[i];
        states[i] += 2.0 * DBL_EPSILON * kept;
        if (!events_evaluate(instance, step.end, states, values)) {
            return arena_leave(mark, false);
        }
        rounding += fabs(values[k] - value);
        states[i] = kept;
    }
    return arena_leave(mark, value <= rounding);
}

/* Notes which events are due at the end of the step, which had the length `whole` (s) before: those of functions that
   came down there together. Conditions on one quantity do so at once, however far rounding of the time leaves it from
   0. If the step is no longer than this rounding, the first function is due whatever its value: no shorter step tells
   its root better. A slip in space that comes to rest, for one, is never nearer to 0 than the solver's errors. A
   function that only jumps there, with friction that turns round, leaves no rest. */
static void note_due(Instance *instance, const Descents *found, Step step, double whole, const double values[]) {
    State *state = &instance->state;
    const int first = found->first;
    const double shortest = 4.0 * DBL_EPSILON * fabs(step.end), rounding = shortest * fabs(found->slope) / whole;
    const bool first_due = values[first] <= events_noise(instance, first) + rounding || step.length <= shortest ||
                           is_rounding_of_states(instance, step, first, values[first]);
    for (int k = 0; k < N_EVENTS; k++) {
        const double noise = events_noise(instance, k);
        const bool with_first = first_due && fabs(found->theta[k] - found->theta[first]) * whole <= shortest;
        const bool came_down = found->theta[k] < NO_ROOT && (values[k] <= noise || with_first);
        const bool jumped = k != first && values[k] < -LOCATED * events_size(instance, k);
        state->due[k] = came_down || values[k] < -noise;
        state->pending_rests[k] = state->due[k] && !jumped ? 4.0 * fabs(values[k]) : state->event_rests[k];
        state->event_pending = state->event_pending || state->due[k];
    }
}

/* Fails because the function that seemed to come down is not 0 there. It changes its sign through infinity, as a force
   does whose lever vanishes. A shorter step may end before that, or tell the root better. */
static bool report_pole(Instance *instance, int k) {
    instance->state.event_pending = 0;
    return report_event(instance, FAILURE_EVENT_POLE, instance->state.time, k);
}

/* An event at the beginning of a step, of this length (s) before it was repeated, that has just been passed there
   several times is one of the interpolant alone, whose error in a long step is greater than what a gap opens by, or
   which does not show all roots of a margin that turns often. A shorter step tells, unless both sides push the motion
   back. */
static bool seems_to_repeat(Instance *instance, const Descents *found, Step step, double whole) {
    const State *state = &instance->state;
    const double shortest = 4.0 * DBL_EPSILON * fabs(step.end);
    bool pushed;
    if (METHOD.error_order == 0 || step.length > shortest || state->events_there < MOST_EVENTS_AT_ONCE / 2 ||
        fabs(state->time - state->event_time) > shortest || whole <= 1e3 * shortest ||
        !events_push_back(instance, found->first, &pushed) || pushed) {
        return false;
    }
    return !report_event(instance, FAILURE_CHATTERING, state->time, found->first);
}

/* Cuts a step of fixed length at whose beginning one event has just been passed several times. Its interpolant is not
   exact enough to tell how a contact leaves 0 there: a foot that is lifted for less than a step seems to sink at once.
   A shorter step tells whether and when it comes back. */
static bool cut_repetition(Instance *instance, const double start[], Step *step, Descents *found) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, values, SIZE_EVENTS);
    const State *state = &instance->state;
    const double shortest = 4.0 * DBL_EPSILON * fabs(step->end);
    if (METHOD.error_order > 0 || state->events_there < MOST_EVENTS_AT_ONCE / 2 ||
        fabs(state->time - state->event_time) > shortest) {
        return arena_leave(mark, true);
    }
    while (N_EVENTS > N_SWITCHES && found->first >= N_SWITCHES && found->theta[found->first] < EARLY &&
           step->length > 1e3 * shortest) {
        if (!repeat(instance, step, CUT * step->length, values) || !dense_begin(instance, *step) ||
            !find_descents(instance, start, found)) {
            return arena_leave(mark, false);
        }
    }
    return arena_leave(mark, true);
}

/* Is the margin of a switch not near 0 where its root was looked for? A long step of a stiff motion passes over the
   transient in which the root lies. Shorter steps tell. */
static bool is_lost(Instance *instance, const Descents *found, Step step, const double values[], double whole) {
    const int k = found->first;
    const double shortest = 4.0 * DBL_EPSILON * fabs(step.end);
    const double rounding = events_noise(instance, k) + shortest * fabs(found->slope) / whole;
    if (METHOD.error_order == 0 || N_SWITCHES == 0 || k >= N_SWITCHES || whole <= 1e3 * shortest ||
        fabs(values[k]) <= POLE * fabs(found->start) + rounding) {
        return false;
    }
    return !report_event(instance, FAILURE_CHATTERING, instance->state.time, k);
}

/* Ends the step at its beginning if an event is overdue there and none has just been passed. */
static bool stop_overdue(Instance *instance, Step *step, const double start[], bool *overdue) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, values, SIZE_EVENTS);
    State *state = &instance->state;
    const int which = state->event_time >= state->time ? -1 : contacts_overdue(instance, start);
    *overdue = which >= 0;
    if (which < 0) {
        return arena_leave(mark, true);
    }
    for (int k = 0; k < N_EVENTS; k++) {
        state->due[k] = k == N_SWITCHES + which;
    }
    memcpy(state->pending_rests, state->event_rests, sizeof state->event_rests);
    state->event_pending = 1;
    return arena_leave(mark, repeat(instance, step, 0.0, values));
}

/* Leaves switches out of the search in this step whose margins have stayed at 0 through several events here, as the
   velocity of a foot that a latch holds: the interpolant falls on either side of 0, by its error. Where both sides push
   the motion back there is an event. */
static bool leave_out_held(Instance *instance, Step step, const double start[], bool left_out[]) {
    const State *state = &instance->state;
    const bool again = state->events_there >= MOST_EVENTS_AT_ONCE / 2 &&
                       fabs(state->time - state->event_time) <= 4.0 * DBL_EPSILON * fabs(step.end);
    for (int k = 0; k < N_EVENTS; k++) {
        bool pushed = false;
        left_out[k] = again && k < N_SWITCHES && fabs(start[k]) <= AT_REST * events_size(instance, k);
        if (left_out[k] && !events_push_back(instance, k, &pushed)) {
            return false;
        }
        left_out[k] = left_out[k] && !pushed;
    }
    return true;
}

/* The first descent in a trial step, by shared loads of least norm. Where these seem to break the laws, there may be
   others that obey them: the search begins again with those that are farthest from the limits. A change from the ones
   to the others within a step would be a jump. */
static bool find_first(Instance *instance, const Step *step, double start[], Descents *found) {
    if (!dense_begin(instance, *step) || !find_descents(instance, start, found)) {
        return false;
    }
    if (found->first < 0 || !instance->scratch.loads_shared) {
        return true;
    }
    instance->shown_loads = LOADS_CENTRED;
    return events_evaluate(instance, instance->state.time, instance->state.states, start) &&
           find_descents(instance, start, found);
}

/* Is another function the first one that comes down? It is where the first one has no root, but a jump that the other
   makes: beyond the rest of a slip in space its friction would turn round, and all forces with it. It is, too, where
   the first one is rounding, and its root is found beyond that of the other. values[N_EVENTS]: at the end of the
   step. */
static bool follows_another(const Instance *instance, Descents *found, const double start[], const double values[]) {
    const int first = found->first;
    const bool jumps = fabs(values[first]) > POLE * (fabs(found->start) + events_size(instance, first));
    double least = found->latest;
    int other = -1;
    for (int k = 0; k < N_EVENTS; k++) {
        const bool passed = values[k] < -LOCATED * events_size(instance, k);
        if (k != first && found->theta[k] > 0.0 && found->theta[k] <= least && (jumps || passed)) {
            other = k;
            least = found->theta[k];
        }
    }
    if (other < 0) {
        return false;
    }
    found->theta[first] = NO_ROOT;
    found->first = other;
    found->start = start[other];
    found->slope = -found->start / least;
    return true;
}

/* In units of rounding of the time: a step no longer than this, or one of fixed length, tells a jump from a pole; and
   by how much a step ends behind a jump, so that rounding of the states does not lead back before it. */
static const double BRIEF = 1e8, CLEARLY_BEHIND = 64.0;

/* A part of the greatest value that tells whether a function is bounded: before a pole it grows by much more. */
static const double GROWN = 100.0;

/* Ends the step where its first function jumps down through 0, by bisection: a force does so at a kink that solver
   steps may pass, as where the point at which a capsule touches comes to the end of its axis. Returns whether it does:
   before a pole it would grow. */
static bool ends_at_jump(Instance *instance, const Descents *found, Step *step, double whole, double values[]) {
    const int k = found->first;
    const double rounding = DBL_EPSILON * fmax(fabs(step->end), whole); /* > 0 where the step ends at time 0, too */
    const bool fixed = METHOD.error_order == 0 && !contacts_slide_in_space(instance);
    double before = 0.0, behind = whole, above = found->start;
    if (!(fixed || whole <= BRIEF * rounding) || !repeat(instance, step, whole, values) || values[k] > 0.0) {
        return false;
    }
    const double most = GROWN * (fabs(found->start) + fabs(values[k]) + events_size(instance, k));
    while (behind - before > CLEARLY_BEHIND * rounding) {
        const double middle = 0.5 * (before + behind);
        if (!repeat(instance, step, middle, values)) {
            return false;
        }
        if (values[k] > 0.0) {
            before = middle;
            above = values[k];
        } else {
            behind = middle;
        }
    }
    return above <= most && repeat(instance, step, smaller(behind + CLEARLY_BEHIND * rounding, whole), values);
}

/* Ends the step at the first root that was found. start[N_EVENTS] are the event functions at the beginning of the step,
   values[N_EVENTS] those at its end. */
static bool end_at_root(Instance *instance, Descents *found, Step *step, const double start[], double values[]) {
    const double whole = step->length;
    do {
        if (!polish(instance, found, step, values) || seems_to_repeat(instance, found, *step, whole) ||
            is_lost(instance, found, *step, values, whole)) {
            return false;
        }
    } while (follows_another(instance, found, start, values));
    if (fabs(values[found->first]) > POLE * (fabs(found->start) + events_size(instance, found->first)) &&
        !ends_at_jump(instance, found, step, whole, values)) {
        return report_pole(instance, found->first); /* before it is taken for what an event has left */
    }
    note_due(instance, found, *step, whole, values);
    return true;
}

/* In units of how far an event function was from 0 at its last event: one that is greater has left 0. */
static const double RISEN = 100.0;

/* Forgets what was left of event functions that have left 0 since. A gap that has opened would close as far inside, and
   leave more each time. start[N_EVENTS]: their values where the step begins. */
static void forget_left(State *state, const double start[]) {
    for (int k = 0; k < N_EVENTS; k++) {
        state->event_rests[k] = start[k] > RISEN * state->event_rests[k] ? 0.0 : state->event_rests[k];
    }
}

/* events_end_step, with event functions of the loads in instance->shown_loads. */
static bool end_step(Instance *instance, Step *step) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Descents, found);
    WORK(mark, double, start, SIZE_EVENTS);
    WORK(mark, double, values, SIZE_EVENTS);
    State *state = &instance->state;
    bool overdue = false, far = false;
    state->event_pending = 0;
    if (!contacts_oppose(instance, state->time, state->states, NULL) ||
        !events_evaluate(instance, state->time, state->states, start) ||
        !stop_overdue(instance, step, start, &overdue) ||
        (DENSE_ROWS > 0 && !overdue && !far_from_events(instance, *step, start, &far))) {
        return arena_leave(mark, false);
    }
    forget_left(state, start);
    if (far || overdue) {
        return arena_leave(mark, true);
    }
    if (!leave_out_held(instance, *step, start, found->left_out) || !find_first(instance, step, start, found) ||
        !cut_repetition(instance, start, step, found)) {
        return arena_leave(mark, false);
    }
    return arena_leave(mark, found->first < 0 || end_at_root(instance, found, step, start, values));
}

bool events_end_step(Instance *instance, Step *step) {
    instance->shown_loads = LOADS_LEAST;
    instance->scratch.loads_shared = false;
    const bool known = end_step(instance, step);
    instance->shown_loads = LOADS_BY_MARGIN;
    return known;
}

bool events_at_hand(Instance *instance, double span) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    WORK(mark, double, values, SIZE_EVENTS);
    State *state = &instance->state;
    for (int i = 0; i < N_STATES; i++) {
        states[i] = state->states[i] + span * state->first_stage[i];
    }
    if (!events_evaluate(instance, state->time + span, states, values)) {
        return arena_leave(mark, false);
    }
    state->event_pending = 0;
    const int slipping = contacts_slipping(instance);
    for (int k = 0; k < N_EVENTS; k++) {
        state->due[k] = values[k] <= 0.0 || (slipping >= 0 && k == N_SWITCHES + slipping);
        state->pending_rests[k] = values[k] <= 0.0 ? 4.0 * fabs(values[k]) : state->event_rests[k];
        state->event_pending = state->event_pending || state->due[k];
    }
    return arena_leave(mark, state->event_pending != 0);
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
    if (!same) {
        state->event_gap = larger(state->time - state->event_time, LEAST_FALL * state->event_gap);
    }
    state->events_there = same ? state->events_there + 1 : 1;
    state->event_time = state->time;
    if (state->events_there <= MOST_EVENTS_AT_ONCE + 2 * N_EVENTS) {
        return true;
    }
    const int last = events_latest(state, state->time), latest = last > 0 ? last : 0;
    bool pushed = true;
    const bool known = latest >= N_SWITCHES || events_push_back(instance, latest, &pushed);
    const FailureKind kind = known && pushed ? FAILURE_CHATTERING : FAILURE_EVENT_POLE;
    return report_event(instance, kind, state->time, latest);
}

/* Lets the solver forget what it knows of the equations before the event. */
static void start_anew(Instance *instance) {
    instance->state.first_stage_valid = 0;
    solver_forget(&instance->state.solver, CHANGED_STATE);
}

/* Counts the events of a communication step, the number of which bounds the work in it. */
static bool count_in_step(Instance *instance) {
    if (++instance->scratch.events_passed <= MOST_EVENTS_IN_A_STEP) {
        return true;
    }
    const int last = events_latest(&instance->state, instance->state.time);
    instance->failure.amount = (double)MOST_EVENTS_IN_A_STEP;
    return report_event(instance, FAILURE_EVENT_COUNT, instance->state.time, last > 0 ? last : 0);
}

bool events_pass(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, bool, due, SIZE_EVENTS);
    State *state = &instance->state;
    bool jumped;
    for (int k = 0; k < N_EVENTS; k++) {
        due[k] = state->due[k] != 0;
    }
    events_take_rests(state);
    state->event_pending = 0;
    if (!count_event(instance) || !count_in_step(instance) || !events_settle(instance, due, &jumped)) {
        return arena_leave(mark, false);
    }
    start_anew(instance);
    return arena_leave(mark, true);
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
