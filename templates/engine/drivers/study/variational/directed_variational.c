/* Directions through steps of a variational method: those of the implicit function that step_points.h describes. */
#include <string.h>

#include "collocation.h"
#include "contacts.h"
#include "directed_steps.h"
#include "lu.h"
#include "step_points.h"

/* Adds what slides at a stage to the places of accelerations, which no further rate needs. */
static bool rub_stage(Variations *variations, const StepPoint *point) {
    Instance *instance = &variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, unknowns, N_UNKNOWNS);
    if (!step_unknowns(instance, point, unknowns)) {
        return arena_leave(mark, false);
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        step_rub(instance, point, unknowns, &direction->seed, direction->stages[point->place] + N);
    }
    return arena_leave(mark, true);
}

/* Further rates, and in the places of accelerations forces of what slides, at all stages for unknowns that do not
   change. */
static bool rate_stages(Variations *variations, Step step) {
    for (int i = 0; i < S && N_FURTHER > 0; i++) {
        const StepPoint point = step_point(&variations->study.instance, step, 1 + i);
        for (int d = 0; d < variations->count; d++) {
            Direction *direction = &variations->directions[d];
            step_seed(&point, direction->states, direction->seed.states);
        }
        if (!directions_evaluate(variations, point.time, point.states)) {
            return false;
        }
        for (int d = 0; d < variations->count; d++) {
            memcpy(variations->directions[d].stages[i], variations->directions[d].rates, N_STATES * sizeof(double));
            memset(variations->directions[d].stages[i] + N, 0, N * sizeof(double));
        }
        if (contacts_sliding(&variations->study.instance) && !rub_stage(variations, &point)) {
            return false;
        }
    }
    return true;
}

/* method->right = -(G_x dx + G_p dp) along a direction. */
static void vary_step(Variations *variations, Step step, Direction *direction) {
    Instance *instance = &variations->study.instance;
    double *right = variations->method.right;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK_OF(mark, Balance, balance);
    memset(balance, 0, sizeof *balance);
    memset(right, 0, sizeof variations->method.right);
    for (int i = 0; i < step_point_count(); i++) {
        const StepPoint point = step_point(instance, step, i);
        step_seed(&point, direction->states, direction->seed.states);
        step_tangent(instance, &point, &direction->seed, balance);
        if (point.kind == POINT_STAGE) {
            memcpy(balance->rates, direction->stages[point.place] + 2 * N, N_FURTHER * sizeof(double));
            for (int k = 0; k < N && N_FURTHER > 0; k++) {
                balance->forces[k] += direction->stages[point.place][N + k];
            }
        }
        step_couple(&point, balance, right, false);
    }
    for (int i = 0; i < SIZE_OF_STEP; i++) {
        right[i] = -right[i];
    }
    arena_release(mark);
}

/* The states at the end, for changes of the unknowns. */
static void end_direction(const DirectedMemory *method, double h, Direction *direction) {
    double *states = direction->new_states;
    for (int k = 0; k < N_STATES; k++) {
        const bool velocity = k >= N && k < 2 * N;
        for (int j = 0; j < S && !velocity; j++) {
            states[k] += h * COLLOCATION.b[j] * method->change[j * R + (k < N ? k : k - N)];
        }
    }
    memcpy(states + N, method->change + S * R + NODES.count * K, N * sizeof(double));
}

bool directions_follow(Variations *variations, Step step) {
    DirectedMemory *method = &variations->method;
    const bool moves = step.length > 0.0 && variations->count > 0;
    if (moves && (!step_linearize(variations, step, false) || !rate_stages(variations, step))) {
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->new_states, direction->states, sizeof direction->new_states);
        memcpy(direction->new_slope, direction->slope, sizeof direction->new_slope);
        if (moves) {
            vary_step(variations, step, direction);
            lu_solve(method->matrix, method->rows, SIZE_OF_STEP, method->right, method->change);
            end_direction(method, step.length, direction);
        }
    }
    return true;
}

bool directions_have_slope(void) {
    return false;
}

double directions_error(Variations *variations, int d, Step step, double tolerance) {
    (void)variations;
    (void)d;
    (void)step;
    (void)tolerance;
    return 0.0; /* steps have a fixed length */
}

bool directions_within(Variations *variations, Step step) {
    (void)variations;
    (void)step;
    return true; /* steps hold no samples */
}
