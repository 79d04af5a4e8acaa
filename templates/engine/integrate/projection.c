#include "projection.h"

#include <float.h>
#include <string.h>

#include "constraints.h"
#include "derivative.h"
#include "inputs.h"

bool project(Instance *instance, double time, double states[], bool *moved) {
    return constraints_project(instance, time, inputs_at(instance, time), states, moved);
}

bool bring_back(Instance *instance, double time, double states[], double derivatives[]) {
    bool moved;
    return project(instance, time, states, &moved) &&
           (!moved || derivative_at(instance, time, states, derivatives));
}

bool bring_back_result(Instance *instance, Step step) {
    Scratch *scratch = &instance->scratch;
    memcpy(scratch->unprojected, scratch->new_states, sizeof scratch->unprojected);
    const bool waits = REAL_TIME && DBL_DIG > 10 && step.end < scratch->step_end;
    return waits || METHOD.variational || TIME_STEPPING ||
           bring_back(instance, step.end, scratch->new_states, scratch->new_derivatives);
}
