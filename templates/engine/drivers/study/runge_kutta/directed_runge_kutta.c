/* Directions through steps of an explicit Runge-Kutta method, stage by stage. */
#include <math.h>
#include <string.h>

#include "directed_steps.h"
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

bool directions_follow(Variations *variations, Step step) {
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

bool directions_have_slope(void) {
    return TABLEAU.first_same_as_last;
}

double directions_error(Variations *variations, int d, Step step, double tolerance) {
    const ArenaMark mark = arena_mark(variations->study.instance.arena);
    const Direction *direction = &variations->directions[d];
    WORK(mark, double, estimate, N_STATES);
    WORK(mark, double, other, N_STATES);
    const double rounding = direction_rounding(variations, direction);
    double error = 0.0, second = 0.0;
    tableau_errors(step.length, (Stages)direction->stages, estimate, other);
    for (int i = 0; i < N_STATES; i++) {
        const double size = larger(fabs(direction->states[i]), fabs(direction->new_states[i]));
        const double usual = tolerance * (size + NOMINAL_STATES[i] / direction->scale);
        const double unit = 1.0 / (usual + rounding * NOMINAL_STATES[i]);
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

bool directions_within(Variations *variations, Step step) {
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
