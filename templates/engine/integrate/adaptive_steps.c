/* The adaptive loop: trial steps, their errors, what ends them, and why there may be no more of them. */
#include "adaptive_steps.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "contacts.h"
#include "dense_output.h"
#include "event_steps.h"
#include "failure.h"
#include "projection.h"
#include "scale.h"
#include "settings.h"
#include "solver_steps.h"
#include "step_control.h"
#include "step_size.h"
#include "watching.h"

/* In units of the shortest step, which is some roundings of the time: before a pole of a force the run ends when steps
   become shorter than this. Rounding of the time is then no longer negligible beside the way to the pole. */
static const double NEAR_POLE = 1e6;

/* The greatest number of trial steps in a communication step. */
static const int64_t MOST_TRIALS = 10000000;

/* Trial steps of a series, and the least part of the rest of the communication step that a series has to gain. At this
   pace the rest would take 2e9 trial steps, far more than MOST_TRIALS. */
static const int64_t SERIES = 20000;
static const double STANDSTILL = 1e-5;

/* The part of the tolerance that steps may err by while a contact slides in space, see step_tolerance. */
static const double IN_SLIPS = 0.4;

bool interpolate(Instance *instance, double time, double states[]) {
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

/* Passes the event that the present point is at, if it is at one. */
static bool pass_here(Instance *instance, const Companion *with) {
    return with != NULL ? !instance->state.event_pending || with->pass(with->of) : pass_event(instance);
}

/* A step that fails however short (s) it is may be at the end of its mode: a square root, for one, has no value beyond
   the place where its switch turns, and feet that stick may slip where they get a lever. Passes such an event; returns
   false if there is none. */
static bool pass_event_ahead(Instance *instance, const Companion *with, double shortest) {
    State *state = &instance->state;
    if (N_EVENTS == 0 || !events_at_hand(instance, 4.0 * shortest) || !pass_here(instance, with)) {
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
    return !report_event(instance, FAILURE_EVENT_POLE, instance->state.time, pole);
}

/* Passes the place where a force of contact has no bound: an impact stops the slip that takes the force its lever.
   `pole` is its event function, or -1. Derivatives do not pass it. An importer that passes events itself gets no second
   one at that time: where no impact changes anything they would have no end. Returns false, with the failure as it is,
   where nothing slides or no such impact changes anything. */
static bool pass_pole(Instance *instance, const Companion *with, int pole) {
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, before, N_STATES);
    State *state = &instance->state;
    const Failure failure = instance->failure;
    const bool awaited = instance->listener.awaits_events, again = awaited && state->event_time >= state->time;
    if (with != NULL || again || !contacts_sliding(instance)) {
        return arena_leave(mark, false);
    }
    state->event_time = awaited ? state->time : state->event_time;
    for (int k = 0; k < N_EVENTS; k++) {
        state->due[k] = k == pole;
    }
    memcpy(before, state->states, N_STATES * sizeof(double));
    memcpy(state->pending_rests, state->event_rests, sizeof state->event_rests);
    state->jams = state->event_pending = 1;
    instance->failure.kind = FAILURE_NONE;
    const bool passed = pass_event(instance);
    if (!passed || (!step_waits(instance) && !memcmp(before, state->states, N_STATES * sizeof(double)))) {
        instance->failure = failure;
        return arena_leave(mark, false);
    }
    state->next_step = step_waits(instance) ? 0.0 : first_step(instance);
    return arena_leave(mark, true);
}

/* The relative tolerance of a step. The time at which a slip in space ends is uncertain by the errors of the states
   over their rates. So that it is right to about the tolerance in seconds, explicit methods keep their errors smaller
   before it; the errors of implicit methods are smaller by themselves. */
static double step_tolerance(const Instance *instance) {
    const double tolerance = solver_tolerance(&instance->state);
    return METHOD.stability > 0.0 && contacts_slide_in_space(instance) ? IN_SLIPS * tolerance : tolerance;
}

/* The error of a trial step in units of the tolerance, HUGE_VAL if the step could not be computed. Above 1 the step
   is to be rejected and instance->failure holds the reason. */
static double try_step(Instance *instance, const Companion *with, Step step) {
    int worst;
    begin_trial(instance, step);
    if (!solver_step(instance, step)) {
        return HUGE_VAL;
    }
    double error = solver_error(instance, step, step_tolerance(instance), &worst), other = 0.0;
    if (with != NULL && error <= 1.0) {
        if (!with->follow(with->of, step, &other)) {
            return HUGE_VAL;
        }
        error = larger(error, other);
    }
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

/* Did a step fail at a kink that is as short as a SLIVER of the experiment? Shorter steps do not help at a kink; a
   longer step may seem to pass one. */
static bool is_at_kink(const Instance *instance, Step step) {
    return instance->failure.kind == FAILURE_KINK && step.length <= SLIVER * experiment_duration(&instance->state);
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

/* May the good trial step be accepted? See prepare_interpolation, and for what goes with the motion Companion. */
static bool finish_trial(Instance *instance, const Companion *with, Step tried, Step step) {
    return with != NULL ? with->finish(with->of, tried, step)
                        : step.end <= instance->scratch.step_end || prepare_interpolation(instance, tried, step);
}

/* The good trial step becomes a step of the motion. */
static bool accept_trial(Instance *instance, const Companion *with, Step step) {
    State *state = &instance->state;
    watch_stiffness(instance, step);
    watch_vibrations(instance, step.length);
    if (with != NULL && !with->accept(with->of, step)) {
        return false;
    }
    accept_step(instance, step);
    watch_ranges(instance);
    state->ahead = step.end > instance->scratch.step_end;
    return state->ahead || (with != NULL ? pass_here(instance, with) : end_solver_step(instance));
}

bool adaptive_steps(Instance *instance, double horizon, const Companion *with) {
    State *state = &instance->state;
    const double end = instance->scratch.step_end;
    bool rejected = false, cut_short;
    int pole = -1;
    int64_t trials = 0;
    double mark = state->time;
    if (METHOD.error_order > 0 && !(state->next_step > 0.0)) {
        state->next_step = state->settings[SETTING_STEP] > 0.0 ? state->settings[SETTING_STEP] : first_step(instance);
    }
    while (METHOD.error_order > 0 && step_goes_on(instance)) { /* nothing is compiled for methods of one step length */
        const double shortest = SHORTEST_ROUNDINGS * DBL_EPSILON * larger(fabs(state->time), fabs(end));
        state->next_step = larger(state->next_step, shortest);
        if (!count_trial(instance, &trials, &mark)) {
            return false;
        }
        const Step tried = choose_step(instance, instance->scratch.step_end, horizon, &cut_short);
        Step step = tried;
        const double error = try_step(instance, with, step);
        const bool ends = error <= 1.0 && bring_back_result(instance, step) && !passes_kink(instance, step) &&
                          end_at_event(instance, &step);
        pole = ends ? -1 : instance->failure.kind == FAILURE_EVENT_POLE ? instance->failure.event : pole;
        if (ends && finish_trial(instance, with, tried, step)) {
            propose(state, tried, cut_short, error, rejected);
            rejected = false;
            if (!accept_trial(instance, with, step)) {
                return false;
            }
        } else {
            rejected = true;
            propose_shorter(state, tried, error);
            const bool stands = state->next_step < shortest || is_at_kink(instance, step);
            const bool at_pole = is_at_pole(instance, pole, shortest);
            if ((at_pole || (stands && !pass_event_ahead(instance, with, shortest))) &&
                !pass_pole(instance, with, at_pole ? pole : -1)) {
                return false;
            }
            pole = at_pole ? -1 : pole;
        }
    }
    return true;
}
