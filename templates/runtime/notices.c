/* Looking for what the importer should know. The stiffness test: Hairer, Wanner, Solving Ordinary Differential
   Equations II, 2nd edition, section IV.2. */
#include "notices.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const double SAME_LENGTH = 1e-6;    /* relative difference by which importers' rounding may change steps */
static const int64_t LOOK = 100;           /* so many steps apart stiffness is looked for, while none is suspected */
static const double AT_THE_LIMIT = 0.98;   /* of stability; Hairer and Wanner's codes take the same, ... */
static const int64_t CONVINCED = 15, CLEARED = 6; /* ... and these numbers of steps at the limit and below it */

double rounding_of_length(double time) {
    return 4.0 * DBL_EPSILON * fabs(time);
}

/* To be told once, at the end of the communication step. */
static void give_notice(Instance *instance, NoticeKind kind, double step) {
    if ((instance->state.noticed & (int64_t)kind) == 0) {
        instance->state.noticed |= (int64_t)kind;
        instance->notice = (Notice){kind, instance->state.time, step};
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
        if (++state->stiff_steps == CONVINCED) {
            give_notice(instance, NOTICE_STIFF, step.length);
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
        give_notice(instance, NOTICE_UNEQUAL, length);
    }
    state->equal_step = length;
}

void watch_vibrations(Instance *instance, double length) {
#if N_VIBRATIONS > 0
    const double *parameters = instance->state.parameters;
    if (length > RESOLVING_STEP(VIBRATIONS[0]) &&
        memcmp(parameters, START_PARAMETERS, SIZE_PARAMETERS * sizeof(double)) == 0) {
        give_notice(instance, NOTICE_UNRESOLVED, length);
    }
#else
    (void)instance;
    (void)length;
#endif
}
