/* Looking for what the importer should know. The stiffness test: Hairer, Wanner, Solving Ordinary Differential
   Equations II, 2nd edition, section IV.2. */
#include "watching.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "inputs.h"
#include "notices.h"
#include "scale.h"

/* Solver steps from one test of stiffness to the next while there is no suspicion. Methods of one step length test
   EARLY_LOOK at first, because their runs may be short. */
enum { LOOK = 100, EARLY_LOOK = 10 };

/* As in the codes of Hairer and Wanner: a step of AT_THE_LIMIT times the longest stable one is at the limit; after
   CONVINCED steps at the limit the equations count as stiff; CLEARED steps in a row below it end the suspicion. */
static const double AT_THE_LIMIT = 0.98;
static const int64_t CONVINCED = 15, CLEARED = 6;

/* Communication steps in which the position of a motion moved, and its velocity and acceleration were 0: at this number
   the importer is told that it seems to set the position alone. */
static const int64_t LONE_MOVES = 3;

double resolving_step(double frequency) {
    return 0.25 * 3.141592653589793 / frequency;
}

double rounding_of_length(double time) {
    return 4.0 * DBL_EPSILON * fabs(time);
}

void watch_stiffness(Instance *instance, Step step) {
    State *state = &instance->state;
    const uint32_t steps = (uint32_t)++state->steps;
    const bool looks = steps % LOOK == 0 || (METHOD.error_order == 0 && steps < LOOK && steps % EARLY_LOOK == 0);
    if ((state->noticed & NOTICE_STIFF) != 0 || (state->stiff_steps == 0 && !looks)) {
        return;
    }
    if (solver_stiffness(instance) > AT_THE_LIMIT) {
        state->easy_steps = 0;
        if (++state->stiff_steps >= CONVINCED) {
            give_notice(instance, NOTICE_STIFF, step.length, 0);
        }
    } else if (state->stiff_steps > 0 && ++state->easy_steps == CLEARED) {
        state->stiff_steps = state->easy_steps = 0;
    }
}

void watch_length(Instance *instance, double length) {
    State *state = &instance->state;
    const double tolerance = SLIVER * length + rounding_of_length(state->time);
    if (length <= SLIVER * state->equal_step) {
        return; /* what an importer's rounding left over */
    }
    if (state->equal_step > 0.0 && fabs(length - state->equal_step) > tolerance) {
        give_notice(instance, NOTICE_UNEQUAL, length, 0);
    }
    state->equal_step = length;
}

void watch_vibrations(Instance *instance, double length) {
    enum { FIRST = N_MASKS + N_SWITCHES }; /* behind the modes */
    const double *parameters = instance->state.parameters + FIRST;
    if (N_VIBRATIONS > 0 && length > resolving_step(VIBRATIONS[0]) &&
        memcmp(parameters, START_PARAMETERS + FIRST, (SIZE_PARAMETERS - FIRST) * sizeof(double)) == 0) {
        give_notice(instance, NOTICE_UNRESOLVED, length, 0);
    }
}

/* Does this motion have a velocity or an acceleration now, as inputs or by their derivatives? */
static bool is_led(State *state, int input) {
    const double *first = input_derivatives(state, 1);
    return state->inputs[input + 1] != 0.0 || state->inputs[input + 2] != 0.0 || first[input + 1] != 0.0 ||
           first[input + 2] != 0.0;
}

void watch_motions(Instance *instance) {
    State *state = &instance->state;
    int lone = -1;
    for (int k = 0; k < N_MOTIONS; k++) {
        const int input = FIRST_MOTION + 3 * k;
        const bool moves = state->inputs[input] != state->positions[k] || input_derivatives(state, 1)[input] != 0.0;
        lone = MOTION_RATES[k] && moves && !is_led(state, input) ? k : lone;
    }
    if (lone >= 0 && state->time > state->start_time && ++state->lone_moves >= LONE_MOVES) {
        give_notice(instance, NOTICE_MOTION, 0.0, lone);
    }
}

void keep_motions(State *state) {
    for (int k = 0; k < N_MOTIONS; k++) {
        state->positions[k] = state->inputs[FIRST_MOTION + 3 * k];
    }
}

void watch_ranges(Instance *instance) {
    State *state = &instance->state;
    for (int k = 0; k < N_BOUNDED; k++) {
        const double q = state->states[BOUNDED[k]];
        if (!state->left_range[k] && (q < RANGES[k][0] || q > RANGES[k][1])) {
            state->left_range[k] = 1;
            add_notice(instance, NOTICE_RANGE, 0.0, k);
        }
    }
}
