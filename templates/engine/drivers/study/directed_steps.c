/* Steps of the motion and its derivatives by the explicit Runge-Kutta method, with one control of both errors. */
#include <math.h>
#include <string.h>

#include "adaptive_steps.h"
#include "directions.h"
#include "event_steps.h"
#include "inputs.h"
#include "notices.h"
#include "projection.h"
#include "settings.h"
#include "solver_steps.h"
#include "step_size.h"
#include "tableau.h"

/* The directions through the stages of the trial step that the instance has just made, from one up to another. */
static bool take_stages(Variations *variations, Step step, int first, int end) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, states, N_STATES);
    const Instance *instance = &variations->study.instance;
    const State *state = &instance->state;
    for (int i = first; i < end; i++) {
        const double time = TABLEAU.c[i] == 1.0 ? step.end : state->time + TABLEAU.c[i] * step.length;
        tableau_states(i, step.length, state->states, (Stages)instance->scratch.solver.stages, states);
        for (int d = 0; d < variations->count; d++) {
            Direction *direction = &variations->directions[d];
            tableau_states(i, step.length, direction->states, (Stages)direction->stages, direction->seed.states);
        }
        if (!directions_evaluate(variations, time, states)) {
            return arena_leave(mark, false);
        }
        for (int d = 0; d < variations->count; d++) {
            memcpy(variations->directions[d].stages[i], variations->directions[d].rates, N_STATES * sizeof(double));
        }
    }
    return arena_leave(mark, true);
}

/* The directions through that trial step. */
static bool step_directions(Variations *variations, Step step) {
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->stages[0], direction->slope, sizeof direction->slope);
        memcpy(direction->new_states, direction->states, sizeof direction->states);
        memcpy(direction->new_slope, direction->slope, sizeof direction->slope);
    }
    if (!(step.length > 0.0)) {
        return true;
    }
    if (!take_stages(variations, step, 1, TABLEAU.stages)) {
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        if (TABLEAU.first_same_as_last) {
            memcpy(direction->new_states, direction->seed.states, sizeof direction->new_states);
            memcpy(direction->new_slope, direction->rates, sizeof direction->new_slope);
        } else {
            tableau_states(STAGES, step.length, direction->states, (Stages)direction->stages, direction->new_states);
        }
    }
    return true;
}

/* The error of one direction in units of the tolerance, as that of the states: see solver_error. */
static double direction_error(Arena *arena, const Direction *direction, Step step, double tolerance) {
    const ArenaMark mark = arena_mark(arena);
    WORK(mark, double, estimate, N_STATES);
    WORK(mark, double, other, N_STATES);
    double error = 0.0, second = 0.0;
    tableau_errors(step.length, (Stages)direction->stages, estimate, other);
    for (int i = 0; i < N_STATES; i++) {
        const double size = larger(fabs(direction->states[i]), fabs(direction->new_states[i]));
        const double unit = 1.0 / (tolerance * (size + NOMINAL_STATES[i] / direction->scale));
        if (!isfinite(estimate[i])) {
            arena_release(mark);
            return HUGE_VAL;
        }
        error = larger(error, unit * fabs(estimate[i]));
        second = larger(second, unit * fabs(other[i]));
    }
    const double ratio = 0.1 * second / error;
    arena_release(mark);
    return second > 0.0 && error > 0.0 ? error / sqrt(1.0 + ratio * ratio) : error;
}

/* The derivatives through the trial step of the motion; *error: the greatest of theirs. */
static bool follow_motion(void *of, Step step, double *error) {
    Variations *variations = of;
    Instance *instance = &variations->study.instance;
    *error = 0.0;
    if (!step_directions(variations, step)) {
        return false;
    }
    for (int d = 0; d < variations->count && *error <= 1.0; d++) {
        const double own = direction_error(instance->arena, &variations->directions[d], step,
                                           solver_tolerance(&instance->state));
        *error = larger(*error, own);
    }
    return true;
}

/* The derivatives at the end of a good step: on the constraints, with their slopes. */
static bool finish_directions(void *of, Step tried, Step step) {
    Variations *variations = of;
    const double *states = variations->study.instance.scratch.new_states;
    if (step.end != tried.end && !step_directions(variations, step)) {
        return false;
    }
    if ((N_CONSTRAINTS == 0 && TABLEAU.first_same_as_last) || !(step.length > 0.0)) {
        return true;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->seed.states, direction->new_states, sizeof direction->new_states);
    }
    if (!directions_project(variations, step.end, states) || !directions_evaluate(variations, step.end, states)) {
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->new_states, direction->seed.states, sizeof direction->new_states);
        memcpy(direction->new_slope, direction->rates, sizeof direction->new_slope);
    }
    return true;
}

/* The interpolant of one direction in the step, as dense_begin makes that of the states. */
static void begin_dense(Direction *direction, const Dense *motion, Step step) {
    Dense *dense = &direction->dense;
    dense->start = motion->start;
    dense->end = motion->end;
    dense->rate = motion->rate;
    memcpy(dense->states, direction->states, sizeof dense->states);
    for (int i = 0; i < N_STATES; i++) {
        dense->terms[0][i] = direction->new_states[i] - direction->states[i];
        dense->terms[1][i] = step.length * direction->slope[i] - dense->terms[0][i];
        dense->terms[2][i] = dense->terms[0][i] - step.length * direction->new_slope[i] - dense->terms[1][i];
    }
    tableau_dense(step.length, (Stages)direction->stages, dense->terms);
}

/* Samples at the times within the step, which is about to be accepted. */
static bool sample_within(Variations *variations, Step step) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    WORK(mark, double, states, N_STATES);
    Instance *instance = &variations->study.instance;
    const Request *request = variations->request;
    const Dense *dense = &instance->state.dense;
    if (variations->next >= request->n_times || !(request->times[variations->next] < step.end)) {
        return arena_leave(mark, true);
    }
    if (!dense_begin(instance, step) || !take_stages(variations, step, TABLEAU.stages, STAGES)) {
        return arena_leave(mark, false);
    }
    for (int d = 0; d < variations->count; d++) {
        begin_dense(&variations->directions[d], dense, step);
    }
    for (; variations->next < request->n_times && request->times[variations->next] < step.end; variations->next++) {
        const double time = request->times[variations->next];
        dense_states(dense, time, states);
        for (int d = 0; d < variations->count; d++) {
            dense_states(&variations->directions[d].dense, time, variations->directions[d].seed.states);
        }
        if (!directions_sample(variations, time, states)) {
            return arena_leave(mark, false);
        }
    }
    return arena_leave(mark, true);
}

static bool accept_directions(void *of, Step step) {
    Variations *variations = of;
    if (!sample_within(variations, step)) {
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->states, direction->new_states, sizeof direction->states);
        memcpy(direction->slope, direction->new_slope, sizeof direction->slope);
    }
    return true;
}

static bool pass_with_motion(void *of) {
    return directions_pass(of);
}

bool directions_begin_stretch(Variations *variations, double end) {
    Instance *instance = &variations->study.instance;
    instance->failure.kind = FAILURE_NONE;
    instance->scratch.step_end = end;
    begin_notices(instance);
    instance_forget_motion(instance);
    inputs_begin(instance);
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->seed.states, direction->states, sizeof direction->states);
    }
    return (!ENDS_AT_EVENTS || events_begin(instance)) && update_first_stage(instance) &&
           directions_settle(variations);
}

bool directions_integrate(Variations *variations, double end) {
    const Companion derivatives = {variations, follow_motion, finish_directions, accept_directions,
                                   pass_with_motion};
    if (!directions_begin_stretch(variations, end) || !adaptive_steps(&variations->study.instance, end, &derivatives)) {
        return false;
    }
    inputs_end(&variations->study.instance);
    return true;
}
