/* Steps under error control, and steps of one length. */
#include "integrator.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "contacts.h"
#include "dense_output.h"
#include "diagnosis.h"
#include "event_steps.h"
#include "inputs.h"
#include "notices.h"
#include "projection.h"
#include "scale.h"
#include "settings.h"
#include "solver_steps.h"
#include "step_control.h"
#include "step_size.h"
#include "watching.h"

static const double FARTHEST = 1000.0;       /* a solver step may pass so many communication steps */
static const double MOST_STEPS = 1e12;       /* the most steps of a fixed-step method in a communication step */
static const double NEAR_POLE = 1e6;         /* so many shortest steps before a pole of a force the run ends */
static const int64_t MOST_TRIALS = 10000000; /* the most trial steps of an adaptive method in a communication step */
static const int64_t SERIES = 20000;         /* so many trial steps make a series */
static const double IN_SLIPS = 0.4;          /* the part of the tolerance that errors of steps have then */
static const double STANDSTILL = 1e-5;       /* a series takes more than this part of the time that is left */

/* The time (s) up to which steps may go. It is beyond the end of the communication step only if the same inputs may
   well hold there: they do not if they move, and are not expected to if something was changed before this communication
   step. Where the equations contain the time, steps end with the communication step, because the importer's steps tell
   how fast things change. */
static double horizon_of(const Instance *instance, double end) {
    const State *state = &instance->state;
    if (TIME_DEPENDENT || METHOD.dense_order == 0 || !state->undisturbed || instance->scratch.inputs_move) {
        return end;
    }
    const double farthest = end + FARTHEST * larger(end - state->time, state->interrupted);
    return state->stop_time_defined ? larger(end, smaller(farthest, state->stop_time)) : farthest;
}

/* The states at a time (s) in the step of state->dense, on the constraints. */
static bool interpolate(Instance *instance, double time, double states[]) {
    bool moved;
    dense_states(&instance->state.dense, time, states);
    return project(instance, time, states, &moved);
}

/* Prepares interpolation for a step that goes beyond the communication point. In the middle of the step it is tried
   whether the interpolated states can be moved onto the constraints. If not, a shorter step is the remedy now; later
   there would be none. A shorter step is also the remedy where an event has cut the step `tried` while a contact slides
   in space: if the slip comes to rest there, rounding decides the direction of friction at the end of the step, and
   with it the interpolant. */
static bool prepare_interpolation(Instance *instance, Step tried, Step step) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    const bool cut = N_EVENTS > 0 && step.end < tried.end;
    if (cut && step.length > INSTANT * fabs(step.end) && contacts_slide_in_space(instance)) {
        instance->state.event_pending = 0;
        return arena_leave(mark, false);
    }
    return arena_leave(mark, dense_begin(instance, step) &&
                                 (N_CONSTRAINTS == 0 || interpolate(instance, step.end - 0.5 * step.length, states)));
}

bool integrator_catch_up(Instance *instance) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    State *state = &instance->state;
    if (instance->cache.states_behind) {
        if (!interpolate(instance, state->time, states)) {
            return arena_leave(mark, false);
        }
        memcpy(state->states, states, N_STATES * sizeof(double));
        instance->cache.states_behind = false;
    }
    return arena_leave(mark, true);
}

/* A step that fails however short (s) it is may be at the end of its mode: a square root, for one, has no value beyond
   the place where its switch turns. Passes such an event; returns false if there is none. */
static bool pass_event_ahead(Instance *instance, double shortest) {
    State *state = &instance->state;
    if (N_EVENTS == 0 || !events_at_hand(instance, 4.0 * shortest) || !pass_event(instance)) {
        return false;
    }
    state->next_step = step_waits(instance) ? 0.0 : first_step(instance);
    return true;
}

/* Is the solver just before a place where the event function `pole` has no bound, as a force whose lever vanishes?
   Nearer to this place rounding errors would decide how the motion goes on. -1 stands for no such function. */
static bool is_at_pole(Instance *instance, int pole, double shortest) {
    if (pole < 0 || !(instance->state.next_step < NEAR_POLE * shortest)) {
        return false;
    }
    instance->failure.kind = FAILURE_EVENT_POLE;
    instance->failure.time = instance->state.time;
    instance->failure.event = pole;
    return true;
}

/* The time at which a slip in space ends is as uncertain as the states, over their rates. So that it is right to about
   the tolerance in seconds, explicit methods keep their errors smaller before it; those of implicit ones are. */
static double step_tolerance(const Instance *instance) {
    const double tolerance = solver_tolerance(&instance->state);
    return METHOD.stability > 0.0 && contacts_slide_in_space(instance) ? IN_SLIPS * tolerance : tolerance;
}

/* The error of a trial step in units of the tolerance, HUGE_VAL if the step could not be computed. Above 1 the step
   is to be rejected and instance->failure holds the reason. */
static double try_step(Instance *instance, Step step) {
    int worst;
    begin_trial(instance, step);
    if (!solver_step(instance, step)) {
        return HUGE_VAL;
    }
    const double error = solver_error(instance, step, step_tolerance(instance), &worst);
    if (!(error <= 1.0)) {
        Failure *failure = &instance->failure;
        failure->kind = FAILURE_ACCURACY;
        failure->time = instance->state.time;
        failure->state = worst;
        failure->amount = error;
        failure->step = step.length;
    }
    return isfinite(error) ? error : HUGE_VAL;
}

/* Counts a trial step. There are too many in all, or in a series of them the time hardly goes on: *mark is the time (s)
   at its beginning. */
static bool count_trial(Instance *instance, int64_t *trials, double *mark) {
    const State *state = &instance->state;
    const double gain = state->time - *mark;
    const bool ends = ++*trials % SERIES == 0;
    const bool stands = ends && gain <= STANDSTILL * (instance->scratch.step_end - *mark);
    if (*trials <= MOST_TRIALS && !stands) {
        *mark = ends ? state->time : *mark;
        return true;
    }
    instance->failure.kind = stands ? FAILURE_STANDSTILL : FAILURE_TRIAL_COUNT;
    instance->failure.time = state->time;
    instance->failure.amount = (double)(stands ? SERIES : MOST_TRIALS);
    instance->failure.step = gain;
    instance->failure.event = events_latest(state, *mark);
    return false;
}

/* Adaptive steps to the end or beyond, with dense output for the one that goes beyond. Fails when the step would fall
   below 16 units in the last place of the time. */
static bool step_adaptively(Instance *instance) {
    State *state = &instance->state;
    const double end = instance->scratch.step_end, horizon = horizon_of(instance, end);
    bool rejected = false;
    int pole = -1;
    int64_t trials = 0;
    double mark = state->time;
    if (!(state->next_step > 0.0)) {
        state->next_step = state->settings[SETTING_STEP] > 0.0 ? state->settings[SETTING_STEP] : first_step(instance);
    }
    state->interrupted = larger(end - state->time, state->interrupted);
    while (step_goes_on(instance)) {
        const double shortest = SHORTEST_ROUNDINGS * DBL_EPSILON * larger(fabs(state->time), fabs(end));
        state->next_step = larger(state->next_step, shortest);
        if (!count_trial(instance, &trials, &mark)) {
            return false;
        }
        const Step tried = choose_step(instance, instance->scratch.step_end, horizon);
        Step step = tried;
        const double error = try_step(instance, step);
        if (error <= 1.0 && bring_back_result(instance, step) && end_at_event(instance, &step) &&
            (step.end <= instance->scratch.step_end || prepare_interpolation(instance, tried, step))) {
            propose(state, tried, error, rejected);
            watch_stiffness(instance, step);
            watch_vibrations(instance, step.length);
            accept_step(instance, step);
            watch_ranges(instance);
            state->ahead = step.end > instance->scratch.step_end;
            rejected = false;
            pole = -1;
            if (!state->ahead && !end_solver_step(instance)) {
                return false;
            }
        } else {
            rejected = true;
            propose_shorter(state, tried, error);
            pole = instance->failure.kind == FAILURE_EVENT_POLE ? instance->failure.event : pole;
            if (is_at_pole(instance, pole, shortest) ||
                (state->next_step < shortest && !pass_event_ahead(instance, shortest))) {
                return false;
            }
        }
    }
    return true;
}

/* Goes to the end of a communication step that is shorter than solvers and events can tell. Near time 0 the rounding of
   times is no bound for it: 1e-300 s is a step there. Powers of such a length, and the ratio of the next step to it,
   leave the range of numbers, and no root is found in it. What moves in LEAST_TIME is less than rounding of all that is
   not 0 already. So Euler's method follows it, the solver remembers its last step, and events wait for the next one. */
static bool creep(Instance *instance) {
    State *state = &instance->state;
    const double length = instance->scratch.step_end - state->time;
    for (int i = 0; i < N_STATES; i++) {
        state->states[i] += length * state->first_stage[i];
    }
    state->time = instance->scratch.step_end;
    return end_solver_step(instance);
}

/* Solver steps from the end of the last one to the end of the communication step or beyond. */
static bool go_on(Instance *instance) {
    const double left = instance->scratch.step_end - instance->state.time;
    return update_first_stage(instance) && (left < LEAST_TIME ? creep(instance) : step_adaptively(instance));
}

/* Goes on from where the solver is. If that is beyond the end, the states at the end can be interpolated. */
static bool integrate_adaptively(Instance *instance) {
    State *state = &instance->state;
    if (state->ahead && instance->scratch.inputs_move) {
        if (!integrator_catch_up(instance)) {
            return false;
        }
        state->ahead = state->event_pending = 0;
        state->first_stage_valid = 0;
    }
    if (state->ahead && state->dense.end <= instance->scratch.step_end) {
        state->time = state->dense.end;
        memcpy(state->states, state->dense.end_states, sizeof state->states);
        state->ahead = 0;
        instance->cache.states_behind = false;
        if (!end_solver_step(instance)) {
            return false;
        }
    }
    instance->cache.states_behind = false;
    if (!state->ahead && step_goes_on(instance) && !go_on(instance)) {
        return false;
    }
    instance->cache.states_behind = state->ahead != 0;
    return true;
}

/* One step, or the part of it that ends with an event. */
static bool take_step(Instance *instance, Step step) {
    begin_trial(instance, step);
    if (!solver_step(instance, step) || leaps_over_singularity(instance, step.length) ||
        !bring_back_result(instance, step) || !end_at_event(instance, &step)) {
        return false;
    }
    watch_stiffness(instance, step);
    accept_step(instance, step);
    watch_ranges(instance);
    return end_solver_step(instance);
}

/* A step of this length (s) to the next time (s), in parts if events come, or to where the communication step ends. */
static bool step_to(Instance *instance, double next, double length) {
    const Scratch *scratch = &instance->scratch;
    State *state = &instance->state;
    Step step = {length, next, false};
    do { /* until the step is no more than rounding */
        if (scratch->step_end < step.end) {
            step = (Step){scratch->step_end - state->time, scratch->step_end, false};
        }
        const double begun = state->time;
        if (!take_step(instance, step)) {
            return false;
        }
        step.length = state->time > begun ? step.end - state->time : step.length; /* an event at its beginning */
    } while (step.length > rounding_of_length(next) && step_goes_on(instance));
    if (!step_waits(instance)) {
        state->time = smaller(step.end, scratch->step_end);
    }
    return true;
}

/* The end (s) of step `i`, from 1, of `count` equal ones from state->grid_start to state->grid_end. */
static double grid_point(const State *state, double i, double count) {
    const double whole = state->grid_end - state->grid_start;
    return i < count ? state->grid_start + whole * (i / count) : state->grid_end;
}

/* Remembers the communication step that is divided into equal steps. Is it the rest of the last one, which ended early
   because the importer passes events? Then its rest is taken in the same steps as if it had not ended. */
static bool begin_grid(State *state, double end) {
    const bool rest = state->grid_start < state->time && fabs(end - state->grid_end) <= rounding_of_length(end);
    state->grid_start = rest ? state->grid_start : state->time;
    state->grid_end = end;
    return rest;
}

/* The first step (s) of the rest of a communication step, to the end of step *i of the grid. It begins in the middle of
   this step, or where this step begins. If no more than rounding is left, *i is beyond the last step. */
static double first_of_rest(State *state, double length, double count, double *i) {
    double next = grid_point(state, *i, count), last = state->grid_start;
    while (*i <= count && next - state->time <= rounding_of_length(next)) {
        last = next;
        next = grid_point(state, ++*i, count);
    }
    const bool begins = fabs(state->time - last) <= rounding_of_length(last);
    state->time = begins ? last : state->time;
    return begins ? length : next - state->time;
}

/* Equal steps to the end, as many as make them no longer than solver_step. Times are computed from the start of the
   communication step, so that they do not drift. */
static bool integrate_in_equal_steps(Instance *instance) {
    State *state = &instance->state;
    const double begun = state->time, end = instance->scratch.step_end;
    const bool rest = begin_grid(state, end);
    const double setting = state->settings[SETTING_STEP];
    const double longest = smaller(setting > 0.0 ? setting : DEFAULT_SOLVER_STEP, longest_step(state));
    const double span = end - state->grid_start;
    const double whole = span * (1.0 - INSTANT) - rounding_of_length(end); /* less: H = 10 h takes 10 steps */
    const double count = whole <= longest ? 1.0 : ceil(whole / longest);
    if (!(count <= MOST_STEPS)) {
        instance->failure.kind = FAILURE_STEP_COUNT;
        instance->failure.time = begun;
        instance->failure.amount = count;
        return false;
    }
    if (!update_first_stage(instance)) {
        return false;
    }
    if (end - begun < LEAST_TIME && !TIME_STEPPING) {
        return creep(instance);
    }
    double i = 1.0;
    const double length = span / count, first = rest ? first_of_rest(state, length, count, &i) : length;
    if (METHOD.variational) {
        watch_length(instance, length);
    }
    watch_vibrations(instance, length);
    for (double step = first; i <= count && step_goes_on(instance); i++, step = length) {
        if (!step_to(instance, grid_point(state, i, count), step)) {
            return false;
        }
    }
    return true;
}

/* The importer goes on from an event without having it passed: it is passed now. */
static bool begin_events(Instance *instance) {
    const State *state = &instance->state;
    const bool passes = state->event_held && state->event_pending;
    return !ENDS_AT_EVENTS || ((!passes || events_pass(instance)) && events_begin(instance));
}

bool integrate(Instance *instance, double end) {
    State *state = &instance->state;
    const bool adaptive = METHOD.error_order > 0;
    instance->failure.kind = FAILURE_NONE;
    instance->scratch.step_end = end;
    instance->scratch.events_passed = 0;
    begin_notices(instance);
    instance_forget_motion(instance);
    inputs_begin(instance);
    watch_motions(instance);
    const bool completed = begin_events(instance) &&
                           (adaptive ? integrate_adaptively(instance) : integrate_in_equal_steps(instance));
    if (completed) {
        state->event_held = step_waits(instance);
        state->time = state->event_held ? state->time : instance->scratch.step_end;
        const bool early = state->time < end; /* the rest of the communication step has the horizon of its beginning */
        state->interrupted = early ? state->interrupted : 0.0;
        state->undisturbed = early ? state->undisturbed : 1;
    }
    inputs_end(instance);
    keep_motions(&instance->state);
    return completed;
}

bool integrator_settle(Instance *instance) {
    begin_notices(instance);
    instance_forget_motion(instance);
    const bool settled = begin_events(instance);
    instance_forget_motion(instance);
    return settled;
}
