/* Directions through steps of ROS2. With s = g h and A = I - s J, a change of A k = r is

       A dk = dr + s d(J k),

   so that both stages (ros2.c) are solved once more, for what varies, with the factors that there are:

       A dk1 = df(x) + s d(J k1),   A dk2 = df(x + h k1) - 2 dk1 + s d(J k2),   dx_new = dx + h (3 dk1 + dk2) / 2. */
#include "directed_ros2.h"

#include <math.h>
#include <string.h>

#include "directed_steps.h"
#include "ros2.h"

/* The distance of the nearest points beside the motion, relative to the size of the states. Rounding of f_w, over this,
   has a weight of s in a step; a motion that turns within a tenth of its size is still told to 1e-11. */
static const double BESIDE = 3e-4;

double ros2_beside(const Instance *instance, const double k[], int i, double states[]) {
    static const double PLACES[POINTS_BESIDE] = {-2.0, -1.0, 1.0, 2.0};
    static const double WEIGHTS[POINTS_BESIDE] = {1.0 / 12.0, -2.0 / 3.0, 2.0 / 3.0, -1.0 / 12.0};
    const double *present = instance->state.states;
    double speed = 0.0; /* in sizes of the states, 1/s */
    for (int j = 0; j < N_STATES; j++) {
        speed = fmax(speed, fabs(k[j]) / (fabs(present[j]) + NOMINAL_STATES[j]));
    }
    const double width = BESIDE / speed;
    for (int j = 0; j < N_STATES && isfinite(width); j++) {
        states[j] = present[j] + PLACES[i] * width * k[j];
    }
    return isfinite(width) ? WEIGHTS[i] / width : 0.0;
}

/* Adds s d(J k) to a stage of all directions, where k is that stage of the motion, and solves for its change. */
static bool solve_bent(Variations *variations, Step step, int stage) {
    Instance *instance = &variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, states, N_STATES);
    const SolverScratch *work = &instance->scratch.solver;
    for (int i = 0; i < POINTS_BESIDE; i++) {
        const double weight = GAMMA * step.length * ros2_beside(instance, work->stages[stage], i, states);
        for (int d = 0; d < variations->count; d++) {
            Direction *direction = &variations->directions[d];
            memcpy(direction->seed.states, direction->states, sizeof direction->states);
        }
        if (weight != 0.0 && !directions_evaluate(variations, instance->state.time, states)) {
            return arena_leave(mark, false);
        }
        for (int d = 0; d < variations->count && weight != 0.0; d++) {
            for (int j = N; j < N_STATES; j++) { /* the coordinates have velocities as rates, whose second derivatives
                                                    are 0 */
                variations->directions[d].stages[stage][j] += weight * variations->directions[d].rates[j];
            }
        }
    }
    for (int d = 0; d < variations->count; d++) {
        ros2_solve(instance->arena, work, step.length, variations->directions[d].stages[stage]);
    }
    return arena_leave(mark, true);
}

/* The first stage of all directions, and the right side of the second one but for d(J k2). */
static bool take_both_stages(Variations *variations, Step step) {
    Instance *instance = &variations->study.instance;
    const ArenaMark mark = arena_mark(instance->arena);
    WORK(mark, double, f2, N_STATES);
    if (!ros2_stages(instance, step, f2)) {
        return arena_leave(mark, false);
    }
    for (int d = 0; d < variations->count; d++) {
        memcpy(variations->directions[d].stages[0], variations->directions[d].slope, N_STATES * sizeof(double));
    }
    if (!solve_bent(variations, step, 0)) {
        return arena_leave(mark, false);
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        for (int j = 0; j < N_STATES; j++) {
            direction->seed.states[j] = direction->states[j] + step.length * direction->stages[0][j];
        }
    }
    if (!directions_evaluate(variations, step.end, instance->scratch.stage_states)) {
        return arena_leave(mark, false);
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        for (int j = 0; j < N_STATES; j++) {
            direction->stages[1][j] = direction->rates[j] - 2.0 * direction->stages[0][j];
        }
    }
    return arena_leave(mark, solve_bent(variations, step, 1));
}

bool directions_follow(Variations *variations, Step step) {
    const bool moves = step.length > 0.0 && variations->count > 0;
    if (moves && !take_both_stages(variations, step)) {
        return false;
    }
    for (int d = 0; d < variations->count; d++) {
        Direction *direction = &variations->directions[d];
        memcpy(direction->new_slope, direction->slope, sizeof direction->new_slope);
        for (int j = 0; j < N_STATES; j++) {
            const double change = moves ? 3.0 * direction->stages[0][j] + direction->stages[1][j] : 0.0;
            direction->new_states[j] = direction->states[j] + 0.5 * step.length * change;
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
