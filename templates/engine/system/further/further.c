/* The generated formulas. */
#include "further.h"

#include <math.h>

bool further_finite(Instance *instance, double time, const double rates[]) {
    for (int k = 0; k < N_FURTHER; k++) {
        if (!isfinite(rates[k])) {
            instance->failure.kind = FAILURE_FURTHER;
            instance->failure.time = time;
            instance->failure.state = 2 * N_COORDINATES + k;
            instance->failure.amount = rates[k];
            return false;
        }
    }
    return true;
}

bool further_rates(Instance *instance, double time, const double states[], const double inputs[],
                   const double unknowns[], double rates[]) {
    mechanism_further(time, states, inputs, instance->state.parameters, unknowns, rates);
    return further_finite(instance, time, rates);
}

void further_tangent(const Instance *instance, double time, const double states[], const double inputs[],
                     const double unknowns[], const Seed *seed, const double changed[], double changes[]) {
    mechanism_further_tangent(time, states, inputs, instance->state.parameters, unknowns, seed->time, seed->states,
                              seed->inputs, seed->parameters, changed, changes);
}
