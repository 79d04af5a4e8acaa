/* Communication steps, by steps under error control or steps of one length. */
#include "integrator.h"

#include <math.h>
#include <string.h>

#include "contacts.h"
#include "diagnosis.h"
#include "event_steps.h"
#include "failure.h"
#include "inputs.h"
#include "notices.h"
#include "projection.h"
#include "scale.h"
#include "settings.h"
#include "solver_steps.h"
#include "step_size.h"
#include "watching.h"

/* In communication steps: how far a solver step may go beyond the end of the present one. */
static const double FARTHEST = 1000.0;

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

/* Steps under error control, if the inputs may well hold there to beyond the end. */
static bool step_adaptively(Instance *instance) {
    State *state = &instance->state;
    const double end = instance->scratch.step_end, horizon = horizon_of(instance, end);
    state->interrupted = larger(end - state->time, state->interrupted);
    return adaptive_steps(instance, horizon, NULL);
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
static bool take_step(Instance *instance, const Companion *with, Step step) {
    const Step tried = step;
    double error; /* nobody controls it */
    begin_trial(instance, step);
    if (!update_first_stage(instance) || !solver_step(instance, step) ||
        (with != NULL && !with->follow(with->of, step, &error)) || leaps_over_singularity(instance, step.length) ||
        !bring_back_result(instance, step) || passes_kink(instance, step) || !end_at_event(instance, &step) ||
        (with != NULL && (!with->finish(with->of, tried, step) || !with->accept(with->of, step)))) {
        return false;
    }
    watch_stiffness(instance, step);
    accept_step(instance, step);
    watch_ranges(instance);
    return with != NULL ? !instance->state.event_pending || with->pass(with->of) : end_solver_step(instance);
}

/* Halves a step that failed while a contact slides in space. Where its slip comes to rest, friction would turn round in
   the step, which an implicit method seldom solves and a Rosenbrock method does not locate. Shorter steps end before
   that, and the slip comes down to a speed that is at rest. */
static bool halve_before_rest(Instance *instance, Step *step) {
    const FailureKind kind = instance->failure.kind;
    const double least = SLIVER * SLIVER * experiment_duration(&instance->state);
    const bool unsolved = kind == FAILURE_ITERATION || kind == FAILURE_NOT_FINITE || kind == FAILURE_OVERFLOW;
    if (!ENDS_AT_EVENTS || !(unsolved || kind == FAILURE_EVENT_POLE) || !(step->length > least) ||
        !contacts_slide_in_space(instance)) {
        return false;
    }
    instance->failure.kind = FAILURE_NONE;
    instance->state.solver = instance->scratch.solver_before;
    step->length *= 0.5;
    step->end = instance->state.time + step->length;
    return true;
}

/* A step of this length (s) to the next time (s), in parts if events come, or to where the communication step ends. */
static bool step_to(Instance *instance, const Companion *with, double next, double length) {
    const Scratch *scratch = &instance->scratch;
    State *state = &instance->state;
    Step step = {length, next};
    do { /* until the step is no more than rounding */
        if (scratch->step_end < step.end) {
            step = (Step){scratch->step_end - state->time, scratch->step_end};
        }
        const double begun = state->time;
        Step part = step;
        while (!take_step(instance, with, part)) {
            if (!halve_before_rest(instance, &part)) {
                return false;
            }
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

/* Times are computed from the start of the communication step, so that they do not drift. */
bool integrate_in_equal_steps(Instance *instance, const Companion *with) {
    State *state = &instance->state;
    const double begun = state->time, end = instance->scratch.step_end;
    const bool rest = begin_grid(state, end);
    const double setting = state->settings[SETTING_STEP];
    const double longest = smaller(setting > 0.0 ? setting : DEFAULT_SOLVER_STEP, longest_step(state));
    const double span = end - state->grid_start;
    const double whole = span * (1.0 - INSTANT) - rounding_of_length(end); /* less: H = 10 h takes 10 steps */
    const double count = whole <= longest ? 1.0 : ceil(whole / longest);
    if (!(count <= (double)MOST_SOLVER_STEPS)) {
        return report_amount(instance, FAILURE_STEP_COUNT, begun, count);
    }
    if (!update_first_stage(instance)) {
        return false;
    }
    if (end - begun < LEAST_TIME && !TIME_STEPPING) {
        return creep(instance);
    }
    double i = 1.0;
    const double length = count > 1.0 ? span / count : span; /* one step waits for no division */
    const double first = rest ? first_of_rest(state, length, count, &i) : length;
    if (METHOD.variational) {
        watch_length(instance, length);
    }
    watch_vibrations(instance, length);
    for (double step = first; i <= count && step_goes_on(instance); i++, step = length) {
        if (!step_to(instance, with, grid_point(state, i, count), step)) {
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
                           (adaptive ? integrate_adaptively(instance) : integrate_in_equal_steps(instance, NULL));
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
