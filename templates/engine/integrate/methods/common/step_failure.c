#include "step_failure.h"

#include <math.h>

#include "finite.h"

bool report_iteration(Instance *instance, Step step) {
    instance->failure.kind = FAILURE_ITERATION;
    instance->failure.time = instance->state.time;
    instance->failure.step = step.length;
    return false;
}

bool new_states_finite(Instance *instance, Step step) {
    if (all_finite(instance->scratch.new_states, N_STATES)) {
        return true;
    }
    for (int i = 0; i < N_STATES; i++) {
        if (!isfinite(instance->scratch.new_states[i])) {
            instance->failure.kind = FAILURE_OVERFLOW;
            instance->failure.time = instance->state.time;
            instance->failure.state = i;
            instance->failure.step = step.length;
            return false;
        }
    }
    return true;
}
