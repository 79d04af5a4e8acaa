/* Looking for what the importer should know. The stiffness test: Hairer, Wanner, Solving Ordinary Differential
   Equations II, 2nd edition, section IV.2. */
#include "notices.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const double SAME_LENGTH = 1e-6;    /* relative difference by which importers' rounding may change steps */
static const int64_t LOOK = 100;           /* so many steps apart stiffness is looked for, while none is suspected */
static const double AT_THE_LIMIT = 0.98;   /* of stability; Hairer and Wanner's codes take the same, ... */
#if N_MOTIONS > 0
static const int64_t LONE_MOVES = 3; /* a motion may be put elsewhere once or twice without a velocity */
#endif
static const int64_t CONVINCED = 15, CLEARED = 6; /* ... and these numbers of steps at the limit and below it */

double rounding_of_length(double time) {
    return 4.0 * DBL_EPSILON * fabs(time);
}

/* To be told once, at the end of the communication step; one waits there for the next if another is told. */
static void give_notice(Instance *instance, NoticeKind kind, double step, int index) {
    if ((instance->state.noticed & (int64_t)kind) == 0 && instance->notice.kind == NOTICE_NONE) {
        instance->state.noticed |= (int64_t)kind;
        instance->notice = (Notice){kind, instance->state.time, step, index};
    }
}

void watch_stiffness(Instance *instance, Step step) {
    State *state = &instance->state;
    const bool looks = ++state->steps % LOOK == 0 || (METHOD.error_order == 0 && state->steps < LOOK);
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
    const double tolerance = SAME_LENGTH * length + rounding_of_length(state->time);
    if (length <= SAME_LENGTH * state->equal_step) {
        return; /* what an importer's rounding left over */
    }
    if (state->equal_step > 0.0 && fabs(length - state->equal_step) > tolerance) {
        give_notice(instance, NOTICE_UNEQUAL, length, 0);
    }
    state->equal_step = length;
}

void watch_vibrations(Instance *instance, double length) {
#if N_VIBRATIONS > 0
    const double *parameters = instance->state.parameters;
    if (length > RESOLVING_STEP(VIBRATIONS[0]) &&
        memcmp(parameters, START_PARAMETERS, SIZE_PARAMETERS * sizeof(double)) == 0) {
        give_notice(instance, NOTICE_UNRESOLVED, length, 0);
    }
#else
    (void)instance;
    (void)length;
#endif
}

#if N_MOTIONS > 0
/* Does this motion have a velocity or an acceleration now, as inputs or by their derivatives? */
static bool is_led(State *state, int input) {
    const double *first = input_derivatives(state, 1);
    return state->inputs[input + 1] != 0.0 || state->inputs[input + 2] != 0.0 || first[input + 1] != 0.0 ||
           first[input + 2] != 0.0;
}
#endif

void watch_motions(Instance *instance) {
#if N_MOTIONS > 0
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
#else
    (void)instance;
#endif
}

void keep_motions(State *state) {
#if N_MOTIONS > 0
    for (int k = 0; k < N_MOTIONS; k++) {
        state->positions[k] = state->inputs[FIRST_MOTION + 3 * k];
    }
#else
    (void)state;
#endif
}

void watch_ranges(Instance *instance, Step step) {
#if N_BOUNDED > 0
    for (int k = 0; k < N_BOUNDED; k++) {
        const double q = instance->scratch.new_states[BOUNDED[k]];
        if (q < RANGES[k][0] || q > RANGES[k][1]) {
            give_notice(instance, NOTICE_RANGE, step.length, k);
        }
    }
#else
    (void)instance;
    (void)step;
#endif
}
